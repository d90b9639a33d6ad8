//! ELF files made word by word.

use super::{CERTIFICATE, Elf, KERNELS, word_at};

/// A section: name, type, flags, address, bytes.
pub(crate) type Section<'a> = (&'a str, u32, u32, u32, &'a [u8]);

/// Of a file its header, its segments, the bytes of its sections, their names and their table.
pub(crate) fn file(sections: &[Section]) -> Vec<u8> {
    file_with(sections, &|_| ())
}

/// The same with other segments than one for each section that is loaded with bytes.
fn file_with(sections: &[Section], change: &dyn Fn(&mut Vec<[u32; 8]>)) -> Vec<u8> {
    let has_bytes = |own: &&Section| own.1 != BSS && own.2 & LOADED != 0 && !own.4.is_empty();
    let loaded = sections.iter().filter(has_bytes);
    let mut segments: Vec<[u32; 8]> = loaded
        .map(|own| [1, 0, own.3, own.3 ^ FLASH, own.4.len() as u32, 0, 0, 4])
        .collect();
    // A mark of a debugger's, which loads nothing.
    segments.push([0x6474_e551, 0, 0x1000, 0x1000, 0x1000, 0, 6, 0]);
    let mut bytes = vec![0_u8; 52 + 32 * segments.len()];
    let (mut names, mut headers) = (vec![0_u8], vec![[0_u32; 10]]);
    let mut at_segment = 0;
    for section in sections {
        let (name, kind, flags, base, own) = section;
        let (name_at, at) = (names.len() as u32, bytes.len() as u32);
        names.extend(name.bytes().chain([0]));
        bytes.extend(if *kind == BSS { &[][..] } else { own });
        let size = own.len() as u32;
        headers.push([name_at, *kind, *flags, *base, at, size, 0, 0, 0, 0]);
        if has_bytes(&section) {
            segments[at_segment][1] = at;
            at_segment += 1;
        }
    }
    change(&mut segments);
    let (name_at, at) = (names.len() as u32, bytes.len() as u32);
    names.extend(b".shstrtab\0");
    headers.push([name_at, 3, 0, 0, at, names.len() as u32, 0, 0, 0, 0]);
    bytes.extend(&names);
    let table = bytes.len() as u32;
    bytes[..7].copy_from_slice(b"\x7fELF\x01\x01\x01");
    let mut put = |at: usize, half: u16| bytes[at..at + 2].copy_from_slice(&half.to_le_bytes());
    put(16, 2);
    put(18, 40);
    put(42, 32);
    put(44, segments.len() as u16);
    put(46, 40);
    put(48, headers.len() as u16);
    put(50, headers.len() as u16 - 1);
    bytes[28..32].copy_from_slice(&52_u32.to_le_bytes());
    bytes[32..36].copy_from_slice(&table.to_le_bytes());
    let words = segments
        .iter()
        .flatten()
        .flat_map(|word| word.to_le_bytes());
    bytes.splice(52..52 + 32 * segments.len(), words);
    bytes.extend(headers.iter().flatten().flat_map(|word| word.to_le_bytes()));
    bytes
}

/// What is flashed lies there, from where the start copies it.
const FLASH: u32 = 0x1000_0000;
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

/// What is loaded is no certificate: that costs no memory.
#[test]
fn a_certificate_is_not_loaded() {
    let text: Section = (CERTIFICATE, BITS, LOADED, 0x3000, b"claims");
    let elf = read(&[&ALL[..], &[text]].concat()).expect("it is an ELF file");
    assert_eq!((elf.certificate, elf.sections.len()), (None, 6));
}

/// One section begins where another ends, or within an empty one; never within another, whatever
/// lies between their beginnings, and none goes around the end of all addresses.
#[test]
fn sections_lie_apart() {
    let with = |more: &[Section]| read(&[&ALL[..], more].concat()).err();
    let more = |base, bytes| -> Section<'static> { (".more", BSS, LOADED, base, bytes) };
    assert_eq!(with(&[more(0x100c, &[0])]), None);
    assert_eq!(with(&[more(0x1001, &[])]), None);
    assert_eq!(with(&[more(u32::MAX, &[])]), None);
    assert_eq!(with(&[more(u32::MAX - 8, &[0; 8])]), None);
    let overlap = |name: &str| {
        let why = "that goes into another one, or beyond all addresses";
        Some(format!("has a section `{name}` {why}"))
    };
    assert_eq!(with(&[more(0x100b, &[0])]), overlap(".rodata"));
    assert_eq!(with(&[more(0xfff, &[0, 0])]), overlap(".more"));
    assert_eq!(with(&[more(0x2017, &[0; 2])]), overlap(".bss"));
    assert_eq!(
        with(&[more(0x2010, &[]), more(0x2010, &[0])]),
        overlap(".bss")
    );
    assert_eq!(with(&[more(u32::MAX - 7, &[0; 8])]), overlap(".more"));
    let around = [more(u32::MAX - 7, &[0; 9]), more(u32::MAX, &[0])];
    assert_eq!(with(&around), overlap(".more"));
}

