//! The text form of a Model, for people and for tests.
//!
//! Declarations come first, then the values that have a name or several users, in the order in
//! which one pass computes them, then what happens. Values without a name are numbered; what has
//! one user only stands where it is used. All numbers are SI.

use std::fmt::{self, Display, Formatter};

use super::{
    Action, CellId, Cmp, GridNumber, Interval, Model, Node, NodeId, Reading, Rule, RuleKind, Side,
    Strand,
};
use crate::units::Dim;
use whippen_ids::IdMap;

/// What is nested deeper than this gets a line of its own.
const MAX_DEPTH: u32 = 8;

impl Display for Model {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        let printer = Printer {
            model: self,
            names: names(self),
        };
        writeln!(f, "model {} at {} Hz", self.name, self.rate_hz)?;
        printer.declarations(f)?;
        printer.values(f)?;
        printer.happenings(f)
    }
}

struct Printer<'m> {
    model: &'m Model,
    /// The name of each node that has a line of its own.
    names: IdMap<NodeId, Option<String>>,
}

/// Gives names to nodes that were named, and numbers to those with several users.
fn names(model: &Model) -> IdMap<NodeId, Option<String>> {
    let mut names: IdMap<NodeId, Option<String>> = IdMap::filled(None, model.dag.len());
    for named in &model.named {
        let id = named.value;
        if !is_leaf(model.dag.get(id)) && names[id].is_none() {
            names[id] = Some(named.name.clone());
        }
    }
    let uses = uses(model);
    let mut depth = IdMap::filled(0, model.dag.len());
    let mut count = 0;
    for (id, node) in model.dag.nodes().filter(|(_, node)| !is_leaf(node)) {
        let operands = node.operands();
        depth[id] = 1 + operands.iter().map(|o| depth[o]).max().unwrap_or(0);
        if names[id].is_none() && (uses[id] > 1 || depth[id] > MAX_DEPTH) {
            count += 1;
            names[id] = Some(format!("%{count}"));
        }
        if names[id].is_some() {
            depth[id] = 0;
        }
    }
    names
}

fn uses(model: &Model) -> IdMap<NodeId, u32> {
    let mut uses = IdMap::filled(0, model.dag.len());
    let mut roots = model.clone();
    let roots = roots
        .roots_mut()
        .into_iter()
        .map(|id| *id)
        .collect::<Vec<_>>();
    for id in model
        .dag
        .nodes()
        .flat_map(|(_, node)| node.operands())
        .chain(roots)
    {
        uses[id] += 1;
    }
    uses
}

fn is_leaf(node: &Node) -> bool {
    node.operands().is_empty()
}

