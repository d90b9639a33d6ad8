//! Spells a tree as source text, in the canonical layout.
//!
//! Reading the text again gives the same tree, places aside. Ordinary comments are not part of the
//! tree: who has a text lays that out (`layout`).

mod expr;

use std::fmt::{self, Write};

use super::ast::*;
use super::layout;
use expr::{Shown, list};

/// The text of a file. What could not be read stands in it as `<error>`; such a text has a line per
/// declaration and no further layout.
pub fn print(file: &File) -> String {
    let text: String = file.items.iter().map(item).collect();
    layout(0, &text).unwrap_or(text)
}

fn item(item: &Item) -> String {
    let (doc, header, lines) = match item {
        Item::Instrument(i) => (
            &i.doc,
            format!("instrument {}", i.name.node),
            i.decls.iter().map(decl).collect(),
        ),
        Item::Term(t) => {
            let header = format!(
                "term {}({}) -> {}",
                t.name.node,
                typed(&t.params),
                typed(&t.results)
            );
            (&t.doc, header, t.decls.iter().map(decl).collect())
        }
        Item::Keyboard(k) => (
            &k.doc,
            format!("keyboard {}", k.name.node),
            k.settings.iter().map(setting).collect(),
        ),
    };
    let doc = if doc.is_empty() {
        String::new()
    } else {
        doc.split('\n').map(doc_line).collect()
    };
    format!("{doc}{}\n", block(&header, lines))
}

fn doc_line(line: &str) -> String {
    if line.is_empty() {
        "///\n".to_string()
    } else {
        format!("/// {line}\n")
    }
}

fn typed(names: &[TypedName]) -> String {
    list(names, |t| format!("{}: {}", t.name.node, t.ty.node))
}

/// A header and a block of lines, each of which may be a block itself.
fn block(header: &str, lines: Vec<String>) -> String {
    format!("{header} {{\n{}\n}}", lines.join("\n"))
}

fn setting(setting: &Setting) -> String {
    match setting {
        Setting::Board { name, chips } => match chips {
            Some(chips) => format!("board {} * {}", name.node, chips.node),
            None => format!("board {}", name.node),
        },
        Setting::Device(name) => format!("device {}", name.node),
        Setting::DeviceFile(file) => format!("device \"{}\"", file.node),
        Setting::Rate(rate) => format!("rate {}", Shown(rate)),
        Setting::Keys(low, high) => format!("keys {} .. {}", low.node, high.node),
        Setting::Programs(names) => format!("programs {}", list(names, |n| n.node.clone())),
        Setting::Zones { name, zones, .. } => {
            let zones = list(zones, |z| {
                format!("{} .. {}: {}", z.low.node, z.high.node, z.instrument.node)
            });
            format!("zones {} = {{ {zones} }}", name.node)
        }
        Setting::PerKey {
            instrument,
            param,
            points,
        } => {
            let points = list(points, |(note, value)| {
                format!("{}: {}", note.node, Shown(value))
            });
            format!("{}.{} = {{ {points} }}", instrument.node, param.node)
        }
    }
}

fn decl(one: &Decl) -> String {
    match &one.kind {
        DeclKind::Sense {
            name,
            ty,
            range,
            slew,
            over,
        } => {
            let tail = optional(" slew ", slew.as_ref()) + &optional(" over ", over.as_ref());
            format!("sense {}: {} in {}{tail}", name.node, ty.node, Range(range))
        }
        DeclKind::Param {
            live,
            name,
            value,
            range,
            glide,
        } => {
            let range = range
                .as_ref()
                .map_or(String::new(), |r| format!(" in {}", Range(r)));
            format!(
                "{}param {} = {}{range}{}",
                if *live { "live " } else { "" },
                name.node,
                Shown(value),
                optional(" glide ", glide.as_ref())
            )
        }
        DeclKind::Let { name, value } => format!("let {} = {}", name.node, Shown(value)),
        DeclKind::States { name, transitions } => block(
            &format!("states {}", name.node),
            transitions.iter().map(transition).collect(),
        ),
        DeclKind::State {
            name,
            ty,
            range,
            init,
        } => {
            format!(
                "state {}: {} in {}{}",
                name.node,
                ty.node,
                Range(range),
                optional(" = ", init.as_ref())
            )
        }
        DeclKind::Next { name, value } => format!("next {} = {}", name.node, Shown(value)),
        DeclKind::Body { name, parts } => block(
            &format!("body {}", name.node),
            parts.iter().map(part).collect(),
        ),
        DeclKind::Event {
            name,
            trigger,
            actions,
        } => {
            let (word, expr) = match trigger {
                Trigger::When(guard) => ("when", guard),
                Trigger::Every(period) => ("every", period),
            };
            acting(
                &format!("event {} {word} {}", name.node, Shown(expr)),
                actions,
            )
        }
        DeclKind::Pulse {
            name,
            ty,
            range,
            lasting,
        } => {
            format!(
                "pulse {}: {} in {} lasting {}",
                name.node,
                ty.node,
                Range(range),
                Shown(lasting)
            )
        }
        DeclKind::Noise { name } => format!("noise {}", name.node),
        DeclKind::Delay {
            name,
            ty,
            range,
            lasting,
        } => format!(
            "delay {}: {} in {} lasting {}",
            name.node,
            ty.node,
            Range(range),
            Shown(lasting)
        ),
        DeclKind::Table {
            name,
            ty,
            over,
            cubic,
            knots,
        } => {
            let cubic = if *cubic { " cubic" } else { "" };
            let knots = match knots {
                Knots::Listed(all) => {
                    let all = list(all, |(x, value)| format!("{}: {}", Shown(x), Shown(value)));
                    format!("{{ {all} }}")
                }
                Knots::File(file) => format!("from \"{}\"", file.node),
            };
            format!(
                "table {}: {} over {}{cubic} {knots}",
                name.node, ty.node, over.node
            )
        }
        DeclKind::Feed { delay, value } => format!("feed {} = {}", delay.node, Shown(value)),
        DeclKind::Sound { name, side, value } => {
            let side = side
                .as_ref()
                .map_or(String::new(), |side| format!(" on {}", side.node));
            format!("sound {}{side} = {}", name.node, Shown(value))
        }
        DeclKind::String { name, along, parts } => block(
            &format!("string {} along {}", name.node, Range(along)),
            parts.iter().map(string_part).collect(),
        ),
        DeclKind::Bank {
            name,
            index,
            range,
            decls,
        } => block(
            &format!("bank {} over {} in {}", name.node, index.node, Range(range)),
            decls.iter().map(decl).collect(),
        ),
        DeclKind::Hold { body, guard } => format!("hold {} when {}", body.node, Shown(guard)),
        DeclKind::Force {
            turning,
            name,
            on,
            value,
        } => {
            let on = on.as_ref();
            format!(
                "{} {}{} = {}",
                if *turning { "torque" } else { "force" },
                name.node,
                on.map_or(String::new(), |on| format!(" on {}", on.node)),
                Shown(value)
            )
        }
        DeclKind::Result { name, value } => format!("{} = {}", name.node, Shown(value)),
    }
}

