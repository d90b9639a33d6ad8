//! Parts of a Kernel, by the roles of its classes.
//!
//! A part keeps its instructions in their order. What it takes from earlier parts it reads from
//! live values, and what others take of it, it leaves in cells behind the instruction that makes
//! it. What may stand in several parts is copied into each that needs it. `init` is cut by the
//! places that its instructions touch; what is pure of it is copied.

use std::collections::{BTreeMap, BTreeSet};

use whippen_kernel::op::Immediate;
use whippen_kernel::{Cell, Inst, Kernel, Live, Op, Range, Region, Type, Value, ValueInfo, sweep};

use crate::choose::Roles;
use crate::classes::Classes;
use crate::nodes::{Nodes, Place, places, uses};
use crate::{Of, Part, Parts, Role, Wire};

/// Cuts a kernel with so many members; none where a class would need what comes later.
pub fn cut(
    kernel: &Kernel,
    nodes: &Nodes,
    classes: &Classes,
    roles: &Roles,
    members: usize,
) -> Option<Parts> {
    let cutter = Cutter {
        kernel,
        nodes,
        classes,
        roles,
    };
    let all = in_order(roles, members);
    if !cutter.is_in_order() {
        return None;
    }
    let mut wires: BTreeMap<Value, Wire> = BTreeMap::new();
    let taken: Vec<BTreeSet<Value>> = all.iter().map(|role| cutter.taken(*role)).collect();
    let mut parts = Vec::new();
    let mut owned = Vec::new();
    for (part, role) in all.iter().enumerate() {
        let left = taken.iter().flatten().copied().collect();
        let cut = cutter.part(*role, &taken[part], &left);
        let wires_of = cut.kernel.cells.len().saturating_sub(1) as u32;
        for (value, word) in cut.left {
            let number = wires_of;
            let (from, to) = (Of { part, number }, Vec::new());
            wires.insert(value, Wire { from, word, to });
        }
        for (value, number) in cut.taken {
            let wire = wires.get_mut(&value)?;
            wire.to.push(Of { part, number });
        }
        parts.push(Part {
            role: *role,
            kernel: cut.kernel,
        });
        owned.push(cut.numbers);
    }
    let find = |kind: Immediate, number: u32| {
        let of = |(part, own): (usize, &Numbers)| {
            own.get(kind, number).map(|number| Of { part, number })
        };
        owned.iter().enumerate().find_map(of)
    };
    let lives = (0..kernel.lives.len() as u32).map(|live| find(Immediate::Live, live));
    let cells = (0..kernel.cells.len() as u32).map(|cell| find(Immediate::Cell, cell));
    Some(Parts {
        lives: lives.collect::<Option<_>>()?,
        cells: cells.collect::<Option<_>>()?,
        parts,
        wires: wires.into_values().collect(),
    })
}

/// The parts of so many members, in the order in which they may run.
fn in_order(roles: &Roles, members: usize) -> Vec<Role> {
    let own = |role| roles.own.contains(&role).then_some(role);
    let (early, sound) = (own(Role::Early), own(Role::Sound));
    early
        .into_iter()
        .chain([Role::Head])
        .chain((0..members as u32).map(Role::Member))
        .chain(sound)
        .chain([Role::Tail])
        .collect()
}

struct Cutter<'a> {
    kernel: &'a Kernel,
    nodes: &'a Nodes,
    classes: &'a Classes,
    roles: &'a Roles,
}

/// A part that is cut.
struct CutPart {
    kernel: Kernel,
    /// The live value of each value that it takes.
    taken: BTreeMap<Value, u32>,
    /// The word of its wires of each value that it leaves.
    left: BTreeMap<Value, u32>,
    numbers: Numbers,
}

