//! The code of a small kernel as text, with the cycles of its tick.

use crate::target::Target;
use std::fmt::Write;
use whippen_compiler::kernel::{Kernel, parse};
use whippen_compiler::modes::Modes;
use whippen_compiler::thumb::{Options, compile};
use whippen_emulator::CoreKind;
use whippen_isa::{Arch, ItState, decode};

const SPRING: &str = "\
kernel spring @44100 {
  in x: u16 [0..65535]
  out drive: i16 [-32768..32767]
  cell s: i32 [0..131070] = 0
  line past: 2 [0..65535]
  tick {
    v0: i32 [0..65535] = in x
    v1: i32 [0..65535] = delay past 2
    v2: i32 [-65535..65535] = sub v0 v1
    v3: i32 [-2097120..2097120] = shl v2 5
    v4: i32 [1518500250..1518500250] = const 1518500250
    v5: i32 [-741456..741455] = mul_top v3 v4
    v6: i32 [-741456..806990] = add v5 v0
    v7: i32 [-32768..-32768] = const -32768
    v8: i32 [-32768..806990] = max v6 v7
    v9: i32 [32767..32767] = const 32767
    v10: i32 [-32768..32767] = min v8 v9
    out drive v10
    v11: i32 [0..131070] = add v0 v1
    set s v11
    push past v0
  }
}
";

fn kernel() -> Kernel {
    parse(SPRING).unwrap_or_else(|error| panic!("{error}"))
}

/// Offset, halfwords and instruction, from the entry to the end.
fn listing(code: &[u8], symbols: &[(u32, String)]) -> String {
    let half = |at: usize| {
        code.get(at..at + 2)
            .map_or(0, |b| u16::from_le_bytes([b[0], b[1]]))
    };
    let (mut text, mut at, mut it) = (String::new(), 0, ItState::OUTSIDE);
    while at < code.len() {
        symbols
            .iter()
            .filter(|(offset, _)| *offset as usize == at)
            .for_each(|(_, name)| text += &format!("{name}:\n"));
        let inst = decode(half(at), half(at + 2), Arch::V8M, it)
            .unwrap_or_else(|why| panic!("{at:#x}: {why:?}"));
        let second = if inst.size() == 4 {
            format!("{:04x}", half(at + 2))
        } else {
            String::new()
        };
        let _ = writeln!(text, "{at:4x}  {:04x} {second:4}  {inst}", half(at));
        it = inst.it_behind(it).unwrap_or_default();
        at += inst.size() as usize;
    }
    text
}

#[test]
fn of_a_spring() {
    let modes = Modes::single(&kernel());
    let options = Options {
        name: "k".into(),
        keys: 2,
        gain: false,
        probes: false,
        arch: Arch::V8M,
    };
    let built = compile(&modes, &options).unwrap_or_else(|error| panic!("{error}"));
    let functions = built
        .object
        .symbols
        .iter()
        .filter(|symbol| symbol.section == Some(0));
    let symbols: Vec<(u32, String)> = functions
        .map(|symbol| (symbol.offset, symbol.name.clone()))
        .collect();
    insta::assert_snapshot!(listing(&built.object.sections[0].bytes, &symbols));
}

/// One key more costs what its code costs, whatever the others do.
#[test]
fn cycles_of_a_key() {
    let cycles = |keys: u32| {
        let mut target = Target::new(&Modes::single(&kernel()), keys, CoreKind::CortexM33);
        let words = vec![30_000; keys as usize];
        target.init(&words);
        target.tick(&words);
        target.cycles
    };
    let [one, two, three] = [1, 2, 3].map(cycles);
    assert_eq!(two - one, three - two);
    assert!(two - one <= 20, "{} cycles", two - one);
}
