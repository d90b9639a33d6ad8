//! Modes as text: their blocks as trees.
//!
//! ```text
//! mode 1 state=1: 3 blocks, 9 instructions; longest path 8 instructions, about 11 cycles
//!   longest path: b0 b2
//!   c in [1..1] known                        cells that lie closer than they declare
//!   b0:
//!     v0: i32 [0..65535] = in x              as in the text of a Kernel
//!     branch v3
//!     yes b1:
//!       next 0 state=0                       the key's next tick starts in that mode
//!     no b2:
//!       ..
//! ```
//!
//! A block that several lead to stands under the first of them; the others say `jump b7`.

use super::{Block, BlockId, End, Mode, ModeId, Modes, Target, cost};
use std::fmt::{self, Display, Formatter};
use std::ops::Add;
use whippen_ids::{IdMap, longest_paths};
use whippen_kernel::{Kernel, Op, Value};

/// What the code of a mode amounts to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct Size {
    /// Estimated cycles of a Cortex-M33, from the entry to the next mode.
    pub cycles: u32,
    /// Instructions of the Kernel, without constants.
    pub instructions: usize,
}

impl Add for Size {
    type Output = Size;

    fn add(self, other: Size) -> Size {
        Size {
            cycles: self.cycles + other.cycles,
            instructions: self.instructions + other.instructions,
        }
    }
}

impl Mode {
    /// Instructions of all blocks, without constants.
    pub fn instructions(&self) -> usize {
        self.blocks
            .iter()
            .map(|block| self.size(block).instructions)
            .sum()
    }

    /// The longest path through the blocks, by cycles.
    pub fn longest(&self) -> Size {
        self.sizes_by_block().first().copied().unwrap_or_default()
    }

    /// The blocks of the longest path, in order.
    pub fn longest_path(&self) -> Vec<BlockId> {
        let (from, mut path) = (self.sizes_by_block(), vec![BlockId(0)]);
        while let Some(block) = path.last().and_then(|at| self.blocks.get(*at)) {
            let Some(next) = block
                .end
                .targets()
                .map(|target| target.block)
                .max_by_key(|next| from.get(*next))
            else {
                break;
            };
            path.push(next);
        }
        path
    }

    /// The longest path from each block on.
    fn sizes_by_block(&self) -> IdMap<BlockId, Size> {
        longest_paths(
            self.blocks.len(),
            self.blocks.ids().rev(),
            |at| self.size(&self.blocks[at]),
            |at, from| {
                let targets = self.blocks[at].end.targets();
                targets.filter_map(|to| from.get(to.block)).max().copied()
            },
        )
    }

    fn size(&self, block: &Block) -> Size {
        let branch = u32::from(!matches!(block.end, End::Next(_)));
        let work = block
            .insts
            .iter()
            .filter(|inst| !matches!(inst.op, Op::Const(_)));
        let cycles = |inst| cost::of_inst(inst, |value: Value| self.values[value].ty);
        work.fold(
            Size {
                cycles: branch,
                instructions: 0,
            },
            |size, inst| Size {
                cycles: size.cycles + cycles(inst),
                instructions: size.instructions + 1,
            },
        )
    }
}

impl Display for Modes {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        let all = self.instructions();
        let (worst, whole) = (self.longest(), Modes::single(&self.kernel).longest());
        writeln!(
            f,
            "modes of {}: {}, {all} instructions; longest path {worst}",
            self.kernel.name,
            self.modes.len()
        )?;
        writeln!(f, "without modes: {whole}")?;
        if self.work_limited {
            writeln!(f, "not all combinations were tried: too much work")?;
        }
        for at in self.modes.ids() {
            let mode = Printed::new(self, at);
            writeln!(f)?;
            mode.head(f)?;
            mode.block(f, BlockId(0), 2)?;
        }
        Ok(())
    }
}

impl Display for Size {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        write!(
            f,
            "{} instructions, about {} cycles",
            self.instructions, self.cycles
        )
    }
}

struct Printed<'a> {
    modes: &'a Modes,
    at: ModeId,
    mode: &'a Mode,
    /// What prints its instructions.
    kernel: Kernel,
    /// From which block, and how, each is come to first.
    first: IdMap<BlockId, Option<(BlockId, bool)>>,
}

impl Printed<'_> {
    fn new(modes: &Modes, at: ModeId) -> Printed<'_> {
        let mode = &modes.modes[at];
        let kernel = Kernel {
            values: mode.values.clone(),
            ..modes.kernel.clone()
        };
        let mut first = IdMap::filled(None, mode.blocks.len());
        for (from, block) in mode.blocks.enumerated() {
            for (side, target) in block.end.targets().enumerate() {
                first[target.block].get_or_insert((from, side == 0));
            }
        }
        Printed {
            modes,
            at,
            mode,
            kernel,
            first,
        }
    }

    fn head(&self, f: &mut Formatter) -> fmt::Result {
        let (Mode { name, blocks, .. }, count) = (self.mode, self.mode.instructions());
        let longest = self.mode.longest();
        writeln!(
            f,
            "mode {} {name}: {} blocks, {count} instructions; longest path {longest}",
            self.at,
            blocks.len()
        )?;
        let path: Vec<String> = self
            .mode
            .longest_path()
            .iter()
            .map(|block| block.to_string())
            .collect();
        writeln!(f, "  longest path: {}", path.join(" "))?;
        for (cell, declared) in self.kernel.cells.iter().enumerate() {
            let (range, known) = (self.mode.cells[cell], self.mode.known[cell]);
            if known || range != declared.range {
                writeln!(
                    f,
                    "  {} in {range}{}",
                    declared.name,
                    if known { " known" } else { "" }
                )?;
            }
        }
        Ok(())
    }

    fn block(&self, f: &mut Formatter, at: BlockId, indent: usize) -> fmt::Result {
        let block = &self.mode.blocks[at];
        let params: Vec<String> = block
            .params
            .iter()
            .map(|param| self.kernel.definition(*param))
            .collect();
        let params = if params.is_empty() {
            String::new()
        } else {
            format!(" ({})", params.join(", "))
        };
        writeln!(f, "{:indent$}{at}{params}:", "")?;
        let indent = indent + 2;
        for inst in &block.insts {
            self.kernel.inst(f, inst, indent)?;
        }
        match &block.end {
            End::Next(next) => {
                let stays = if *next == self.at {
                    "again"
                } else {
                    &self.modes.modes[next].name
                };
                writeln!(f, "{:indent$}next {next} {stays}", "")
            }
            End::Jump(target) => self.target(f, at, true, target, indent),
            End::Branch {
                condition, yes, no, ..
            } => {
                writeln!(f, "{:indent$}branch {condition}", "")?;
                self.target(f, at, true, yes, indent)?;
                self.target(f, at, false, no, indent)
            }
        }
    }

    fn target(
        &self,
        f: &mut Formatter,
        from: BlockId,
        side: bool,
        target: &Target,
        indent: usize,
    ) -> fmt::Result {
        let args: Vec<String> = target.args.iter().map(Value::to_string).collect();
        let args = if args.is_empty() {
            String::new()
        } else {
            format!("({})", args.join(", "))
        };
        let name = if side { "yes" } else { "no" };
        if self.first[target.block] != Some((from, side)) || !target.args.is_empty() {
            writeln!(f, "{:indent$}{name} {}{args}", "", target.block)?;
        }
        if self.first[target.block] == Some((from, side)) {
            return self.block(f, target.block, indent);
        }
        Ok(())
    }
}