/// Files are loaded by their segments: what a section holds is what one of them loads.
#[test]
fn sections_are_what_segments_load() {
    let with = |change: &dyn Fn(&mut Vec<[u32; 8]>)| {
        let file = file_with(&ALL, change);
        Elf::read(&file).err().unwrap_or_default()
    };
    assert_eq!(with(&|_| ()), "");
    // `.data`, `.text` and `.rodata`, by their numbers: two in one.
    assert_eq!(
        with(&|all| {
            all[1][4] += all[2][4];
            all.remove(2);
        }),
        ""
    );
    // What stands behind the bytes of a segment is zeroed where it lies, not where it is flashed.
    assert_eq!(with(&|all| all[0][5] = 8 + 16), "");
    let none = |name: &str| format!("has a section `{name}` that no segment loads");
    type Change = fn(&mut Vec<[u32; 8]>);
    let changes: [(Change, &str); 8] = [
        (|all| all.truncate(1), ".text"),
        (|all| all[1][0] = 2, ".text"),
        (|all| all[1][1] += 1, ".text"),
        (|all| all[1][1] -= 1, ".text"),
        (|all| all[1][2] -= 1, ".text"),
        (|all| all[1][4] -= 1, ".text"),
        (|all| all[0][2] -= 1, ".data"),
        (|all| all[2][2] += 8, ".rodata"),
    ];
    for (nth, (change, name)) in changes.iter().enumerate() {
        assert_eq!(with(change), none(name), "{nth}");
    }
    let overlap = "has segments that overlap";
    let changes: [Change; 5] = [
        |all| all[1][4] += 1,
        |all| all[1][5] = 9,
        |all| all[1][3] += 1,
        |all| all[0][3] = all[1][3] + 7,
        |all| all[0][5] = u32::MAX,
    ];
    for (nth, change) in changes.iter().enumerate() {
        assert_eq!(with(change), overlap, "{nth}");
    }
}

/// Headers say how large they are; nothing of a file stands in it more than once.
#[test]
fn sections_of_a_file_are_no_more_than_the_file() {
    let whole = file(&ALL);
    let with = |at: usize, half: u16| {
        let mut other = whole.clone();
        other[at..at + 2].copy_from_slice(&half.to_le_bytes());
        Elf::read(&other).err().unwrap_or_default()
    };
    let size = "has headers of another size than that of an ELF file";
    for (at, half) in [(42, 31), (42, 0), (46, 39), (46, 0), (46, 64)] {
        assert_eq!(with(at, half), size, "{half} at {at}");
    }
    // Without segments their size is not asked.
    let bss: Section = (".bss", BSS, LOADED | WRITES, 0x2008, &[0; 16]);
    let mut none = file_with(&[bss], &|all| all.clear());
    none[42..44].copy_from_slice(&[0; 2]);
    assert!(Elf::read(&none).is_ok());
    // The names of all sections are those of one, and the bytes of two are the same.
    let early = "is an ELF file that ends too early";
    assert_eq!(with(50, 100), early);
    let table = word_at(&whole, 32).expect("a table") as usize;
    let section = |nth: usize| table + 40 * nth;
    let names = word_at(&whole, section(7) + 16).expect("names");
    let both = |words: &dyn Fn(u32) -> [(usize, u32); 4]| {
        let mut other = whole.clone();
        let long = other.len() as u32;
        other.extend([b'x'; 2000]);
        for (field, word) in [5, 6].into_iter().flat_map(|nth| {
            let at = section(nth);
            words(long).map(move |(field, word)| (at + 4 * field, word))
        }) {
            other[field..field + 4].copy_from_slice(&word.to_le_bytes());
        }
        Elf::read(&other).err().unwrap_or_default()
    };
    let same = "has sections of the same bytes";
    assert_eq!(
        both(&|long| [(0, long - names), (1, 1), (2, 0), (5, 0)]),
        same
    );
    assert_eq!(both(&|long| [(1, 1), (2, 0), (4, long), (5, 2000)]), same);
    // What takes no bytes, or fewer.
    assert_eq!(both(&|long| [(1, BSS), (2, 0), (4, long), (5, 2000)]), "");
    assert_eq!(both(&|long| [(1, 1), (2, 0), (4, long), (5, 1000)]), "");
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
    // Wherever it ends too early.
    for end in 0..whole.len() {
        assert!(Elf::read(&whole[..end]).is_err(), "{end} bytes");
    }
    let early = "is an ELF file that ends too early";
    for at in [28, 32] {
        let mut far = whole.clone();
        far[at..at + 4].copy_from_slice(&u32::MAX.to_le_bytes());
        assert_eq!(Elf::read(&far).err().as_deref(), Some(early));
    }
}
