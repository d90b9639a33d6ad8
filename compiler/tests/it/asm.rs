//! The assembler against the GNU one, and what it says of mistakes.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::Command;

use whippen_compiler::asm::{Source, assemble};
use whippen_compiler::image::{FixupKind, Object};
use whippen_isa::{Arch, ItState, Op, decode, is_wide};

/// Where sections go here, and outside names.
const PLACES: &[(&str, u32)] = &[
    (".vectors", 0x1000_0000),
    (".text", 0x2000_0000),
    (".data", 0x2004_0000),
    (".bss", 0x2005_0000),
];
const OUTSIDE: (&str, u32) = ("outside", 0x2000_8000);

fn assembled(text: &str) -> Object {
    let source = Source {
        name: "sample.s",
        text,
    };
    assemble(&[source], &BTreeMap::new(), Arch::V8M).unwrap_or_else(|e| panic!("{e}"))
}

fn place(name: &str) -> u32 {
    PLACES
        .iter()
        .find(|(section, _)| *section == name)
        .unwrap_or_else(|| panic!("{name}"))
        .1
}

/// The bytes of a section at the places of this test.
fn linked(object: &Object, name: &str) -> Vec<u8> {
    let section = object
        .sections
        .iter()
        .find(|section| section.name == name)
        .expect("the section");
    let mut bytes = section.bytes.clone();
    for fixup in &section.fixups {
        let symbol = object
            .symbols
            .iter()
            .find(|symbol| symbol.name == fixup.symbol)
            .expect("the symbol");
        let base = symbol.section.map_or(OUTSIDE.1, |index| {
            place(&object.sections[index].name) + symbol.offset
        });
        let thumb = u32::from(symbol.kind == whippen_compiler::image::SymbolKind::Function);
        let target = base.wrapping_add_signed(fixup.addend);
        let at = fixup.at as usize;
        let here = place(name) + fixup.at;
        patch(&mut bytes[at..at + 4], fixup.kind, target, thumb, here);
    }
    bytes
}

fn patch(bytes: &mut [u8], kind: FixupKind, target: u32, thumb: u32, here: u32) {
    let half = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
    let word = match kind {
        FixupKind::Abs32 => target | thumb,
        FixupKind::Rel32 => target.wrapping_sub(here),
        kind => {
            let mut inst =
                decode(half(0), half(2), Arch::V8M, ItState::OUTSIDE).expect("an instruction");
            inst.imm = match kind {
                FixupKind::MovwAbs => (target | thumb) & 0xffff,
                FixupKind::MovtAbs => target >> 16,
                _ => target.wrapping_sub(here + 4),
            };
            let (first, second) = inst.encode(Arch::V8M).expect("in reach").halfwords();
            u32::from(first) | u32::from(second.expect("wide")) << 16
        }
    };
    bytes.copy_from_slice(&word.to_le_bytes());
}

/// Whether the GNU tools are here; if not, the test counts as skipped.
fn is_installed() -> bool {
    whippen_need::tools(&[
        "arm-none-eabi-as",
        "arm-none-eabi-ld",
        "arm-none-eabi-objcopy",
    ])
}

/// The bytes of sections, by the GNU assembler and linker.
fn gnu(name: &str, text: &str, sections: &[&str]) -> Vec<Vec<u8>> {
    let path = |extension: &str| {
        PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.{extension}"))
    };
    std::fs::write(path("s"), text).expect("the target directory can be written");
    let run = |command: &mut Command| {
        let output = command.output().expect("the GNU tools run");
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
    };
    run(Command::new("arm-none-eabi-as")
        .arg("-mcpu=cortex-m33")
        .arg("-o")
        .arg(path("o"))
        .arg(path("s")));
    let mut ld = Command::new("arm-none-eabi-ld");
    ld.arg(format!("--defsym={}={:#x}", OUTSIDE.0, OUTSIDE.1))
        .arg("-o")
        .arg(path("elf"))
        .arg(path("o"));
    run(ld
        .args(
            PLACES
                .iter()
                .map(|(section, at)| format!("--section-start={section}={at:#x}")),
        )
        .arg("-estart"));
    let binary = |section: &&str| {
        let only = format!("--only-section={section}");
        run(Command::new("arm-none-eabi-objcopy")
            .args(["-O", "binary", &only])
            .arg(path("elf"))
            .arg(path("bin")));
        std::fs::read(path("bin")).expect("objcopy has written")
    };
    sections.iter().map(binary).collect()
}

