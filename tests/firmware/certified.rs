//! Certificates of boards with a DMA: what that costs is part of the bound, and is not made less.

use whippen_compiler::audit::{Certificate, Elf, audit};
use whippen_compiler::firmware::OwnTexts;
use whippen_compiler::image::executable;
use whippen_compiler::pipeline::{self, unobserved};
use whippen_runtime::board;

use crate::key_bench::whole_keys;

/// The certificate of so many springs on a board: accepted with the cycles of the bound, and
/// refused where it says less of the DMA.
fn is_certified(board: &str, keys: u32) {
    let board = board::bundled(board).expect("it is bundled");
    let (whole, compiled, rate_hz) =
        whole_keys("virtual-spring.whip", keys, &board, OwnTexts::default());
    let proof = pipeline::prove(&whole, &board, rate_hz, &mut unobserved).expect("it is bounded");
    let bound = &proof.programs[0].cores[0].contended;
    let kernel = compiled.lowered.kernel.to_string();
    let file = executable(&whole.image, &[], None);
    let certificate = pipeline::certify(&whole, &board, rate_hz, &kernel, &file);
    let certificate = certificate.unwrap_or_else(|why| panic!("{why}"));
    let mut elf = Elf::read(&file).expect("it is an ELF file");
    elf.kernels = Some(kernel);
    let checked = audit(&elf, &certificate).unwrap_or_else(|why| panic!("{why}"));
    println!("{} of {}", checked[0].cycles, bound.cycles_max);
    assert_eq!(checked[0].parts[2].1, bound.handler.cycles_max);
    assert!((0..=4).contains(&(bound.cycles_max - checked[0].cycles)));

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
}