impl Cutter<'_> {
    /// The role of a node that stands in one part alone.
    fn role(&self, node: usize) -> Option<Role> {
        Some(self.roles.own[self.classes.of_node[node]?])
    }

    /// The role of a place: the tail's where nobody uses it.
    fn role_of(&self, place: Place) -> Role {
        let class = self.classes.of_place.get(&place);
        class.map_or(Role::Tail, |class| self.roles.own[*class])
    }

    /// Whether no part needs one that runs later, or beside it.
    fn is_in_order(&self) -> bool {
        (0..self.nodes.nodes.len()).all(|at| {
            let Some(own) = self.role(at) else {
                return true;
            };
            let mut needs = self.nodes.nodes[at].needs.iter();
            needs.all(|from| match (self.role(*from), own) {
                (Some(from), own) if from == own => true,
                (Some(Role::Early), own) => own != Role::Head,
                (Some(Role::Head), own) => own != Role::Early,
                (Some(Role::Member(_)), own) => matches!(own, Role::Sound | Role::Tail),
                _ => false,
            })
        })
    }

    /// The nodes of a part, copies among them.
    fn nodes_of(&self, role: Role) -> BTreeSet<usize> {
        let all = 0..self.nodes.nodes.len();
        let mut own: BTreeSet<usize> = all.filter(|at| self.role(*at) == Some(role)).collect();
        let mut open: Vec<usize> = own.iter().copied().collect();
        while let Some(at) = open.pop() {
            for value in uses(&self.nodes.nodes[at].inst) {
                let from = self.nodes.defining.get(&value);
                let copy = from.filter(|from| self.nodes.nodes[**from].copied);
                open.extend(copy.filter(|from| own.insert(**from)));
            }
        }
        own
    }

    /// The nodes of a part, member by member where several are together, behind what is for all of
    /// them: so as little is alive at a time as where they are apart.
    fn one_by_one(&self, own: BTreeSet<usize>) -> Vec<usize> {
        let mut turns: BTreeMap<usize, Role> = BTreeMap::new();
        for at in own.iter().rev() {
            // What is copied stands where it is first used.
            let role = match self.classes.of_node[*at] {
                Some(class) => self.roles.apart[class],
                None => turns.get(at).copied().unwrap_or(Role::Early),
            };
            turns.insert(*at, role);
            for value in uses(&self.nodes.nodes[*at].inst) {
                let from = self.nodes.defining.get(&value);
                if let Some(from) = from.filter(|from| self.nodes.nodes[**from].copied) {
                    let first = turns.entry(*from).or_insert(role);
                    *first = role.min(*first);
                }
            }
        }
        let mut ordered: Vec<usize> = own.into_iter().collect();
        ordered.sort_by_key(|at| (turns.get(at).copied(), *at));
        ordered
    }

    /// The values that a part takes from others.
    fn taken(&self, role: Role) -> BTreeSet<Value> {
        let own = self.nodes_of(role);
        let used = own.iter().flat_map(|at| uses(&self.nodes.nodes[*at].inst));
        let is_foreign = |value: &Value| {
            let from = self.nodes.defining.get(value);
            from.is_some_and(|from| !own.contains(from))
        };
        used.filter(is_foreign).collect()
    }

    /// A part that takes some values, where others are left for anybody.
    fn part(&self, role: Role, taken: &BTreeSet<Value>, left: &BTreeSet<Value>) -> CutPart {
        let mut cut = CutPart {
            kernel: Kernel {
                name: format!("{}.{role}", self.kernel.name),
                rate_hz: self.kernel.rate_hz,
                values: self.kernel.values.clone(),
                ..Kernel::default()
            },
            taken: BTreeMap::new(),
            left: BTreeMap::new(),
            numbers: Numbers::default(),
        };
        self.declare(role, &mut cut);
        let own = self.nodes_of(role);
        let results = |at: &usize| self.nodes.nodes[*at].inst.results.iter();
        let leaving = own.iter().filter(|at| self.role(**at).is_some());
        let count = leaving
            .flat_map(results)
            .filter(|value| left.contains(value))
            .count();
        if count > 0 {
            cut.declare_wires(count);
        }
        let mut insts = Vec::new();
        let mut renamed = BTreeMap::new();
        for value in taken {
            let new = cut.take(*value, &mut insts);
            renamed.insert(*value, new);
        }
        for at in self.one_by_one(own) {
            let mut inst = self.nodes.nodes[at].inst.clone();
            inst.for_each_value_mut(&mut |value| {
                *value = renamed.get(value).copied().unwrap_or(*value);
            });
            cut.numbers
                .renumber(&mut inst, self.kernel, &mut cut.kernel);
            let results = inst.results.clone();
            insts.push(inst);
            if self.role(at).is_some() {
                let mine = results.into_iter().filter(|value| left.contains(value));
                mine.for_each(|value| cut.leave(value, &mut insts));
            }
        }
        cut.kernel.tick = region(insts);
        self.init(role, &mut cut);
        sweep(&mut cut.kernel);
        cut
    }

    /// What a part has whether or not it uses it: words that go out and events are numbered as in
    /// the whole, and so are those that come in.
    fn declare(&self, role: Role, cut: &mut CutPart) {
        let all = |kind, count| (0..count as u32).map(move |number| (kind, number));
        cut.kernel.inputs.clone_from(&self.kernel.inputs);
        cut.numbers
            .keep(all(Immediate::Input, self.kernel.inputs.len()));
        if role == Role::Tail {
            cut.kernel.outputs.clone_from(&self.kernel.outputs);
            cut.numbers
                .keep(all(Immediate::Output, self.kernel.outputs.len()));
            cut.kernel.events.clone_from(&self.kernel.events);
            cut.numbers
                .keep(all(Immediate::Event, self.kernel.events.len()));
        }
        let kernel = self.kernel;
        for (kind, number) in all(Immediate::Cell, kernel.cells.len())
            .chain(all(Immediate::Line, kernel.lines.len()))
            .chain(all(Immediate::Live, kernel.lives.len()))
        {
            let place = match kind {
                Immediate::Cell => Place::Cell(number),
                Immediate::Line => Place::Line(number),
                _ => Place::Live(number),
            };
            if self.role_of(place) == role {
                cut.numbers.number(kind, number, kernel, &mut cut.kernel);
            }
        }
    }

    /// What a part does before the first tick: what touches its memory, and what that needs.
    fn init(&self, role: Role, cut: &mut CutPart) {
        let mut insts = Vec::new();
        for inst in &self.kernel.init.insts {
            let places = places(inst);
            // Those that touch nothing are pure, and go where they are not used.
            if places.iter().all(|place| self.role_of(*place) == role) {
                let mut inst = inst.clone();
                cut.numbers
                    .renumber(&mut inst, self.kernel, &mut cut.kernel);
                insts.push(inst);
            }
        }
        cut.kernel.init = region(insts);
    }
}

