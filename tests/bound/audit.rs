//! Certificates: every bundled instrument's is accepted, with the cycles of the bound; changed in
//! one place it is refused.

use whippen_compiler::Rng;
use whippen_compiler::audit::{Certificate, Elf, Refusal, audit};
use whippen_compiler::image::{SectionKind, executable, executable_certified};
use whippen_compiler::pipeline;
use whippen_emulator::BoardKind;

use crate::image::{Image, instruments};

fn certified(image: &Image) -> Result<Certificate, String> {
    let file = executable(&image.whole.image, &[], None);
    let rate_hz = image.compiled.model.rate_hz;
    pipeline::certify(&image.whole, &image.board, rate_hz, &file).map_err(|why| why.to_string())
}

fn spring() -> Image {
    let mut all = instruments();
    all.retain(|compiled| compiled.model.name == "virtual_spring");
    Image::new(all.remove(0), 2)
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
        let certificate = certified(&image).unwrap_or_else(|why| panic!("{}: {why}", image.name()));
        let file = executable_certified(&image.whole.image, &[], &certificate.to_string());
        let elf = Elf::read(&file).expect("it is an ELF file");
        let text = elf.certificate.as_deref().expect("it has a certificate");
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

/// Entries whose change is no lie, and why: all else is refused.
const HARMLESS: [(&str, &str); 0] = [];

/// A line with one of its numbers changed.
fn changed(line: &str, word: usize, by: i128) -> Option<String> {
    let mut words: Vec<String> = line.split(' ').map(str::to_string).collect();
    let old = words.get(word)?;
    let number = match old.strip_prefix("0x") {
        Some(hex) => i128::from_str_radix(hex, 16).ok()?,
        None => old.parse().ok()?,
    };
    words[word] = (number + by).to_string();
    Some(words.join(" "))
}

/// Every number one up and one down, every line left out and doubled.
fn mutants(lines: &[&str], at: usize) -> Vec<(String, Vec<String>)> {
    let line = lines[at];
    let mut all = vec![
        (format!("without `{line}`"), Vec::new()),
        (format!("`{line}` twice"), vec![line.to_string(); 2]),
    ];
    for word in 1..line.split(' ').count() {
        for by in [1, -1] {
            let new = changed(line, word, by);
            all.extend(new.map(|new| (format!("`{line}` as `{new}`"), vec![new])));
        }
    }
    all
}

#[test]
fn a_certificate_that_lies_is_refused() {
    let image = spring();
    let text = certified(&image).expect("it has one").to_string();
    let elf = Elf::read(&executable(&image.whole.image, &[], None)).expect("it is an ELF file");
    assert_eq!(judged(&elf, &text), Ok(()));
    let lines: Vec<&str> = text.lines().collect();
    let (mut tried, mut accepted) = (0, Vec::new());
    for at in 0..lines.len() {
        for (what, new) in mutants(&lines, at) {
            let before = lines[..at].iter().map(|line| line.to_string());
            let behind = lines[at + 1..].iter().map(|line| line.to_string());
            let text: Vec<String> = before.chain(new).chain(behind).collect();
            tried += 1;
            if judged(&elf, &text.join("\n")).is_ok() {
                accepted.push(what);
            }
        }
    }
    println!("{tried} tried");
    let harmless = |what: &String| HARMLESS.iter().any(|(own, _)| what.contains(own));
    accepted.retain(|what| !harmless(what));
    assert!(
        accepted.is_empty(),
        "{} of {tried}:\n{}",
        accepted.len(),
        accepted.join("\n")
    );
}

#[test]
fn an_image_with_another_bit_is_refused() {
    let mut image = spring();
    let text = certified(&image).expect("it has one").to_string();
    let mut random = Rng::new(1);
    let code = image
        .whole
        .image
        .sections
        .iter()
        .filter(|own| own.kind == SectionKind::Code);
    let code: Vec<(u32, u32)> = code.map(|own| (own.run, own.size)).collect();
    let (mut noticed, tries) = (0, 64);
    for _ in 0..tries {
        let (base, size) = code[random.below(code.len() as u64) as usize];
        let at = base + random.below(u64::from(size)) as u32;
        let bit = 1 << random.below(8);
        let mut flip = || {
            let segments = image.whole.image.segments.iter_mut();
            let mut own = segments.filter(|own| at.wrapping_sub(own.run) < own.bytes.len() as u32);
            let own = own.next().expect("it is stored");
            own.bytes[(at - own.run) as usize] ^= bit;
        };
        flip();
        let elf = Elf::read(&executable(&image.whole.image, &[], None)).expect("an ELF file");
        flip();
        assert!(judged(&elf, &text).is_err(), "{at:#x} {bit:#x}");
        let mut own = Certificate::read(&text).expect("it can be read");
        own.sections = elf.constants();
        noticed += u32::from(audit(&elf, &own).is_err());
    }
    println!("{noticed} of {tries} also where the sections' numbers are adapted");
    assert!(noticed > tries / 4);
}
