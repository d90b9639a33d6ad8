//! Certificates: every bundled instrument's is accepted, with the cycles of the bound; changed in
//! one place it is refused.
//!
//! `WHIPPEN_MUTANTS=all` tries every change of a certificate, not one of six.

use whippen_compiler::Rng;
use whippen_compiler::audit::{Certificate, Elf, Refusal, audit, check_ranges};
use whippen_compiler::image::{Executable, SectionKind, executable};
use whippen_compiler::pipeline;
use whippen_emulator::BoardKind;

use crate::changed::changed;
use crate::image::{Image, instruments};

fn certified(image: &Image, kernels: &str) -> Result<Certificate, String> {
    let file = executable(&image.whole.image, &[], None);
    let rate_hz = image.compiled.model.rate_hz;
    pipeline::certify(&image.whole, &image.board, rate_hz, kernels, &file)
        .map_err(|why| why.to_string())
}

fn spring() -> Image {
    let mut all = instruments();
    all.retain(|compiled| compiled.model.name == "virtual_spring");
    Image::new(all.remove(0), 4)
}

/// What a checker says of a text beside the bytes of an image.
fn judged(elf: &Elf, text: &str) -> Result<(), String> {
    let certificate = Certificate::read(text)?;
    audit(elf, &certificate)
        .map(|_| ())
        .map_err(|why: Refusal| why.to_string())
}

/// The keys' cycles are those of the bound, and so are the handler's; what runs between ticks is
/// cheaper by what its branches cost where their targets are known.
#[test]
fn every_instrument_is_audited() {
    for compiled in instruments() {
        let image = Image::on(BoardKind::Rp2350, compiled, 8);
        let kernel = image.modes.kernel.to_string();
        let certificate =
            certified(&image, &kernel).unwrap_or_else(|why| panic!("{}: {why}", image.name()));
        let text = certificate.to_string();
        let file = Executable::new(&image.whole.image, &[]).certified(&text, &kernel);
        let elf = Elf::read(&file).expect("it is an ELF file");
        let text = elf.certificate.as_deref().expect("it has a certificate");
        let kernels = elf.kernels.as_deref().expect("it has its Kernel");
        let ranges = check_ranges(kernels).unwrap_or_else(|why| panic!("{}: {why}", image.name()));
        assert!(ranges.len() == 1 && ranges[0].values > 20 && ranges[0].stores > 3);
        let read = Certificate::read(text).expect("it can be read");
        assert_eq!(read, certificate, "{}", image.name());
        let checked = audit(&elf, &read).unwrap_or_else(|why| panic!("{}: {why}", image.name()));
        for (checked, core) in checked.iter().zip(&image.cores) {
            let bound = &core.contended;
            let told = format!(
                "{}: {} of {}",
                image.name(),
                checked.cycles,
                bound.cycles_max
            );
            println!("{told}, {} a key, {} states", checked.key, checked.states);
            assert_eq!(checked.key, bound.key_cycles_max(), "{told}");
            assert_eq!(checked.parts[2].1, bound.handler.cycles_max, "{told}");
            assert_eq!(checked.stack, bound.stack_bytes_max, "{told}");
            assert!(
                (0..=4).contains(&(bound.cycles_max - checked.cycles)),
                "{told}"
            );
        }
    }
}

/// Any number of a line, and the line as a whole.
const ANY: usize = usize::MAX;

/// Numbers whose change is accepted where it is no lie, by the line's first word and the number's
/// place in it (0: the line left out), and why.
const HARMLESS: [(&str, usize, &str); 10] = [
    (
        "deadline",
        1,
        "what a frame may take is asked, not proven; it is told beside the cycles",
    ),
    (
        "memory",
        ANY,
        "no byte says what the board is; `--explain` tells each memory",
    ),
    ("bus", ANY, "likewise"),
    (
        "entered",
        ANY,
        "an assumption, which `--explain` tells; another with the same outcome",
    ),
    (
        "returns",
        ANY,
        "another place to return to at the same cost, or none: the most expensive",
    ),
    (
        "function",
        3,
        "more banks than are fetched from, where that costs nothing",
    ),
    (
        "place",
        ANY,
        "less is claimed of a register, or something else that is true",
    ),
    (
        "point",
        4,
        "another of the stacks, which claims less of registers",
    ),
    (
        "state",
        0,
        "another state covers what comes here, at the same cycles",
    ),
    (
        "state",
        2,
        "other facts, which claim less or hold too, and no other cycles",
    ),
];

