//! Hand-written programs on both sides: where execution goes, exceptions, priorities, faults, lazy
//! saving.

use crate::harness::{MPS2_AN386, MPS2_AN505, Target, Tools};

/// The bits of FPCCR that say whose context is to be saved, in ARMv7-M and in ARMv8-M. MONRDY and
/// SFRDY are left out: there is neither a debug monitor nor a Non-secure state here.
const V7M_STATUS: u32 = 0x7b;
const V8M_STATUS: u32 = 0x67f;

/// Words of the journals that differ, beside their index.
fn compare(target: &Target, fpccr_status: u32, text: &str) {
    let Some(tools) = Tools::find() else { return };
    let symbols = [
        ("STACK_TOP", target.stack()),
        ("FPCCR_STATUS", fpccr_status),
    ];
    let image = tools.assemble(target, text, &symbols);
    let (theirs, ours) = (tools.qemu(target, &image), image.emulate(target));
    let words = |bytes: &[u8]| -> Vec<u32> {
        bytes
            .chunks_exact(4)
            .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
            .collect()
    };
    let (theirs, ours) = (words(&theirs), words(&ours));
    println!("{}: {} words", target.machine, theirs.len());
    assert!(
        theirs.len() > 100,
        "QEMU's journal has {} words",
        theirs.len()
    );
    let different: Vec<String> = (0..theirs.len().max(ours.len()))
        .filter(|i| theirs.get(*i) != ours.get(*i))
        .map(|i| format!("{i}: {:08x?} here {:08x?}", theirs.get(i), ours.get(i)))
        .collect();
    assert!(different.is_empty(), "{}", different.join("\n"));
}

#[test]
fn programs_agree_on_the_cortex_m4() {
    compare(&MPS2_AN386, V7M_STATUS, include_str!("programs.s"));
}

#[test]
fn programs_agree_on_the_cortex_m33() {
    compare(&MPS2_AN505, V8M_STATUS, include_str!("programs.s"));
}
