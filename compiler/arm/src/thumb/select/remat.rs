//! Rematerialization: loads that may be made again instead of keeping a register.
//!
//! A cell's word is in memory until the cell is stored to, so a block that wants it can load it for
//! as much as it would cost to take it from the stack. That holds for a use behind a store to the
//! cell only if the word was loaded before: such words are loaded where the Kernel does.

use whippen_kernel::{Inst, Kernel, Op, Type, Value, all_insts};
use whippen_modes::{End, Mode};

/// Which values may be loaded again wherever they are used; some choices wait until they are
/// stored.
pub(super) fn rematerializable_loads(
    kernel: &Kernel,
    mode: &Mode,
    becomes_store: &[bool],
) -> Vec<bool> {
    let mut scan = LoadScan {
        kernel,
        becomes_store,
        allowed: vec![false; mode.values.len()],
        sources: vec![Vec::new(); mode.values.len()],
        stored: vec![false; kernel.cells.len()],
    };
    let mut before = vec![vec![false; kernel.cells.len()]; mode.blocks.len()];
    // What a block names comes after it, so one pass sees every way in.
    for (index, block) in mode.blocks.iter().enumerate() {
        scan.stored.clone_from(&before[index]);
        scan.scan_insts(&block.insts);
        let targets = match &block.end {
            End::Jump(target) => vec![target],
            End::Branch {
                condition, yes, no, ..
            } => {
                scan.uses(&[*condition]);
                vec![yes, no]
            }
            End::Next(_) => Vec::new(),
        };
        for target in targets {
            scan.uses(&target.args);
            before[target.block]
                .iter_mut()
                .zip(&scan.stored)
                .for_each(|(known, stored)| *known |= stored);
        }
    }
    scan.allowed
}

/// Whether selection may compute the operator where its result is used instead of where it stands.
fn is_deferrable(op: Op) -> bool {
    let part = matches!(
        op,
        Op::Sar(_) | Op::SarRound(_) | Op::Shl(_) | Op::Mul | Op::MulTop | Op::MulWide
    );
    part || matches!(
        op,
        Op::Min | Op::Max | Op::Lt | Op::Le | Op::Eq | Op::Not | Op::Assume(..) | Op::Narrow
    )
}

struct LoadScan<'a> {
    kernel: &'a Kernel,
    becomes_store: &'a [bool],
    allowed: Vec<bool>,
    /// The loaded values, with their cells, that a value may be computed from where it is used.
    sources: Vec<Vec<(Value, u32)>>,
    /// Whether a cell may have been stored to.
    stored: Vec<bool>,
}

impl LoadScan<'_> {
    fn scan_insts(&mut self, insts: &[Inst]) {
        for inst in insts {
            self.uses(&inst.args);
            if matches!(inst.op, Op::Loop(_)) {
                // What a round stores, the next round finds stored.
                inst.regions
                    .iter()
                    .for_each(|inner| self.stores(&inner.insts));
            }
            for inner in &inst.regions {
                self.scan_insts(&inner.insts);
                self.uses(&inner.yields);
            }
            self.stores(std::slice::from_ref(inst));
            self.define(inst);
        }
    }

    fn stores(&mut self, insts: &[Inst]) {
        for inst in all_insts(insts) {
            if let Op::Set(cell) | Op::SetAt(cell) = inst.op {
                self.stored[cell as usize] = true;
            }
        }
    }

    fn define(&mut self, inst: &Inst) {
        let Some(result) = inst.results.first() else {
            return;
        };
        let mut sources = match inst.op {
            // It may be computed where its result is stored.
            Op::Select if self.becomes_store[result.0 as usize] => inst
                .args
                .iter()
                .flat_map(|arg| self.sources[arg.0 as usize].clone())
                .collect::<Vec<_>>(),
            Op::Get(cell) if self.kernel.cells[cell as usize].ty != Type::I64 => {
                self.allowed[result.0 as usize] = !self.stored[cell as usize];
                vec![(*result, cell)]
            }
            Op::Live(_) | Op::Tick(0) | Op::Keyed(_) => {
                self.allowed[result.0 as usize] = true;
                Vec::new()
            }
            op if is_deferrable(op) => inst
                .args
                .iter()
                .flat_map(|arg| self.sources[arg.0 as usize].clone())
                .collect::<Vec<_>>(),
            // Everything else is computed where it stands.
            _ => Vec::new(),
        };
        sources.sort_unstable();
        sources.dedup();
        self.sources[result.0 as usize] = sources;
    }

    /// Forbids what would be loaded here, behind a store.
    fn uses(&mut self, values: &[Value]) {
        for value in values {
            for (source, cell) in &self.sources[value.0 as usize] {
                self.allowed[source.0 as usize] &= !self.stored[*cell as usize];
            }
        }
    }
}
