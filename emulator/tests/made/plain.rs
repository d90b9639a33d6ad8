//! Which random instructions a program may be made of.

use whippen_isa::{Arch, Class, ItState, Op, RegSet, decode};

/// Whether an instruction stays in line, away from memory and from registers (bits) that are kept.
pub fn is_plain(arch: Arch, [hw1, hw2]: [u16; 2], kept: u16) -> bool {
    let Ok(inst) = decode(hw1, hw2, arch, ItState::OUTSIDE) else {
        return false;
    };
    let name = format!("{:?}", inst.class());
    let away = ["Load", "Store", "Branch", "Preload", "Float"];
    let odd = matches!(
        inst.class(),
        Class::Wait
            | Class::Exception
            | Class::Special
            | Class::It
            | Class::Coprocessor
            | Class::Security
    );
    !odd && !away.iter().any(|part| name.contains(part))
        && !inst.defs().intersects(RegSet::core_list(kept))
        && inst.op() != Op::ISB
}