/// Lines that may be left out as nothing meets them: in an image of one program none begins, so
/// these calls are never made. Whatever else they say is harmless.
const UNMET: [&str; 2] = ["call", "targets"];

/// Every number one up and one down, every line left out and doubled.
fn mutants(line: &str) -> Vec<(usize, Vec<String>)> {
    let mut all = vec![(0, Vec::new()), (0, vec![line.to_string(); 2])];
    for word in 1..line.split(' ').count() {
        for by in [1, -1] {
            let new = changed(line, word, |old| old + by);
            all.extend(new.map(|new| (word, vec![new])));
        }
    }
    all
}

#[test]
fn a_certificate_that_lies_is_refused() {
    let image = spring();
    let text = certified(&image, "").expect("it has one").to_string();
    let elf = Elf::read(&executable(&image.whole.image, &[], None)).expect("it is an ELF file");
    assert_eq!(judged(&elf, &text), Ok(()));
    let lines: Vec<&str> = text.lines().collect();
    let (mut random, all) = (Rng::new(1), std::env::var_os("WHIPPEN_MUTANTS").is_some());
    let (mut tried, mut harmless, mut unmet, mut accepted) = (0, 0, 0, Vec::new());
    for (at, line) in lines.iter().enumerate() {
        for (word, new) in mutants(line) {
            if !new.is_empty() && !all && !random.chance(1, 6) {
                continue;
            }
            let before = lines[..at].iter().map(|line| line.to_string());
            let behind = lines[at + 1..].iter().map(|line| line.to_string());
            let text: Vec<String> = before.chain(new.clone()).chain(behind).collect();
            tried += 1;
            if judged(&elf, &text.join("\n")).is_err() {
                continue;
            }
            let what = line.split(' ').next().unwrap_or_default();
            if word == 0 && new.is_empty() && UNMET.contains(&what) {
                unmet += 1;
                break;
            }
            let known = |own: &&(&str, usize, &str)| own.0 == what && [ANY, word].contains(&own.1);
            match HARMLESS.iter().find(known) {
                Some(_) => harmless += 1,
                None => accepted.push(format!("`{line}` as {new:?}")),
            }
        }
    }
    println!("{tried} tried, {harmless} harmless, {unmet} lines of what is not met");
    assert!(unmet <= 8, "two calls of each core, with their targets");
    assert!(
        accepted.is_empty(),
        "{} of {tried}:\n{}",
        accepted.len(),
        accepted.join("\n")
    );
    assert!(harmless < tried / 20, "{harmless} of {tried} are harmless");
}

/// Turns bits of a byte that is stored.
fn flip(image: &mut Image, at: u32, bits: u8) {
    let segments = image.whole.image.segments.iter_mut();
    let mut own = segments.filter(|own| at.wrapping_sub(own.run) < own.bytes.len() as u32);
    let own = own.next().expect("it is stored");
    own.bytes[(at - own.run) as usize] ^= bits;
}

#[test]
fn an_image_with_another_bit_is_refused() {
    let mut image = spring();
    let text = certified(&image, "").expect("it has one").to_string();
    let mut random = Rng::new(1);
    let code = image
        .whole
        .image
        .sections
        .iter()
        .filter(|own| own.kind == SectionKind::Code && own.size > 0);
    let code: Vec<(u32, u32)> = code.map(|own| (own.run, own.size)).collect();
    let (mut noticed, tries) = (0, 64);
    for _ in 0..tries {
        let (base, size) = code[random.below(code.len() as u64) as usize];
        let at = base + random.below(u64::from(size)) as u32;
        let bit = 1_u8 << random.below(8);
        flip(&mut image, at, bit);
        let elf = Elf::read(&executable(&image.whole.image, &[], None)).expect("an ELF file");
        flip(&mut image, at, bit);
        assert!(judged(&elf, &text).is_err(), "{at:#x} {bit:#x}");
        let mut own = Certificate::read(&text).expect("it can be read");
        own.sections = elf.constants();
        noticed += u32::from(audit(&elf, &own).is_err());
    }
    println!("{noticed} of {tries} also where the sections' numbers are adapted");
    assert!(
        noticed > 4,
        "the rest is code that no tick reaches, or registers that decide nothing"
    );
}

