//! The text of a Kernel. It is faithful: values keep their numbers, so what `verify` says of `v17`
//! is found in the text, and `parse` gives back an equal Kernel, but for origins, which are printed
//! where they are asked for.
//!
//! ```text
//! kernel spring @44100 {
//!   in x: u16 [0..65535]
//!   cell u: i32 x 84 [-9..9] = 0
//!   tick {
//!     v0: i32 [0..65535] = in x                    declared things by name,
//!     v1: i32 [0..4095] = sar v0 4                 then operands, then numbers
//!     v3: i1 [0..1] = lt v0 v1
//!     v6: i32 [0..9] = if v3 {                     results stand before the regions that yield them
//!       yield v1
//!     } else {
//!       yield v0
//!     }
//!     v9: i32 [0..9] = loop 84 (v7: i32 [0..83], v8: i32 [0..9] = v1) { .. }
//!   }
//! }
//! ```
//!
//! In the alternate form (`{:#}`) an instruction that has an origin ends with it, as in `v1: i32
//! [0..4095] = sar v0 4 @12`.
//!
//! Names that are not words joined by dots (primes allowed) stand between quotes. When reading, `;`
//! starts a comment, and a name is declared before it is used.

use super::{Inst, Kernel, Op, Port, Region, Type, Value};
use std::fmt::{self, Display, Formatter};

impl Display for Kernel {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        writeln!(f, "kernel {} @{} {{", Name(&self.name), self.rate_hz)?;
        self.declarations(f)?;
        for (word, region) in [("init", &self.init), ("tick", &self.tick)] {
            if !region.insts.is_empty() {
                writeln!(f, "  {word} {{")?;
                self.region(f, region, 4)?;
                writeln!(f, "  }}")?;
            }
        }
        writeln!(f, "}}")
    }
}

/// A name, between quotes if it needs them.
pub(super) struct Name<'a>(pub &'a str);

impl Display for Name<'_> {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        let letter = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '\'';
        let bare = self
            .0
            .split('.')
            .all(|part| !part.is_empty() && part.chars().all(letter));
        let starts_well = self
            .0
            .starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
        if bare && starts_well {
            f.write_str(self.0)
        } else {
            write!(f, "\"{}\"", self.0.escape_default())
        }
    }
}

/// Numbers between braces.
struct Numbers<'a>(&'a [i32]);

impl Display for Numbers<'_> {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        let all: Vec<String> = self.0.iter().map(i32::to_string).collect();
        write!(f, "{{ {} }}", all.join(", "))
    }
}

impl Kernel {
    fn declarations(&self, f: &mut Formatter) -> fmt::Result {
        let port = |f: &mut Formatter, word: &str, port: &Port, ty: &str| {
            writeln!(f, "  {word} {}: {ty} {}", Name(&port.name), port.range)
        };
        self.inputs
            .iter()
            .try_for_each(|input| port(f, "in", input, "u16"))?;
        self.outputs
            .iter()
            .try_for_each(|output| port(f, "out", output, "i16"))?;
        for live in &self.lives {
            writeln!(
                f,
                "  live {}: i32 {} = {}",
                Name(&live.name),
                live.range,
                live.init
            )?;
        }
        for keyed in &self.keyed {
            writeln!(
                f,
                "  keyed {}: i32 {} = {}",
                Name(&keyed.name),
                keyed.range,
                Numbers(&keyed.values)
            )?;
        }
        for cell in &self.cells {
            let len = if cell.len == 1 {
                String::new()
            } else {
                format!(" x {}", cell.len)
            };
            writeln!(
                f,
                "  cell {}: {}{len} {} = {}",
                Name(&cell.name),
                cell.ty,
                cell.range,
                cell.init
            )?;
        }
        for line in &self.lines {
            writeln!(
                f,
                "  line {}: {} {}",
                Name(&line.name),
                line.len,
                line.range
            )?;
        }
        for table in &self.tables {
            writeln!(
                f,
                "  table {}{} = {}",
                Name(&table.name),
                match table.columns {
                    1 => String::new(),
                    columns => format!(" x {columns}"),
                },
                Numbers(&table.values)
            )?;
        }
        for event in &self.events {
            writeln!(f, "  event {}({})", Name(&event.name), event.args)?;
        }
        for probe in &self.probes {
            writeln!(f, "  probe {}: {}", Name(&probe.name), probe.ty)?;
        }
        Ok(())
    }

