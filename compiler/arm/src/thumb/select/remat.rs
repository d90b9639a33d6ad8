//! Rematerialization: loads that may be made again instead of keeping a register.
//!
//! A cell's word is in memory until the cell is stored to, so a block that wants it can load it for
//! as much as it would cost to take it from the stack. That holds for a use behind a store to the
//! cell only if the word was loaded before: such words are loaded where the Kernel does.

use whippen_kernel::{Inst, Kernel, Op, Type, Value, all_insts};
use whippen_modes::{End, Mode};
use whippen_target_info::{Selected, row};

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
        self.sources[result.0 as usize] = match (row(inst.op).selected, inst.op) {
            (Selected::Reload, Op::Get(cell)) => self.define_load(*result, cell),
            (Selected::Reload, _) => {
                self.allowed[result.0 as usize] = true;
                Vec::new()
            }
            (Selected::AtStore, _) if self.becomes_store[result.0 as usize] => {
                self.sources_of(&inst.args)
            }
            (Selected::InPlace | Selected::AtStore, _) => Vec::new(),
            (Selected::AtOnlyUser | Selected::AtDecisions | Selected::WithOperand, _) => {
                self.sources_of(&inst.args)
            }
        };
    }

    /// The word of a cell; two words take two loads, so they are loaded where they stand.
    fn define_load(&mut self, result: Value, cell: u32) -> Vec<(Value, u32)> {
        if self.kernel.cells[cell as usize].ty == Type::I64 {
            return Vec::new();
        }
        self.allowed[result.0 as usize] = !self.stored[cell as usize];
        vec![(result, cell)]
    }

    /// The loaded values that an operator of these is computed from, if not where it stands.
    fn sources_of(&self, args: &[Value]) -> Vec<(Value, u32)> {
        let mut sources: Vec<(Value, u32)> = args
            .iter()
            .flat_map(|arg| self.sources[arg.0 as usize].clone())
            .collect();
        sources.sort_unstable();
        sources.dedup();
        sources
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
