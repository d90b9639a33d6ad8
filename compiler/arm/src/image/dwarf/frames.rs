//! Call frame information: `.debug_frame`, from rows of [`unwind`](super::super::unwind).

use gimli::Register;
use gimli::write::{
    Address, CallFrameInstruction, CommonInformationEntry, FrameDescriptionEntry, FrameTable,
};
use whippen_isa::reg;

use super::super::unwind::{KEPT, Row, Rule};
use super::{Code, ENCODING};

const SP: Register = Register(reg::SP as u16);
const LR: Register = Register(reg::LR as u16);
/// What calls do not keep.
const CHANGED: [Register; 5] = [
    Register(0),
    Register(1),
    Register(2),
    Register(3),
    Register(12),
];

/// An entry for every function that has rows.
pub(super) fn table(code: &[Code], rows: &[Row]) -> FrameTable {
    let mut table = FrameTable::default();
    let mut common = CommonInformationEntry::new(ENCODING, 2, -4, LR);
    common.add_instruction(CallFrameInstruction::Cfa(SP, 0));
    for register in CHANGED {
        common.add_instruction(CallFrameInstruction::Undefined(register));
    }
    for register in KEPT {
        let register = Register(u16::from(register));
        common.add_instruction(CallFrameInstruction::SameValue(register));
    }
    let common = table.add_cie(common);
    for code in code {
        let mut starts: Vec<u32> = code.functions.iter().map(|(_, at, _)| *at).collect();
        starts.extend([0, code.size]);
        starts.sort_unstable();
        starts.dedup();
        for pair in starts.windows(2) {
            let [from, to] = [pair[0], pair[1]].map(|at| code.base + at);
            let inside = |row: &&Row| (from..to).contains(&row.at);
            if !rows.iter().any(|row| inside(&row)) {
                continue;
            }
            let begin = Address::Symbol {
                symbol: code.section,
                addend: i64::from(pair[0]),
            };
            let mut entry = FrameDescriptionEntry::new(begin, to - from);
            let mut last = Row::entry(from);
            for row in rows.iter().filter(inside) {
                add(&mut entry, row.at - from, &last, row);
                last = *row;
            }
            table.add_fde(common, entry);
        }
    }
    table
}

/// What is otherwise than in the row before.
fn add(entry: &mut FrameDescriptionEntry, at: u32, last: &Row, row: &Row) {
    if row.cfa != last.cfa {
        entry.add_instruction(at, CallFrameInstruction::CfaOffset(row.cfa));
    }
    let rules = KEPT.iter().zip(row.rules).zip(last.rules);
    for ((register, rule), _) in rules.filter(|((_, rule), last)| rule != last) {
        let register = Register(u16::from(*register));
        entry.add_instruction(
            at,
            match rule {
                Rule::Same => CallFrameInstruction::SameValue(register),
                Rule::Slot(offset) => CallFrameInstruction::Offset(register, offset),
                Rule::Register(other) => {
                    CallFrameInstruction::Register(register, Register(other.into()))
                }
                Rule::Lost => CallFrameInstruction::Undefined(register),
            },
        );
    }
}
