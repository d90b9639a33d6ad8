//! Rematerialization: loads that may be made again instead of keeping a register.
//!
//! A cell's word is in memory until the cell is stored to, so a block that wants it can load it for
//! as much as it would cost to take it from the stack. That holds for a use behind a store to the
//! cell only if the word was loaded before: such words are loaded where the Kernel does.

use super::Plan;
use super::stored_cells::{StartsOfBlocks, StoredCells, note_stores};
use std::slice;
use whippen_ids::IdMap;
use whippen_kernel::{Inst, Kernel, Op, Type, Value};
use whippen_modes::{End, Mode};
use whippen_target_info::{Selected, row};

/// Marks the values that may be loaded again wherever they are used; some choices wait until they
/// are stored.
pub(super) fn find_reloads(plan: &mut Plan, kernel: &Kernel, mode: &Mode, starts: &StartsOfBlocks) {
    let mut scan = LoadScan {
        kernel,
        plan,
        sources: IdMap::filled(Vec::new(), mode.values.len()),
        stored: Vec::new(),
    };
    for (block, start) in mode.blocks.iter().zip(starts) {
        scan.stored.clone_from(start);
        scan.scan_insts(&block.insts);
        if let End::Branch { condition, .. } = &block.end {
            scan.use_values(slice::from_ref(condition));
        }
        for target in block.end.targets() {
            scan.use_values(&target.args);
        }
    }
}

struct LoadScan<'a> {
    kernel: &'a Kernel,
    plan: &'a mut Plan,
    /// The loaded values, with their cells, that a value may be computed from where it is used.
    sources: IdMap<Value, Vec<(Value, u32)>>,
    stored: StoredCells,
}

impl LoadScan<'_> {
    fn scan_insts(&mut self, insts: &[Inst]) {
        for inst in insts {
            self.use_values(&inst.args);
            if matches!(inst.op, Op::Loop(_)) {
                // What a round stores, the next round finds stored.
                for inner in &inst.regions {
                    note_stores(&inner.insts, &mut self.stored);
                }
            }
            for inner in &inst.regions {
                self.scan_insts(&inner.insts);
                self.use_values(&inner.yields);
            }
            note_stores(slice::from_ref(inst), &mut self.stored);
            self.define(inst);
        }
    }

    fn define(&mut self, inst: &Inst) {
        let Some(result) = inst.results.first() else {
            return;
        };
        self.sources[result] = match (row(inst.op).selected, inst.op) {
            (Selected::Reload, Op::Get(cell)) => self.define_load(*result, cell),
            (Selected::Reload, _) => {
                self.plan[result].may_reload = true;
                Vec::new()
            }
            (Selected::AtStore, _) if self.plan[result].becomes_store => {
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
        self.plan[result].may_reload = !self.stored[cell as usize];
        vec![(result, cell)]
    }

    /// The loaded values that an operator of these is computed from, if not where it stands.
    fn sources_of(&self, args: &[Value]) -> Vec<(Value, u32)> {
        let mut sources: Vec<(Value, u32)> = args
            .iter()
            .flat_map(|arg| self.sources[arg].clone())
            .collect();
        sources.sort_unstable();
        sources.dedup();
        sources
    }

    /// Forbids what would be loaded here, behind a store.
    fn use_values(&mut self, values: &[Value]) {
        for value in values {
            for (source, cell) in &self.sources[value] {
                self.plan[source].may_reload &= !self.stored[*cell as usize];
            }
        }
    }
}
