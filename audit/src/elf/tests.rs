//! ELF files made word by word.

use super::{CERTIFICATE, Elf, KERNELS};

/// A section: name, type, flags, address, bytes.
type Section<'a> = (&'a str, u32, u32, u32, &'a [u8]);

/// Of a file its header, the bytes of its sections, their names and their table.
fn file(sections: &[Section]) -> Vec<u8> {
    let mut names = vec![0_u8];
    let mut bytes = vec![0_u8; 52];
    let mut headers = vec![[0_u32; 10]];
    for (name, kind, flags, base, own) in sections {
        let (name_at, at) = (names.len() as u32, bytes.len() as u32);
        names.extend(name.bytes().chain([0]));
        bytes.extend(if *kind == BSS { &[][..] } else { own });
        headers.push([
            name_at,
            *kind,
            *flags,
            *base,
            at,
            own.len() as u32,
            0,
            0,
            0,
            0,
        ]);
    }
    let (name_at, at) = (names.len() as u32, bytes.len() as u32);
    names.extend(b".shstrtab\0");
    headers.push([name_at, 3, 0, 0, at, names.len() as u32, 0, 0, 0, 0]);
    bytes.extend(&names);
    let table = bytes.len() as u32;
    bytes[..7].copy_from_slice(b"\x7fELF\x01\x01\x01");
    let mut put = |at: usize, half: u16| bytes[at..at + 2].copy_from_slice(&half.to_le_bytes());
    put(16, 2);
    put(18, 40);
    put(46, 40);
    put(48, headers.len() as u16);
    put(50, headers.len() as u16 - 1);
    bytes[32..36].copy_from_slice(&table.to_le_bytes());
    bytes.extend(headers.iter().flatten().flat_map(|word| word.to_le_bytes()));
    bytes
}

const BITS: u32 = 1;
const BSS: u32 = 8;
const WRITES: u32 = 1;
const LOADED: u32 = 2;
const CODE: u32 = 4;

const ALL: [Section; 6] = [
    (".data", BITS, LOADED | WRITES, 0x2000, &[9; 8]),
    (
        ".text",
        BITS,
        LOADED | CODE,
        0x1000,
        &[1, 2, 3, 0xf8, 5, 6, 7, 0xe7],
    ),
    (".rodata", BITS, LOADED, 0x1008, &[7, 0, 0, 0]),
    (".bss", BSS, LOADED | WRITES, 0x2008, &[0; 16]),
    (".comment", BITS, 0, 0, b"made by hand"),
    (".empty", BITS, LOADED, 0x1004, &[]),
];

fn read(sections: &[Section]) -> Result<Elf, String> {
    Elf::read(&file(sections))
}

#[test]
fn sections_that_are_loaded_are_read_by_address() {
    let elf = read(&ALL).expect("it is an ELF file");
    let told: Vec<_> = elf
        .sections
        .iter()
        .map(|own| (own.name.as_str(), own.base, own.size))
        .collect();
    let wanted = [
        (".text", 0x1000, 8),
        (".empty", 0x1004, 0),
        (".rodata", 0x1008, 4),
        (".data", 0x2000, 8),
        (".bss", 0x2008, 16),
    ];
    assert_eq!(told, wanted);
    let kinds: Vec<_> = elf
        .sections
        .iter()
        .map(|own| (own.code, own.writable))
        .collect();
    let wanted = [
        (true, false),
        (false, false),
        (false, false),
        (false, true),
        (false, true),
    ];
    assert_eq!(kinds, wanted);
    assert_eq!((elf.certificate, elf.kernels), (None, None));
}

#[test]
fn an_address_is_in_the_section_around_it() {
    let elf = read(&ALL).expect("it is an ELF file");
    let at = |address| elf.section_at(address).map(|own| own.name.as_str());
    for (address, name) in [
        (0xfff, None),
        (0x1000, Some(".text")),
        (0x1004, Some(".text")),
        (0x1007, Some(".text")),
        (0x1008, Some(".rodata")),
        (0x100b, Some(".rodata")),
        (0x100c, None),
        (0x2017, Some(".bss")),
        (0x2018, None),
        (u32::MAX, None),
    ] {
        assert_eq!(at(address), name, "{address:#x}");
    }
}