#[test]
fn it_makes_the_bytes_of_the_gnu_assembler() {
    let text = include_str!("asm/sample.s");
    let object = assembled(text);
    assert_eq!(
        object
            .sections
            .iter()
            .find(|s| s.name == ".bss")
            .expect("there")
            .size,
        64
    );
    if !is_installed() {
        return;
    }
    let sections = [".vectors", ".text", ".data"];
    for (name, theirs) in sections.iter().zip(gnu("asm-sample", text, &sections)) {
        let ours = linked(&object, name);
        let differs = ours.iter().zip(&theirs).position(|(a, b)| a != b);
        assert_eq!(
            (differs, ours.len()),
            (None, theirs.len()),
            "{name}: {ours:02x?}\n{theirs:02x?}"
        );
    }
}

/// What is assembled, read back by the table, is assembled to the same.
#[test]
fn it_reads_back() {
    let text = "push {r4-r7, lr}\n1: ldr r0, [r1, #4]\nsubs r0, #1\nbne 1b\nsmmul r2, r0, r1\nssat r2, #16, r2\n\
                strh r2, [r3], #2\nit ne\nmovne r0, #1\npop {r4-r7, pc}\n";
    let bytes = assembled(text).sections[0].bytes.clone();
    let (mut at, mut again, mut it) = (0, String::new(), ItState::OUTSIDE);
    while at < bytes.len() {
        let half = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
        let second = if is_wide(half(at)) { half(at + 2) } else { 0 };
        let inst = decode(half(at), second, Arch::V8M, it).expect("an instruction");
        again += &match inst.op() {
            Op::B => format!("bne . + ({})\n", inst.offset() + 4),
            _ => format!("{inst}\n"),
        };
        it = inst.it_behind(it).expect("a block");
        at += inst.size() as usize;
    }
    assert_eq!(assembled(&again).sections[0].bytes, bytes, "{again}");
}

#[test]
fn mistakes_have_their_line_and_a_way_out() {
    let texts = [
        "nop\n addd r0, r1",
        "nop\n\n mov r0, #0x12345",
        "moveq r0, r1",
        "it eq\nmovne r0, r1",
        "smmul r0, [r1]",
        "ldr r0, [r1, #NOWHERE]",
        "b 5",
        ".word 1 +",
        ".word 1b\n",
        ".short label",
        "a: nop\na: nop",
        ".bss\n.word 1",
        ".include \"x\"",
        ".if 1\nnop",
        ".rept 2\nnop",
        ".rept 100000\nnop\n.endr",
        ".space -1",
        ".byte 256",
        ".ascii \"open",
        "@! forever 3",
        "cbz r0, 1f\n.space 400\n1: nop",
        ".equ X, ((((1)",
    ];
    let messages = texts.map(|text| {
        let refused = assemble(&[Source { name: "m.s", text }], &BTreeMap::new(), Arch::V8M);
        format!(
            "{text:?}\n    {}",
            refused.map_or_else(|e| e.to_string(), |_| panic!("{text} assembles"))
        )
    });
    insta::assert_snapshot!(messages.join("\n"));
}

/// Texts made of pieces of assembly never make it panic.
#[test]
fn no_text_makes_it_panic() {
    let sample = include_str!("asm/sample.s");
    let words: Vec<&str> = sample.split_inclusive([' ', '\n', ',', '#', '[']).collect();
    let mut state = 9_u64;
    let mut next = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize
    };
    let mut refused = 0;
    for _ in 0..2000 {
        let text: String = (0..next() % 12)
            .map(|_| words[next() % words.len()])
            .collect();
        refused += usize::from(
            assemble(
                &[Source {
                    name: "r.s",
                    text: &text,
                }],
                &BTreeMap::new(),
                Arch::V8M,
            )
            .is_err(),
        );
    }
    assert!(refused > 1000, "{refused}");
}
