//! Linked images: what binutils sees, what runs, what the tables say.

use whippen_compiler::image::Input;
use whippen_compiler::image::{LinkError, Start, executable, link, listing, map, uf2};
use whippen_compiler::source::SourceMap;
use whippen_isa::Arch;
use whippen_runtime::board::bundled;

use crate::program::{START, TEXT, image, object, places, probe};
use crate::tools::{Folder, WHIPPEN};

/// A board whose start needs no second stage of ours.
fn board(name: &str) -> whippen_compiler::image::Board {
    let mut board = bundled(name).expect("bundled");
    if board.start == Start::Boot2 {
        board.start = Start::Vectors;
    }
    board
}

fn sources() -> SourceMap {
    let mut map = SourceMap::default();
    map.add("probe.whip", TEXT);
    map
}

#[test]
fn images_run_on_every_board() {
    for (name, emulated) in [
        ("rp2350", "rp2350"),
        ("rp2040", "rp2040"),
        ("stm32f4", "stm32f4"),
    ] {
        let folder = Folder::new();
        let image = image(&board(name));
        folder.write("out.elf", executable(&image, &[], None));
        let state = image
            .symbols
            .iter()
            .find(|s| s.name == "probe_state")
            .expect("there")
            .address;
        let read = format!("{state:#x}:8");
        let mut args = vec![
            "emulate",
            "out.elf",
            "--max-cycles",
            "10000",
            "--read",
            &read,
            "--json",
        ];
        args.extend(["--board", emulated]);
        let told = folder.run(WHIPPEN, &args).expect("is built");
        // (4 + 3) * 5, by way of code, constants and data that were copied from flash.
        assert!(told.contains("0700000023000000"), "{name}: {told}");
    }
}

#[test]
fn binutils_read_the_executable_without_a_complaint() {
    let folder = Folder::new();
    folder.write("out.elf", executable(&image(&board("rp2350")), &[], None));
    let Some(told) = folder.run("arm-none-eabi-readelf", &["-a", "-W", "out.elf"]) else {
        return;
    };
    assert!(
        !told.to_lowercase().contains("warning") && !told.contains("Error"),
        "{told}"
    );
    for wanted in [
        "EXEC (Executable file)",
        "0x10000000",
        "Tag_CPU_arch: v8-M.mainline",
        "probe_tick",
        ".debug_line",
    ] {
        assert!(told.contains(wanted), "{wanted}: {told}");
    }
    let lines = folder
        .run(
            "arm-none-eabi-readelf",
            &["--debug-dump=info,decodedline", "out.elf"],
        )
        .expect("there");
    assert!(
        lines.contains("probe.whip")
            && lines.contains("DW_TAG_subprogram")
            && !lines.contains("Warning"),
        "{lines}"
    );
    let code = folder
        .run("arm-none-eabi-objdump", &["-d", "out.elf"])
        .expect("there");
    for wanted in ["<probe_tick>:", "<probe_scale>:", "bl\t", "muls\tr0, r1"] {
        assert!(code.contains(wanted), "{wanted}: {code}");
    }
}

#[test]
fn the_definition_block_stands_in_the_first_four_kibibytes() {
    let bytes = uf2(&image(&board("rp2350")), 0xe48b_ff59, None);
    assert_eq!(bytes.len() % 512, 0);
    let word =
        |block: &[u8], at: usize| u32::from_le_bytes(block[at..at + 4].try_into().expect("four"));
    let blocks: Vec<&[u8]> = bytes.chunks(512).collect();
    for (number, block) in (0..).zip(&blocks) {
        let head: Vec<u32> = (0..8).map(|at| word(block, 4 * at)).collect();
        let address = 0x1000_0000 + 256 * number;
        assert_eq!(
            head,
            [
                0x0a32_4655,
                0x9e5d_5157,
                0x2000,
                address,
                256,
                number,
                blocks.len() as u32,
                0xe48b_ff59
            ]
        );
        assert_eq!(word(block, 508), 0x0ab1_6f30);
    }
    let first: Vec<u32> = (0..64).map(|at| word(blocks[0], 32 + 4 * at)).collect();
    let block = [0xffff_ded3, 0x1021_0142, 0x0000_01ff, 0, 0xab12_3579];
    assert!(first.windows(5).any(|words| words == block), "{first:x?}");
    // The vector table comes first: the top of the last memory, then an odd address in flash.
    assert_eq!(
        (first[0], first[1] >> 16, first[1] & 1),
        (0x2008_2000, 0x1000, 1)
    );
}

#[test]
fn listing_and_map_show_what_there_is() {
    let board = board("rp2350");
    let image = image(&board);
    insta::assert_snapshot!("listing", listing(&image, &sources()));
    insta::assert_snapshot!("map", map(&image, &board));
}

#[test]
fn the_same_objects_give_the_same_bytes() {
    for name in whippen_compiler::bundled::boards() {
        let (a, b) = (image(&board(name)), image(&board(name)));
        assert_eq!(executable(&a, &[], None), executable(&b, &[], None));
        assert_eq!(listing(&a, &sources()), listing(&b, &sources()));
    }
}

#[test]
fn what_cannot_be_linked_is_told() {
    let board = board("rp2350");
    let (probe, places) = (probe(Arch::V8M), places());
    let start = |text: &str| object(&text.replace("__stack_top", "__sram9_end"), Arch::V8M);
    let linked = |text: &str| {
        let start = start(text);
        let inputs = [
            Input {
                object: &start,
                places: &[],
            },
            Input {
                object: &probe,
                places: &places,
            },
        ];
        link(&board, &inputs, "reset")
            .map(|_| ())
            .expect_err("is wrong")
    };
    let errors = [
        linked(&START.replace("=probe_tick", "=probe_tock")),
        linked(&START.replace(".text.start", ".note")),
        linked(&START.replace("reset", "restart")),
        linked(&format!(
            "{START}\n .global probe_state\nprobe_state: nop\n"
        )),
        linked(&format!(
            "{START}\n .section .data.big, \"aw\"\n .space 300000\n"
        )),
        LinkError::Boot2,
    ];
    let told: Vec<String> = errors.iter().map(ToString::to_string).collect();
    insta::assert_snapshot!("link_errors", told.join("\n"));
    let mut boot2 = board.clone();
    boot2.start = Start::Boot2;
    let start = start(START);
    let refused = link(
        &boot2,
        &[Input {
            object: &start,
            places: &[],
        }],
        "reset",
    )
    .map(|_| ());
    assert_eq!(refused, Err(LinkError::Boot2));
}