/// Code and constants are read; what is written, what ends first and what is nowhere are not.
#[test]
fn constants_are_read_and_nothing_else() {
    let elf = read(&ALL).expect("it is an ELF file");
    assert_eq!((elf.byte(0x1001), elf.byte(0x1007)), (Some(2), Some(0xe7)));
    assert_eq!(
        (elf.half(0x1002), elf.half(0x1006)),
        (Some(0xf803), Some(0xe707))
    );
    assert_eq!(
        (elf.word(0x1000), elf.word(0x1008)),
        (Some(0xf803_0201), Some(7))
    );
    assert_eq!((elf.half(0x1007), elf.word(0x1009)), (None, None));
    assert_eq!((elf.byte(0x2000), elf.byte(0x100c)), (None, None));
    assert!(elf.is_wide(0x1002) && !elf.is_wide(0x1000) && !elf.is_wide(0x2000));
    let constants = elf.constants();
    let bases: Vec<u32> = constants.iter().map(|own| own.0).collect();
    assert_eq!(bases, [0x1000, 0x1008]);
    let mut other = ALL;
    other[1].4 = &[1, 2, 3, 0xf8, 5, 6, 8, 0xe7];
    let other = read(&other).expect("it is an ELF file").constants();
    assert!(other[0] != constants[0] && other[1] == constants[1]);
}

#[test]
fn a_certificate_and_its_kernels_are_texts() {
    let with = |more: &[Section]| read(&[&ALL[..], more].concat());
    let text: Section = (CERTIFICATE, BITS, 0, 0, b"claims");
    let kernels: Section = (KERNELS, BITS, 0, 0, b"kernel");
    let elf = with(&[text, kernels]).expect("it is an ELF file");
    assert_eq!(elf.certificate.as_deref(), Some("claims"));
    assert_eq!(elf.kernels.as_deref(), Some("kernel"));
    assert_eq!(elf.sections.len(), 5);
    let twice = with(&[text, text]).expect_err("it is there twice");
    assert_eq!(twice, "has two sections `.whippen.certificate`");
    let none = with(&[(KERNELS, BITS, 0, 0, &[0xff])]).expect_err("it is no text");
    assert_eq!(none, "has a section `.whippen.kernels` that is no text");
}

/// One section begins where another ends, or within an empty one; never within another.
#[test]
fn sections_lie_apart() {
    let with = |more: Section| read(&[&ALL[..], &[more]].concat()).err();
    assert_eq!(with((".more", BITS, LOADED, 0x100c, &[0])), None);
    assert_eq!(with((".more", BITS, LOADED, 0x1001, &[])), None);
    let overlap = |name: &str| Some(format!("has sections that overlap: `{name}`"));
    assert_eq!(
        with((".more", BITS, LOADED, 0x100b, &[0])),
        overlap(".more")
    );
    assert_eq!(
        with((".more", BITS, LOADED, 0xfff, &[0, 0])),
        overlap(".text")
    );
}

#[test]
fn whatever_is_no_executable_for_arm_is_refused() {
    let whole = file(&ALL);
    assert!(Elf::read(&whole).is_ok());
    let none = "is no executable ELF file for Arm";
    for at in [0, 1, 4, 5, 16, 17, 18, 19] {
        let mut other = whole.clone();
        other[at] ^= 1;
        assert_eq!(Elf::read(&other).err().as_deref(), Some(none), "byte {at}");
    }
    // Wherever it ends too early; of the last header the last four words are not used.
    for end in 0..whole.len() - 16 {
        assert!(Elf::read(&whole[..end]).is_err(), "{end} bytes");
    }
    let mut far = whole.clone();
    far[32..36].copy_from_slice(&u32::MAX.to_le_bytes());
    let early = "is an ELF file that ends too early";
    assert_eq!(Elf::read(&far).err().as_deref(), Some(early));
}