impl Printer<'_> {
    fn declarations(&self, f: &mut Formatter) -> fmt::Result {
        let model = self.model;
        for s in &model.senses {
            let slew = s
                .slew_per_s
                .map(|v| format!(", slew {}", number(v)))
                .unwrap_or_default();
            writeln!(
                f,
                "sense {}: {} in {}, window {}{slew}",
                s.name,
                s.dim,
                range(s.range),
                s.window
            )?;
        }
        for l in &model.lives {
            writeln!(
                f,
                "live {}: {} = {} in {}",
                l.name,
                ty(l.dim),
                number(l.value),
                range(l.range)
            )?;
        }
        for k in &model.keyed {
            let ends = k.values.first().zip(k.values.last());
            let ends = ends.map_or(String::new(), |(a, b)| {
                format!(" from {} to {}", number(*a), number(*b))
            });
            writeln!(
                f,
                "keyed {}: {} in {}, {} values{ends}",
                k.name,
                k.dim,
                range(k.range),
                k.values.len()
            )?;
        }
        self.cells(f)?;
        self.signals(f)?;
        self.strings(f)?;
        for m in &model.machines {
            writeln!(f, "machine {}: {}", m.name, m.states.join(", "))?;
        }
        for p in &model.pulses {
            writeln!(f, "pulse {}: {} ticks", p.name, p.ticks)?;
        }
        Ok(())
    }

    fn cells(&self, f: &mut Formatter) -> fmt::Result {
        for c in &self.model.cells {
            let kind = format!("{:?}", c.kind).to_lowercase();
            writeln!(
                f,
                "{kind} {}: {} in {} = {}",
                c.name,
                c.dim,
                range(c.range),
                number(c.init)
            )?;
        }
        Ok(())
    }

    /// Strings.
    fn strings(&self, f: &mut Formatter) -> fmt::Result {
        for s in &self.model.strands {
            writeln!(
                f,
                "string {}: along {}, {} points, {} in {}, rate {}",
                s.name,
                range(s.along),
                s.parts.saturating_sub(1),
                s.displacement,
                range(s.range),
                number(s.rate)
            )?;
        }
        Ok(())
    }

    /// Noises and delay lines.
    fn signals(&self, f: &mut Formatter) -> fmt::Result {
        let model = self.model;
        for n in &model.noises {
            let keys = match n.seeds.len() {
                1 => String::new(),
                keys => format!(", {keys} keys"),
            };
            writeln!(f, "noise {}: from {:#010x}{keys}", n.name, n.first(0))?;
        }
        for d in &model.delays {
            writeln!(
                f,
                "delay {}: {} in {}, {} ticks",
                d.name,
                d.dim,
                range(d.range),
                d.ticks
            )?;
        }
        Ok(())
    }

    fn values(&self, f: &mut Formatter) -> fmt::Result {
        for (id, node) in self.model.dag.nodes() {
            if let Some(name) = &self.names[id] {
                writeln!(f, "{name} = {}", self.inner(node, 0))?;
            }
        }
        for named in &self.model.named {
            if self.names[named.value].as_ref() != Some(&named.name) {
                writeln!(f, "{} = {}", named.name, self.value(named.value, 0))?;
            }
        }
        Ok(())
    }

    fn happenings(&self, f: &mut Formatter) -> fmt::Result {
        let model = self.model;
        for b in &model.bodies {
            let hold = b
                .hold
                .map(|h| format!(", held while {}", self.value(h, 0)))
                .unwrap_or_default();
            let acceleration = self.value(b.acceleration, 0);
            writeln!(
                f,
                "body {}: {}' += dt * ({acceleration}){hold}",
                b.name,
                self.cell(b.coordinate)
            )?;
        }
        model.strands.iter().try_for_each(|s| self.strand(f, s))?;
        for &(cell, value) in &model.nexts {
            writeln!(f, "next {} = {}", self.cell(cell), self.value(value, 0))?;
        }
        for d in &model.delays {
            writeln!(f, "feed {} = {}", d.name, self.value(d.feed, 0))?;
        }
        for rule in &model.rules {
            self.rule(f, rule)?;
        }
        for force in &model.forces {
            let name = &force.name;
            writeln!(f, "force {name} = {}", self.value(force.value, 0))?;
        }
        for sound in &model.sounds {
            let side = match sound.side {
                None => "",
                Some(Side::Left) => " on left",
                Some(Side::Right) => " on right",
            };
            writeln!(
                f,
                "sound {}{side} = {}",
                sound.name,
                self.value(sound.value, 0)
            )?;
        }
        Ok(())
    }

    fn strand(&self, f: &mut Formatter, s: &Strand) -> fmt::Result {
        let hold = s
            .hold
            .map(|h| format!(", held while {}", self.value(h, 0)))
            .unwrap_or_default();
        let [p, q, v, r] = s.coefficients.map(|c| self.value(c, 0));
        writeln!(f, "string {}: P {p}, Q {q}, V {v}, R {r}{hold}", s.name)?;
        let rub = s.friction.as_ref().map(|rub| &rub.push);
        for push in s.pushes.iter().chain(rub) {
            let (change, place) = (self.value(push.change, 0), self.value(push.place, 0));
            writeln!(f, "    push {change} at {place}")?;
        }
        Ok(())
    }

    fn rule(&self, f: &mut Formatter, rule: &Rule) -> fmt::Result {
        let kind = if matches!(rule.kind, RuleKind::Event { .. }) {
            "event"
        } else {
            "step"
        };
        writeln!(
            f,
            "{kind} {} when {}",
            self.model.rule_name(rule),
            self.value(rule.guard, 0)
        )?;
        for action in &rule.actions {
            match action {
                Action::Write { cell, value, .. } => {
                    writeln!(f, "    {} := {}", self.cell(*cell), self.value(*value, 0))?;
                }
                Action::Fire { pulse, value, .. } => {
                    let name = &self.model.pulses[pulse].name;
                    writeln!(f, "    fire {name} at {}", self.value(*value, 0))?;
                }
                Action::Emit { emission, args, .. } => {
                    let kind = &self.model.emissions[emission];
                    let args = kind
                        .args
                        .iter()
                        .zip(args)
                        .map(|((n, _), v)| format!("{n}: {}", self.value(*v, 0)));
                    writeln!(
                        f,
                        "    emit {}({})",
                        kind.name,
                        args.collect::<Vec<_>>().join(", ")
                    )?;
                }
            }
        }
        Ok(())
    }

    fn cell(&self, id: CellId) -> &str {
        &self.model.cells[id].name
    }

    /// A value where it is used; in brackets if it binds more loosely than its place.
    fn value(&self, id: NodeId, place: u8) -> String {
        match &self.names[id] {
            Some(name) => name.clone(),
            None => self.inner(self.model.dag.get(id), place),
        }
    }

    fn inner(&self, node: &Node, place: u8) -> String {
        let (text, binding) = self.text(node);
        if binding < place {
            format!("({text})")
        } else {
            text
        }
    }

    /// The text of a node and how tightly it binds: 0 `if`, 1 `or`, 2 `and`, 3 `not`, 4
    /// comparisons, 5 sums, 6 products, 7 signs, 8 powers, 9 names.
    fn text(&self, node: &Node) -> (String, u8) {
        let model = self.model;
        let infix = |a: &NodeId, op: &str, b: &NodeId, level: u8| {
            (
                format!(
                    "{} {op} {}",
                    self.value(*a, level),
                    self.value(*b, level + 1)
                ),
                level,
            )
        };
        match node {
            Node::Const(c) => (number(c.0), if c.0 < 0.0 { 7 } else { 9 }),
            Node::Bool(b) => ((if *b { "on" } else { "off" }).to_string(), 9),
            Node::Sense(s) => (model.senses[*s as usize].name.clone(), 9),
            Node::Slope(s) => (format!("{}'", model.senses[*s as usize].name), 9),
            Node::Curvature(s) => (format!("{}''", model.senses[*s as usize].name), 9),
            Node::Live(l) | Node::LiveBool(l) => (model.lives[*l as usize].name.clone(), 9),
            Node::Keyed(k) => (model.keyed[*k as usize].name.clone(), 9),
            Node::Cell(c) => (self.cell(*c).to_string(), 9),
            Node::Noise(n) => (model.noises[n].name.clone(), 9),
            Node::Tap(d, t) => (
                format!("{}({} ticks)", model.delays[d].name, self.value(*t, 0)),
                9,
            ),
            Node::Read(s, reading, place) => {
                let (name, place) = (&model.strands[s].displacement, self.value(*place, 0));
                let text = match reading {
                    Reading::Displacement => format!("{name}({place})"),
                    Reading::Rate => format!("{name}({place})'"),
                    Reading::Slope => format!("d1({name}, {place})"),
                };
                (text, 9)
            }
            Node::Mean(s, all) => {
                let place = all.first().map_or(String::new(), |p| self.value(*p, 0));
                (format!("mean({}, {place})", model.strands[s].name), 9)
            }
            Node::Spread(s, place) => {
                let place = self.value(*place, 0);
                (format!("spread({}, {place})", model.strands[s].name), 9)
            }
            Node::Grid(s, GridNumber::PerMetre) => (format!("parts({})", model.strands[s].name), 9),
            Node::Grid(s, GridNumber::FirstMode) => (format!("mode({})", model.strands[s].name), 9),
            Node::Tuned(d, t, _) => (
                format!(
                    "tuned({}, {} ticks)",
                    model.delays[d].name,
                    self.value(*t, 0)
                ),
                9,
            ),
            Node::Is(m, s) => {
                let machine = &model.machines[m];
                (
                    format!("{} is {}", machine.name, machine.states[*s as usize]),
                    4,
                )
            }
            Node::Linear(c0, terms) => {
                let term =
                    |(c, x): &(super::dag::Real, NodeId)| match (c.0.abs(), self.value(*x, 7)) {
                        (1.0, x) => x,
                        (factor, x) => format!("{} * {x}", number(factor)),
                    };
                let mut text = if c0.0 == 0.0 {
                    String::new()
                } else {
                    number(c0.0)
                };
                for t in terms {
                    text += match (text.is_empty(), t.0.0 < 0.0) {
                        (true, false) => "",
                        (true, true) => "-",
                        (false, false) => " + ",
                        (false, true) => " - ",
                    };
                    text += &term(t);
                }
                (text, 5)
            }
            Node::Add(a, b) => infix(a, "+", b, 5),
            Node::Sub(a, b) => infix(a, "-", b, 5),
            Node::Mul(a, b) => infix(a, "*", b, 6),
            Node::Div(a, b) => infix(a, "/", b, 6),
            Node::Trial(last, _) => (format!("trial({})", self.cell(*last)), 9),
            Node::Slip(balance) => {
                let [free, gain, law, last] =
                    [balance.free, balance.gain, balance.law, balance.last]
                        .map(|x| self.value(x, 0));
                (
                    format!("slip({free}, gain: {gain}, law: {law}, from: {last})"),
                    9,
                )
            }
            Node::Ratio(a, b, _) => (
                format!("ratio({}, {})", self.value(*a, 0), self.value(*b, 0)),
                9,
            ),
            Node::Curve(curve, x) => {
                let name = curve.table().map_or("curve", |table| &table.name);
                (format!("{name}({})", self.value(*x, 0)), 9)
            }
            Node::Incline(curve, x) => {
                let name = curve.table().map_or("curve", |table| &table.name);
                (format!("{name}'({})", self.value(*x, 0)), 9)
            }
            Node::Neg(a) => (format!("-{}", self.value(*a, 7)), 7),
            Node::Min(a, b) => (
                format!("min({}, {})", self.value(*a, 0), self.value(*b, 0)),
                9,
            ),
            Node::Max(a, b) => (
                format!("max({}, {})", self.value(*a, 0), self.value(*b, 0)),
                9,
            ),
            Node::Abs(a) => (format!("abs({})", self.value(*a, 0)), 9),
            Node::Power(a, 1) => (format!("sqrt({})", self.value(*a, 0)), 9),
            Node::Function(function, a) => {
                (format!("{}({})", function.name(), self.value(*a, 0)), 9)
            }
            Node::Power(a, halves) => (
                format!("{}^{}", self.value(*a, 9), f64::from(*halves) / 2.0),
                8,
            ),
            Node::Compare(Cmp::Lt, a, b) => infix(a, "<", b, 4),
            Node::Compare(Cmp::Le, a, b) => infix(a, "<=", b, 4),
            Node::Compare(Cmp::Gt, a, b) => infix(a, ">", b, 4),
            Node::Compare(Cmp::Ge, a, b) => infix(a, ">=", b, 4),
            Node::And(a, b) => infix(a, "and", b, 2),
            Node::Or(a, b) => infix(a, "or", b, 1),
            Node::Not(a) => (format!("not {}", self.value(*a, 4)), 3),
            Node::Select(c, a, b) | Node::SelectBool(c, a, b) => {
                let [c, a, b] = [c, a, b].map(|x| self.value(*x, 1));
                (format!("if {c} then {a} else {b}"), 0)
            }
        }
    }
}

fn ty(dim: Option<Dim>) -> String {
    dim.map_or_else(|| "bool".to_string(), |dim| dim.to_string())
}

fn range(range: Interval) -> String {
    format!("{} .. {}", number(range.low), number(range.high))
}

/// The shortest text that reads back exactly.
fn number(value: f64) -> String {
    let size = value.abs();
    if size != 0.0 && !(1e-4..1e9).contains(&size) {
        format!("{value:e}")
    } else {
        format!("{value}")
    }
}
