//! Capstone: which registers an instruction reads and writes, and whether it sets the flags.

use crate::capstone::open;
use crate::{normal, samples};
use capstone::prelude::*;
use std::collections::BTreeMap;
use whippen_isa::{Class, Encoding, Flags, Inst, Op, RegSet};

/// The core and floating-point registers in one of Capstone's lists; PC, which it lists for some
/// branches, left out.
fn registers(capstone: &Capstone, ids: &[RegId]) -> RegSet {
    let one = |id: &RegId| {
        let name = capstone.reg_name(*id).unwrap_or_default();
        let name = normal::text(&format!("- {name}"), 0).replace("- ", "");
        let number = name.get(1..).and_then(|n| n.parse().ok());
        match (name.as_str(), number) {
            ("sp", _) => RegSet::core(13),
            ("lr", _) => RegSet::core(14),
            (r, Some(n)) if r.starts_with('r') => RegSet::core(n),
            (s, Some(n)) if s.starts_with('s') => RegSet::singles(n, 1),
            (d, Some(n)) if d.starts_with('d') => RegSet::doubles(n, 1),
            _ => RegSet::EMPTY,
        }
    };
    ids.iter().map(one).fold(RegSet::EMPTY, RegSet::union)
}

/// Instructions whose registers Capstone lists in part or the wrong way around.
fn lists_wrongly(inst: &Inst) -> bool {
    use Op::*;
    let class = matches!(
        inst.class(),
        // Rm of the extended and the accumulators; what SSAT reads; lists; special registers; all
        // of TT.
        Class::ExtendAdd
            | Class::MultiplyAddLong
            | Class::Saturate
            | Class::FloatLoadMultiple
            | Class::FloatStoreMultiple
            | Class::Security
            | Class::Coprocessor
    );
    // Rm of PKH; the stored register of STRBT; LR of SVC; the other half of D; BXNS at all; Sd of a
    // half conversion.
    let op = matches!(
        inst.op(),
        PKHBT
            | PKHTB
            | STRBT
            | STRHT
            | SVC
            | BXNS
            | BLXNS
            | VMOV_core_to_half
            | VMOV_half_to_core
            | VCVT_single_to_half
            | VMSR
    );
    // The base of STMDB, and the stack pointers by name.
    class || op || (inst.op() == STMDB && inst.wback) || matches!(inst.op(), MRS | MSR)
}

/// Whether Capstone's word on the flags can be taken: it asks for no IT block here, and it counts
/// ADC and SBC, which read them, and UADD8, and forgets MSR.
fn tells_flags(inst: &Inst) -> bool {
    use Op::*;
    let reads_carry = matches!(
        inst.op(),
        ADC_immediate | ADC_register | SBC_immediate | SBC_register
    ) && !inst.s;
    inst.cond.is_none() && !reads_carry && !matches!(inst.op(), UADD8 | MSR_APSR)
}

#[test]
fn registers_read_and_written() {
    let mut capstone = open(true);
    capstone.set_detail(true).expect("details can be had");
    let pc = RegSet::core(15);
    let (mut compared, mut left_out, mut wrong) = (0, 0, BTreeMap::new());
    for (seed, encoding) in Encoding::all().enumerate() {
        for (word, inst) in samples::of_encoding(encoding, 100, 9000 + seed as u64) {
            let all = capstone
                .disasm_count(&samples::bytes(word, inst.size()), 0x1000, 1)
                .expect("Capstone answers");
            let Some(theirs) = all
                .iter()
                .next()
                .filter(|_| !lists_wrongly(&inst) && inst.op() != Op::HINT_memory)
            else {
                left_out += 1;
                continue;
            };
            let detail = capstone
                .insn_detail(theirs)
                .expect("details were asked for");
            let reads = registers(&capstone, detail.regs_read());
            let writes = registers(&capstone, detail.regs_write());
            compared += 1;
            if reads != inst.uses().without(pc) || writes != inst.defs().without(pc) {
                let text = format!(
                    "{inst}: reads {:?} / {reads:?}, writes {:?} / {writes:?}",
                    inst.uses(),
                    inst.defs()
                );
                wrong.insert(inst.encoding.to_string(), text);
            }
            if let ArchDetail::ArmDetail(arm) = detail.arch_detail()
                && tells_flags(&inst)
                && arm.update_flags() != inst.flags().writes.intersects(Flags::NZCV)
            {
                let text = format!(
                    "{inst}: flags {:?} / {}",
                    inst.flags().writes,
                    arm.update_flags()
                );
                wrong.insert(inst.encoding.to_string(), text);
            }
        }
    }
    println!("registers: {compared} compared, {left_out} left out");
    assert!(wrong.is_empty(), "differ: {wrong:#?}");
}