impl CutPart {
    /// Reads what another part has left; gives the value.
    fn take(&mut self, value: Value, insts: &mut Vec<Inst>) -> Value {
        let ValueInfo { ty, range } = self.kernel.values[value];
        let number = self.kernel.lives.len() as u32;
        self.kernel.lives.push(Live {
            name: format!("wire.{}", value.0),
            range,
            init: 0.clamp(range.low, range.high) as i32,
        });
        self.taken.insert(value, number);
        let word = self.define(Type::I32, range);
        insts.push(inst(Op::Live(number), vec![], word));
        if ty != Type::I1 {
            return word;
        }
        let zero = self.define(Type::I32, Range::point(0));
        insts.push(inst(Op::Const(0), vec![], zero));
        let holds = self.define(Type::I1, range);
        insts.push(inst(Op::Lt, vec![zero, word], holds));
        holds
    }

    /// Leaves a value for others.
    fn leave(&mut self, value: Value, insts: &mut Vec<Inst>) {
        let ValueInfo { ty, range } = self.kernel.values[value];
        let word = match ty {
            Type::I1 => {
                let [no, yes] = [0, 1].map(|of| {
                    let own = self.define(Type::I32, Range::point(of));
                    insts.push(inst(Op::Const(of), vec![], own));
                    own
                });
                let word = self.define(Type::I32, range);
                insts.push(inst(Op::Select, vec![value, yes, no], word));
                word
            }
            _ => value,
        };
        let number = self.left.len() as u32;
        let index = self.define(Type::I32, Range::point(number.into()));
        insts.push(inst(Op::Const(number.into()), vec![], index));
        let cell = self.kernel.cells.len() as u32 - 1;
        insts.push(Inst {
            results: Vec::new(),
            ..inst(Op::SetAt(cell), vec![index, word], word)
        });
        self.left.insert(value, number);
    }

