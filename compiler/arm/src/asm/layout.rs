//! Where everything lies. Branches and literal loads begin narrow and are widened until all reach.

use whippen_isa::ItState;

use super::item::{AssemblyUnit, What};

type Located = (usize, String);

/// Rounds after which every instruction would be wide; one more settles.
const ROUNDS_MAX: usize = 1000;

/// Gives every item its offset and size.
///
/// # Errors
/// The line of an instruction that has no bits, and why.
pub fn place(unit: &mut AssemblyUnit) -> Result<(), Located> {
    for _ in 0..ROUNDS_MAX {
        arrange(unit);
        let mut changed = false;
        for section in 0..unit.sections.len() {
            changed |= widen(unit, section)?;
        }
        if !changed {
            arrange(unit);
            return Ok(());
        }
    }
    Err((1, "branches do not settle".to_string()))
}

/// Offsets from sizes.
fn arrange(unit: &mut AssemblyUnit) {
    for section in &mut unit.sections {
        let mut at = 0_u32;
        for item in &mut section.items {
            item.offset = at;
            item.size = match &item.what {
                What::Instruction(_) => item.size,
                What::Words(bytes, values) => bytes * values.len() as u32,
                What::Bytes(bytes) => bytes.len() as u32,
                What::Fill(count, _) => *count,
                What::Align(to) => at.next_multiple_of(*to) - at,
                What::Pool(literals) => at.next_multiple_of(4) - at + 4 * literals.len() as u32,
            };
            at += item.size;
        }
    }
}

/// Whether an instruction has become wide.
fn widen(unit: &mut AssemblyUnit, section: usize) -> Result<bool, Located> {
    let mut changed = false;
    let mut it = ItState::OUTSIDE;
    for item in 0..unit.sections[section].items.len() {
        let placed = &unit.sections[section].items[item];
        let What::Instruction(instruction) = &placed.what else {
            continue;
        };
        let located = |message| (placed.line, message);
        let encoded = instruction
            .encode(unit, (section, item), it.cond())
            .map_err(located)?;
        let behind = encoded.inst.it_behind(it);
        it = behind.ok_or_else(|| located("this IT block cannot be".to_string()))?;
        let size = encoded.code.size();
        if size > placed.size {
            unit.sections[section].items[item].size = size;
            changed = true;
        }
    }
    Ok(changed)
}

impl AssemblyUnit {
    /// Where a literal of a section's pool lies by the present layout.
    pub fn literal_offset(&self, section: usize, pool: usize, number: usize) -> i64 {
        let pools = self.sections[section]
            .items
            .iter()
            .filter(|item| matches!(item.what, What::Pool(_)));
        pools.clone().nth(pool).map_or(0, |item| {
            i64::from(item.offset.next_multiple_of(4)) + 4 * number as i64
        })
    }
}
