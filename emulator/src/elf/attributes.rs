//! The build attributes of an ARM ELF: which architecture it was compiled for.
//!
//! Source: Addenda to, and Errata in, the ABI for the Arm Architecture (IHI 0045), section
//! "Attribute values".

use super::{ElfError, File, corrupt};
use object::read::elf::{AttributeReader, SectionHeader};
use whippen_isa::Arch;

const SHT_ARM_ATTRIBUTES: u32 = 0x7000_0003;
const FILE_SCOPE: u8 = 1;
const CPU_RAW_NAME: u64 = 4;
const CPU_NAME: u64 = 5;
const CPU_ARCH: u64 = 6;
const CPU_ARCH_PROFILE: u64 = 7;
const COMPATIBILITY: u64 = 32;

/// Tag_CPU_arch: its value, its name, and the architecture here that runs it.
const ARCHITECTURES: [(u64, &str, Option<Arch>); 22] = [
    (0, "an ARM before version 4", None),
    (1, "ARMv4", None),
    (2, "ARMv4T", None),
    (3, "ARMv5T", None),
    (4, "ARMv5TE", None),
    (5, "ARMv5TEJ", None),
    (6, "ARMv6", None),
    (7, "ARMv6KZ", None),
    (8, "ARMv6T2", None),
    (9, "ARMv6K", None),
    (10, "ARMv7-A or -R", None),
    (11, "ARMv6-M", Some(Arch::V6M)),
    (12, "ARMv6S-M", Some(Arch::V6M)),
    (13, "ARMv7E-M", Some(Arch::V7EM)),
    (14, "ARMv8-A", None),
    (15, "ARMv8-R", None),
    (16, "ARMv8-M Baseline", Some(Arch::V8M)),
    (17, "ARMv8-M Mainline", Some(Arch::V8M)),
    (18, "ARMv8.1-A", None),
    (19, "ARMv8.2-A", None),
    (20, "ARMv8.3-A", None),
    (21, "ARMv8.1-M Mainline", None),
];

/// The oldest architecture here that has what the file was compiled for; nothing if it does not
/// say, or says that it runs anywhere (as hand-written assembly does).
pub(super) fn arch(file: &File<'_>) -> Result<Option<Arch>, ElfError> {
    let (number, profile) = tags(file)?;
    match (number, profile) {
        // ARMv7 with profile M, which has no DSP instructions: a Cortex-M3, and an M4 runs its
        // code.
        (Some(10), Some(b'M')) => Ok(Some(Arch::V7EM)),
        (None | Some(0), _) => Ok(None),
        (Some(number), _) => {
            let (name, arch) = ARCHITECTURES.iter().find(|(n, ..)| *n == number).map_or(
                (format!("architecture {number}"), None),
                |(_, name, arch)| (name.to_string(), *arch),
            );
            arch.map(Some).ok_or(ElfError::Architecture(name))
        }
    }
}

/// Tag_CPU_arch and Tag_CPU_arch_profile of the whole file.
fn tags(file: &File<'_>) -> Result<(Option<u64>, Option<u8>), ElfError> {
    let endian = file.endian();
    let (mut number, mut profile) = (None, None);
    for section in file
        .elf_section_table()
        .iter()
        .filter(|s| s.sh_type(endian).0 == SHT_ARM_ATTRIBUTES)
    {
        let attributes = section.attributes(endian, file.data()).map_err(corrupt)?;
        for vendor in attributes.subsections().map_err(corrupt)? {
            let vendor = vendor.map_err(corrupt)?;
            for scope in vendor
                .subsubsections()
                .filter(|_| vendor.vendor() == b"aeabi")
            {
                let scope = scope.map_err(corrupt)?;
                if scope.tag().0 == FILE_SCOPE {
                    read(scope.attributes(), &mut number, &mut profile).map_err(corrupt)?;
                }
            }
        }
    }
    Ok((number, profile))
}

fn read(
    mut reader: AttributeReader<'_>,
    number: &mut Option<u64>,
    profile: &mut Option<u8>,
) -> Result<(), object::Error> {
    while let Some(tag) = reader.read_tag()? {
        match tag {
            CPU_ARCH => *number = Some(reader.read_integer()?),
            CPU_ARCH_PROFILE => *profile = Some(reader.read_integer()? as u8),
            COMPATIBILITY => {
                reader.read_integer()?;
                reader.read_string()?;
            }
            // Above 32, odd tags are strings.
            CPU_RAW_NAME | CPU_NAME => drop(reader.read_string()?),
            tag if tag > COMPATIBILITY && tag % 2 == 1 => drop(reader.read_string()?),
            _ => drop(reader.read_integer()?),
        }
    }
    Ok(())
}