    /// Declares the words that are left: a grid, which modes keep in memory whatever they know.
    fn declare_wires(&mut self, count: usize) {
        self.kernel.cells.push(Cell {
            name: "wires".to_string(),
            ty: Type::I32,
            len: count.max(2) as u32,
            range: Type::I32.range(),
            init: 0,
        });
    }

    fn define(&mut self, ty: Type, range: Range) -> Value {
        self.kernel.values.push(ValueInfo { ty, range })
    }
}

fn inst(op: Op, args: Vec<Value>, result: Value) -> Inst {
    Inst {
        op,
        args,
        results: vec![result],
        regions: Vec::new(),
        origin: None,
    }
}

fn region(insts: Vec<Inst>) -> Region {
    Region {
        insts,
        ..Region::default()
    }
}

/// The numbers that a part has for what the whole declares.
#[derive(Debug, Default)]
struct Numbers {
    own: Vec<(Immediate, u32, u32)>,
}

impl Numbers {
    fn get(&self, kind: Immediate, number: u32) -> Option<u32> {
        let known = self.own.iter().find(|own| (own.0, own.1) == (kind, number));
        known.map(|own| own.2)
    }

    /// Numbers that stay what they are.
    fn keep(&mut self, all: impl Iterator<Item = (Immediate, u32)>) {
        self.own
            .extend(all.map(|(kind, number)| (kind, number, number)));
    }

    /// The number of what the whole declares, which is declared if it is not yet.
    fn number(&mut self, kind: Immediate, number: u32, from: &Kernel, to: &mut Kernel) -> u32 {
        if let Some(known) = self.get(kind, number) {
            return known;
        }
        let at = number as usize;
        let own = match kind {
            Immediate::Live => add(&mut to.lives, &from.lives[at]),
            Immediate::Keyed => add(&mut to.keyed, &from.keyed[at]),
            Immediate::Cell => add(&mut to.cells, &from.cells[at]),
            Immediate::Line => add(&mut to.lines, &from.lines[at]),
            Immediate::Table => add(&mut to.tables, &from.tables[at]),
            _ => number,
        };
        self.own.push((kind, number, own));
        own
    }

    /// Names by the part's numbers what an instruction, and those inside it, name.
    fn renumber(&mut self, inst: &mut Inst, from: &Kernel, to: &mut Kernel) {
        let row = inst.op.row();
        let immediates = row.immediates.iter().zip(inst.op.immediates());
        let own: Vec<i64> = immediates
            .map(|(kind, number)| match kind.is_declared() {
                true => self.number(*kind, number as u32, from, to).into(),
                false => number,
            })
            .collect();
        if let Some(op) = (row.make)(&own) {
            inst.op = op;
        }
        for region in &mut inst.regions {
            for inst in &mut region.insts {
                self.renumber(inst, from, to);
            }
        }
    }
}

fn add<T: Clone>(to: &mut Vec<T>, what: &T) -> u32 {
    to.push(what.clone());
    to.len() as u32 - 1
}
