//! `.ARM.attributes`: for which core, and to whose rules (Arm IHI 0045, build attributes).

use whippen_isa::Arch;

/// The section's bytes. Functions keep the base procedure call standard and pass no floating point,
/// so that code of both its variants may be linked with them. Of an image, which is `linked`, that
/// would tell gdb nothing of how a `double` lies in memory, so it says the base standard.
pub(super) fn section(arch: Arch, linked: bool) -> Vec<u8> {
    let (name, number, thumb, dsp) = match arch {
        Arch::V6M => ("Cortex-M0+", 12, 1, 0),
        Arch::V7EM => ("Cortex-M4", 13, 2, 0),
        Arch::V8M => ("Cortex-M33", 17, 3, 1),
    };
    let mut tags = vec![5];
    tags.extend(name.as_bytes());
    // CPU_arch, CPU_arch_profile M, THUMB_ISA_use, ABI_align_needed and _preserved 8, ABI_VFP_args
    // base or either, DSP_extension.
    let float = if linked { 0 } else { 3 };
    tags.extend([0, 6, number, 7, b'M', 9, thumb, 24, 1, 25, 1, 28, float]);
    if dsp == 1 {
        tags.extend([46, dsp]);
    }
    let file = [&[1][..], &(tags.len() as u32 + 5).to_le_bytes(), &tags].concat();
    let vendor = b"aeabi\0";
    let length = (4 + vendor.len() + file.len()) as u32;
    [b"A", &length.to_le_bytes()[..], vendor, &file].concat()
}