fn optional(word: &str, value: Option<&Expr>) -> String {
    value.map_or(String::new(), |v| format!("{word}{}", Shown(v)))
}

fn transition(t: &Transition) -> String {
    acting(
        &format!("{} -> {} when {}", t.from.node, t.to.node, Shown(&t.guard)),
        &t.actions,
    )
}

/// A header, and its actions if there are any.
fn acting(header: &str, actions: &[Action]) -> String {
    if actions.is_empty() {
        header.to_string()
    } else {
        block(header, actions.iter().map(action).collect())
    }
}

fn action(action: &Action) -> String {
    match &action.kind {
        ActionKind::Emit { name, args } => {
            let args = list(args, |(arg, value)| {
                format!("{}: {}", arg.node, Shown(value))
            });
            format!("emit {}({args})", name.node)
        }
        ActionKind::Write { name, rate, value } => {
            format!(
                "{}{} := {}",
                name.node,
                if *rate { "'" } else { "" },
                Shown(value)
            )
        }
        ActionKind::Fire { pulse, value } => format!("fire {} at {}", pulse.node, Shown(value)),
    }
}

fn part(part: &BodyPart) -> String {
    match part {
        BodyPart::Coordinate {
            angle,
            name,
            range,
            init,
            rate_range,
            rate_init,
            ..
        } => {
            let mut line = format!(
                "{} {} in {}",
                if *angle { "angle" } else { "position" },
                name.node,
                Range(range)
            );
            line += &optional(" = ", init.as_ref());
            let _ = write!(line, ", rate in {}", Range(rate_range));
            line + &optional(" = ", rate_init.as_ref())
        }
        BodyPart::Inertia { angle, value, .. } => {
            format!(
                "{} {}",
                if *angle { "inertia" } else { "mass" },
                Shown(value)
            )
        }
        BodyPart::Torque { angle, value, .. } => {
            format!(
                "{} {}",
                if *angle { "torque" } else { "force" },
                Shown(value)
            )
        }
        BodyPart::Friction {
            name,
            slip,
            against,
            law,
            ..
        } => format!(
            "friction {}({}) against {} = {}",
            name.node,
            slip.node,
            Shown(against),
            Shown(law)
        ),
    }
}

fn string_part(part: &StringPart) -> String {
    match part {
        StringPart::Coordinate {
            name,
            range,
            rate_range,
            ..
        } => format!(
            "position {} in {}, rate in {}",
            name.node,
            Range(range),
            Range(rate_range)
        ),
        StringPart::Density { value, .. } => format!("density {}", Shown(value)),
        StringPart::Load { value, .. } => format!("load {}", Shown(value)),
        StringPart::Force { value, place, .. } => {
            format!("force {} at {}", Shown(value), Shown(place))
        }
        StringPart::Ends { first, second, .. } => match second {
            Some(second) => format!("ends {}, {}", first.node, second.node),
            None => format!("ends {}", first.node),
        },
        StringPart::Tuned { name, pitch, .. } => {
            format!("tuned {} to {}", name.node, Shown(pitch))
        }
        StringPart::Friction {
            name,
            slip,
            place,
            against,
            law,
            ..
        } => format!(
            "friction {}({}) at {} against {} = {}",
            name.node,
            slip.node,
            Shown(place),
            Shown(against),
            Shown(law)
        ),
        StringPart::Points { value, .. } => format!("points {}", Shown(value)),
    }
}

/// A range as it is written.
struct Range<'a>(&'a RangeExpr);

impl fmt::Display for Range<'_> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{} .. {}", Shown(&self.0.low), Shown(&self.0.high))
    }
}
