//! Certificates of boards with a DMA: what that costs is part of the bound, and is not made less.

use whippen_compiler::audit::{Certificate, Elf, audit};
use whippen_compiler::firmware::OwnTexts;
use whippen_compiler::image::executable;
use whippen_compiler::pipeline::{self, unobserved};
use whippen_runtime::board;

use crate::key_bench::whole_keys;

/// The certificate of so many springs on a board: accepted with the cycles of the bound, and
/// refused where it says less of the DMA, or of the other core.
fn is_certified(board: &str, keys: u32) {
    let board = board::bundled(board).expect("it is bundled");
    let (whole, compiled, rate_hz) =
        whole_keys("virtual-spring.whip", keys, &board, OwnTexts::default());
    let proof = pipeline::prove(&whole, &board, rate_hz, &mut unobserved).expect("it is bounded");
    let bounds = &proof.programs[0].cores;
    let kernel = compiled.lowered.kernel.to_string();
    let file = executable(&whole.image, &[], None);
    let certificate = pipeline::certify(&whole, &board, rate_hz, &kernel, &file);
    let certificate = certificate.unwrap_or_else(|why| panic!("{why}"));
    let mut elf = Elf::read(&file).expect("it is an ELF file");
    elf.kernels = Some(kernel);
    let checked = audit(&elf, &certificate).unwrap_or_else(|why| panic!("{why}"));
    assert_eq!(checked.len(), bounds.len());
    for (checked, bound) in checked.iter().zip(bounds) {
        let bound = &bound.contended;
        println!("{} of {}", checked.cycles, bound.cycles_max);
        assert_eq!(checked.parts[2].1, bound.handler.cycles_max);
        assert!((0..=4).contains(&(bound.cycles_max - checked.cycles)));
    }

    let text = certificate.to_string();
    let dma = text.lines().find(|line| line.starts_with("dma "));
    let dma = dma.expect("it says what the DMA does");
    let with = |line: &str| text.replace(&format!("{dma}\n"), line);
    let judged = |text: &str| {
        let certificate = Certificate::read(text)?;
        audit(&elf, &certificate).map_err(|why| why.to_string())
    };
    assert!(judged(&text).is_ok());
    let words: Vec<&str> = dma.split(' ').collect();
    let [_, bus, wait, accesses] = words[..] else {
        panic!("{dma}");
    };
    for line in text.lines().filter(|line| line.starts_with("neighbour ")) {
        let words: Vec<&str> = line.split(' ').collect();
        let [name, bus, first, second] = words[..] else {
            panic!("{line}");
        };
        let swapped = format!("{name} {bus} {second} {first}");
        for (instead, says) in [
            (String::new(), "cycles"),
            (swapped + "\n", "cycles"),
            (format!("{name} {bus} {first}\n"), "cores meet at a bridge"),
            (
                format!("{name} 0x3 {first} {second}\n"),
                "cores meet at a bridge",
            ),
        ] {
            let why = judged(&text.replace(&format!("{line}\n"), &instead)).expect_err(&instead);
            assert!(why.contains(says), "{instead}: {why}");
        }
    }
    let less = wait.parse::<u32>().expect("a number") - 1;
    for (line, says) in [
        (String::new(), "cycles"),
        (format!("dma {bus} {less} {accesses}\n"), "cycles"),
        (format!("dma {bus} {wait} 1\n"), "cycles"),
        (
            format!("dma 0x3 {wait} {accesses}\n"),
            "a bridge that is none",
        ),
    ] {
        let why = judged(&with(&line)).expect_err(&line);
        assert!(why.contains(says), "{line}: {why}");
    }
}

#[test]
fn a_bench_has_a_certificate_in_which_the_dma_waits() {
    is_certified("rp2350b_bench", 8);
}

#[test]
fn columns_have_a_certificate_in_which_the_dma_waits() {
    is_certified("rp2350_columns", 16);
    is_certified("rp2350_seven_columns", 16);
}