/// Every line of a Kernel with an end of a value's interval one up or one down.
fn with_another_interval(line: &str) -> Vec<String> {
    let definitions = line.split(" = ").next().unwrap_or_default();
    let is_definition = line.trim_start().starts_with('v') && line.contains(" = ");
    let Some((head, ends)) = definitions.split_once('[').filter(|_| is_definition) else {
        return Vec::new();
    };
    // Of several results that of the first.
    let (ends, more) = ends.split_once(']').expect("an interval ends");
    let (low, high) = ends.split_once("..").expect("it has two ends");
    let [low, high]: [i64; 2] = [low, high].map(|end| end.parse().expect("a number"));
    let moved = [(-1, 0), (1, 0), (0, -1), (0, 1)];
    let tail = &line[definitions.len()..];
    let other = |(a, b): (i64, i64)| format!("{head}[{}..{}]{more}{tail}", low + a, high + b);
    moved.into_iter().map(other).collect()
}

#[test]
fn an_interval_that_is_too_small_or_too_large_is_refused() {
    let mut tried = 0;
    for compiled in instruments() {
        let text = compiled.lowered.kernel.to_string();
        assert_eq!(check_ranges(&text).map(|all| all.len()), Ok(1));
        let lines: Vec<&str> = text.lines().collect();
        let every = 1 + lines.len() / 100;
        for (at, line) in lines.iter().enumerate().step_by(every) {
            for other in with_another_interval(line) {
                let mut lines = lines.clone();
                lines[at] = &other;
                tried += 1;
                assert!(check_ranges(&lines.join("\n")).is_err(), "{other}");
            }
        }
    }
    println!("{tried} other intervals");
    assert!(tried > 1000);
}

#[test]
fn what_a_kernel_stores_must_have_room() {
    let kernel = |tick: &str| {
        format!(
            "kernel k @44100 {{\n  in x: u16 [0..65535]\n  out f: i16 [-9..9]\n  \
             cell a: i32 [0..9] = 3\n  line h: 4 [0..65535]\n  tick {{\n{tick}  }}\n}}\n"
        )
    };
    let why = |tick: &str| match check_ranges(&kernel(tick)) {
        Ok(_) => String::new(),
        Err(why) => why.to_string(),
    };
    let read = "v0: i32 [0..65535] = in x\n";
    assert_eq!(why(&format!("{read}push h v0\n")), "");
    for (tick, says) in [
        (
            format!("{read}set a v0\n"),
            "the ranges of `k`: `set a v0`: [0..65535] is stored where [0..9] is held",
        ),
        (
            "v0: i32 [0..65535] = delay h 5\n".to_string(),
            "the ranges of `k`: `v0: i32 [0..65535] = delay h 5`: the line holds 4 words",
        ),
        (
            "set a v1\n".to_string(),
            "the ranges of `k`: `set a v1`: v1 is not defined on the way here",
        ),
        (
            format!(
                "{read}v1: i32 [0..131070] = add v0 v0\nv2: i32 [0..131070] = shl_wrap v0 20\n"
            ),
            "the ranges of `k`: `v2: i32 [0..131070] = shl_wrap v0 20`: [0..131070] is declared, \
             [-2147483648..2147483647] is computed",
        ),
        (
            format!("{read}set b v0\n"),
            "the ranges of `k`: `set b v0`: names what is not declared",
        ),
    ] {
        assert_eq!(why(&tick), says);
    }
}