    fn region(&self, f: &mut Formatter, region: &Region, indent: usize) -> fmt::Result {
        for inst in &region.insts {
            self.inst(f, inst, indent)?;
        }
        if !region.yields.is_empty() {
            writeln!(f, "{:indent$}yield{}", "", Operands(&region.yields))?;
        }
        Ok(())
    }

    /// One instruction, with the regions inside it.
    pub fn inst(&self, f: &mut Formatter, inst: &Inst, indent: usize) -> fmt::Result {
        write!(f, "{:indent$}{}", "", self.headline(inst))?;
        if let Some(origin) = inst.origin.filter(|_| f.alternate()) {
            write!(f, " @{origin}")?;
        }
        for (at, region) in inst.regions.iter().enumerate() {
            let last = at + 1 == inst.regions.len();
            if at > 0 && last && region.insts.is_empty() && region.yields.is_empty() {
                break;
            }
            writeln!(f, "{} {{", if at == 0 { "" } else { " else" })?;
            self.region(f, region, indent + 2)?;
            write!(f, "{:indent$}}}", "")?;
        }
        writeln!(f)
    }

    /// An instruction without its regions.
    pub(super) fn headline(&self, inst: &Inst) -> String {
        let results = match self.definitions(&inst.results) {
            results if results.is_empty() => results,
            results => format!("{results} = "),
        };
        match (inst.op, &inst.regions[..]) {
            (Op::Loop(rounds), [body]) => format!(
                "{results}loop {rounds} ({})",
                self.parameters(body, &inst.args)
            ),
            _ => results + &self.line(inst),
        }
    }

    /// Operator, declared name, operands, numbers.
    fn line(&self, inst: &Inst) -> String {
        let mut line = inst.op.row().name.to_string();
        let immediates = inst.op.row().immediates.iter().zip(inst.op.immediates());
        let (declared, numbers): (Vec<_>, Vec<_>) =
            immediates.partition(|(kind, _)| kind.is_declared());
        for (place, (_, index)) in declared.into_iter().enumerate() {
            let name = inst
                .op
                .declared_by(self, place)
                .map_or(format!("#{index}"), |own| Name(own.name).to_string());
            line += &format!(" {name}");
        }
        line += &Operands(&inst.args).to_string();
        for (_, number) in numbers {
            line += &format!(" {number}");
        }
        line
    }

    fn definitions(&self, values: &[Value]) -> String {
        let all: Vec<String> = values.iter().map(|value| self.definition(*value)).collect();
        all.join(", ")
    }

    /// `v5: i32 [0..9]`
    pub fn definition(&self, value: Value) -> String {
        match self.values.get(value) {
            Some(info) => format!("{value}: {} {}", info.ty, info.range),
            None => value.to_string(),
        }
    }

    fn parameters(&self, body: &Region, starts: &[Value]) -> String {
        let starts = std::iter::once(None).chain(starts.iter().map(Some));
        let all: Vec<String> = body
            .params
            .iter()
            .zip(starts)
            .map(|(param, start)| match start {
                Some(start) => format!("{} = {start}", self.definition(*param)),
                None => self.definition(*param),
            })
            .collect();
        all.join(", ")
    }
}

/// Values, each after a space.
struct Operands<'a>(&'a [Value]);

impl Display for Operands<'_> {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        self.0.iter().try_for_each(|value| write!(f, " {value}"))
    }
}

impl Type {
    /// The type written so.
    pub fn named(name: &str) -> Option<Type> {
        Type::ALL.into_iter().find(|ty| ty.to_string() == name)
    }
}
