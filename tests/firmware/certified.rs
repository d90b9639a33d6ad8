//! The certificate of a board with a DMA: what that costs is part of the bound, and is not made
//! less.

use whippen_compiler::audit::{Certificate, Elf, audit};
use whippen_compiler::firmware::OwnTexts;
use whippen_compiler::image::executable;
use whippen_compiler::pipeline::{self, unobserved};

use crate::key_bench::{bundled_board, whole_bench, whole_keys};
use crate::key_columns::board_of;

/// Of columns too, whose DMA is met at its own registers and those of PIO; there it waits no less.
#[test]
fn columns_have_a_certificate_in_which_the_dma_waits_are() {
    let board = board_of(2);
    let (whole, compiled, rate_hz) =
        whole_keys("virtual-spring.whip", 9, &board, OwnTexts::default());
    let proof = pipeline::prove(&whole, &board, rate_hz, &mut unobserved).expect("it is bounded");
    let bound = &proof.programs[0].cores[0].contended;
    let kernel = compiled.lowered.kernel.to_string();
    let file = executable(&whole.image, &[], None);
    let certificate = pipeline::certify(&whole, &board, rate_hz, &kernel, &file);
    let text = certificate
        .unwrap_or_else(|why| panic!("{why}"))
        .to_string();
    let mut elf = Elf::read(&file).expect("it is an ELF file");
    elf.kernels = Some(kernel);
    let judged = |text: &str| {
        let certificate = Certificate::read(text)?;
        audit(&elf, &certificate).map_err(|why| why.to_string())
    };
    let checked = judged(&text).unwrap_or_else(|why| panic!("{why}"));
    assert!((0..=4).contains(&(bound.cycles_max - checked[0].cycles)));
    let dma = "dma 0x50000000 4 0\n";
    assert!(text.contains(dma), "{text}");
    for less in ["", "dma 0x50000000 3 0\n"] {
        let why = judged(&text.replace(dma, less)).expect_err(less);
        assert!(why.contains("cycles"), "{less}: {why}");
    }
}

#[test]
fn a_bench_has_a_certificate_in_which_the_dma_waits_are() {
    let board = bundled_board();
    let (whole, compiled, rate_hz) =
        whole_bench("virtual-spring.whip", &board, OwnTexts::default());
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
    for (line, says) in [
        (String::new(), "cycles"),
        (format!("dma {bus} 31 {accesses}\n"), "cycles"),
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
