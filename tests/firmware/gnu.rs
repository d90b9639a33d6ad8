//! The GNU assembler makes the same of the firmware's texts.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::Command;

use crate::rig::{Rig, kernel, midi, setup};
use crate::tuning::tuning;
use whippen_compiler::asm::{Source, assemble};
use whippen_compiler::firmware::{
    Coil, FirmwareError, Instrument, Monitor, Passivity, ProgramCode, Setup, Support, constants,
    frame_constants, objects, sources, support,
};
use whippen_compiler::image::{FixupKind, Section};
use whippen_compiler::modes::Modes;
use whippen_compiler::rate::Rate;
use whippen_isa::Arch;
use whippen_runtime::board;

/// Bytes of sections by the GNU assembler.
fn gnu(
    name: &str,
    core: &str,
    text: &str,
    constants: &BTreeMap<String, i64>,
    sections: &[Section],
) -> Vec<Vec<u8>> {
    let path = |ending: &str| {
        PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("firmware-{name}.{ending}"))
    };
    std::fs::write(path("s"), text).expect("the target directory can be written");
    let mut assembler = Command::new("arm-none-eabi-as");
    assembler
        .arg(format!("-mcpu={core}"))
        .arg("-o")
        .arg(path("o"))
        .arg(path("s"));
    let output = assembler
        .args(
            constants
                .iter()
                .map(|(name, value)| format!("--defsym={name}={value}")),
        )
        .output()
        .expect("the assembler runs");
    assert!(
        output.status.success(),
        "{name}: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    let bytes = |section: &Section| {
        let only = format!("--only-section={}", section.name);
        let copy = ["-O", "binary", only.as_str()];
        let done = Command::new("arm-none-eabi-objcopy")
            .args(copy)
            .arg(path("o"))
            .arg(path("bin"))
            .status();
        assert!(done.expect("objcopy runs").success());
        std::fs::read(path("bin")).expect("objcopy has written")
    };
    sections.iter().map(bytes).collect()
}

/// What the texts are written for besides a few keys of one instrument.
#[derive(Clone, Copy, PartialEq)]
enum Form {
    Plain,
    /// There is sound on two sides.
    Sound,
    /// Records of several instruments are listed, and there is sound on two sides.
    Zones,
    /// As many keys as there may be, with the largest records: what a load cannot reach.
    Far,
    /// The monitor is at the serial port.
    Monitor,
}

/// Every text of a board's firmware; how many bytes were compared.
fn compare(board: &Support, core: &str, setup: &Setup, form: Form) -> usize {
    let kernel = kernel("virtual-spring.whip");
    let rig = Rig::new(&kernel, 0);
    let program = ProgramCode {
        cores: rig.programs[0]
            .cores
            .iter()
            .take(setup.keys.len())
            .cloned()
            .collect(),
        ..rig.programs[0].clone()
    };
    let watched = Setup {
        passivity: Some(Passivity {
            credit: 1 << 24,
            past: 5,
            damping: 300,
        }),
        tuning: (!matches!(form, Form::Plain | Form::Sound)).then(tuning),
        passes_midi: form == Form::Zones,
        ..setup.clone()
    };
    let mut constants = match constants(std::slice::from_ref(&program), &watched, board) {
        // It has no text for this core; the others are compared all the same.
        Err(FirmwareError::PassivityCore) if board.board.arch == Arch::V6M => {
            let tuned = Setup {
                passivity: None,
                ..watched
            };
            constants(&[program], &tuned, board).expect("constants")
        }
        constants => constants.expect("constants"),
    };
    let of_frame = match form {
        Form::Far => Setup {
            keys: vec![255],
            ..setup.clone()
        },
        _ => setup.clone(),
    };
    constants.extend(frame_constants(&of_frame, board, 0));
    constants.insert("ZONES".to_string(), (form == Form::Zones).into());
    if matches!(form, Form::Zones | Form::Sound) {
        constants.insert("SOUND".to_string(), 2);
    }
    if form == Form::Zones {
        constants.insert("PROGRAMS".to_string(), 2);
    }
    if form == Form::Far {
        constants.insert("RECORD".to_string(), 252);
    }
    let mut compared = 0;
    for (index, texts) in sources(board, setup).into_iter().enumerate() {
        let text: String = texts.iter().map(|source| source.text).collect();
        let object =
            assemble(&texts, &constants, board.board.arch).unwrap_or_else(|e| panic!("{e}"));
        let sections: Vec<Section> = object
            .sections
            .into_iter()
            .filter(|s| !s.bytes.is_empty())
            .collect();
        let theirs = gnu(
            &format!("{}-{index}", board.board.name),
            core,
            &text,
            &constants,
            &sections,
        );
        for (section, mut theirs) in sections.iter().zip(theirs) {
            let mut ours = section.bytes.clone();
            // What a linker fills in: the GNU assembler keeps addends there.
            for fixup in &section.fixups {
                let at = fixup.at as usize..fixup.at as usize + 4;
                assert!(
                    fixup.kind == FixupKind::Abs32
                        || fixup.kind == FixupKind::ThumbCall
                        || fixup.kind == FixupKind::ThumbJump24
                );
                ours[at.clone()].fill(0);
                theirs[at].fill(0);
            }
            let differs = ours.iter().zip(&theirs).position(|(a, b)| a != b);
            let told = || {
                texts
                    .iter()
                    .map(|source| source.name)
                    .collect::<Vec<_>>()
                    .join(", ")
            };
            assert_eq!(
                (differs, ours.len()),
                (None, theirs.len()),
                "{} of {}",
                section.name,
                told()
            );
            compared += ours.len();
        }
    }
    compared
}

#[test]
fn the_same_bytes() {
    if !whippen_need::tools(&["arm-none-eabi-as", "arm-none-eabi-objcopy"]) {
        return;
    }
    let one = Setup {
        keys: vec![44],
        ..setup()
    };
    let boards = [
        ("rp2350", "cortex-m33", setup()),
        ("rp2040", "cortex-m0plus", setup()),
        ("stm32f4", "cortex-m4", one),
    ];
    let forms = [Form::Plain, Form::Zones, Form::Far, Form::Monitor];
    for ((board, core, setup), form) in boards
        .iter()
        .flat_map(|board| forms.map(|form| (board, form)))
    {
        let board = board::bundled(board).expect("it is bundled");
        let board = support(&board).unwrap_or_else(|e| panic!("{e}"));
        let setup = Setup {
            fine_velocity: matches!(form, Form::Far),
            monitor: (form == Form::Monitor).then_some(Monitor { baud: 115_200 }),
            ..setup.clone()
        };
        let compared = compare(&board, core, &setup, form);
        assert!(compared > 1200, "{core}: {compared} bytes");
    }
}

#[test]
fn the_same_bytes_of_a_knob() {
    if !whippen_need::tools(&["arm-none-eabi-as", "arm-none-eabi-objcopy"]) {
        return;
    }
    let one = Setup {
        keys: vec![1],
        rate_hz: Rate::new(750_000, 17).expect("a rate"),
        coil: Some(Coil {
            resistance_mohm: 5000,
            kept: 3_834_774_404,
            peak_ma: 1000,
            torque_constant_un_m: 63_000,
        }),
        ..setup()
    };
    let board = board::bundled("pico2_knob").expect("it is bundled");
    let refused = |setup: &Setup| {
        let program = Rig::new(&kernel("virtual-spring.whip"), 0).programs;
        let board = support(&board).unwrap_or_else(|e| panic!("{e}"));
        constants(&program, setup, &board).expect_err("refused")
    };
    assert_eq!(
        [
            refused(&Setup {
                keys: vec![2],
                ..one.clone()
            }),
            refused(&Setup {
                coil: None,
                ..one.clone()
            }),
            refused(&Setup {
                rate_hz: Rate::whole(44_100),
                ..one.clone()
            }),
        ],
        [
            FirmwareError::Knobs(2, 1),
            FirmwareError::NoCoil,
            FirmwareError::Period(3400, Rate::whole(44_100)),
        ]
    );
    let board = support(&board).unwrap_or_else(|e| panic!("{e}"));
    let compared = compare(&board, "cortex-m33", &one, Form::Plain);
    assert!(compared > 1800, "{compared} bytes");
    // Several.
    for (name, knobs) in [("pico2_two_knobs", 2), ("pico2_four_knobs", 4)] {
        let board = board::bundled(name).expect("it is bundled");
        let board = support(&board).unwrap_or_else(|e| panic!("{e}"));
        let all = Setup {
            keys: vec![knobs],
            ..one.clone()
        };
        let more = compare(&board, "cortex-m33", &all, Form::Plain);
        assert!(more > compared + 200, "{more} bytes");
    }
    // With sound, which leaves on three wires.
    let board = board::bundled("pico2_strings").expect("it is bundled");
    let board = support(&board).unwrap_or_else(|e| panic!("{e}"));
    let heard = compare(&board, "cortex-m33", &one, Form::Sound);
    assert!(heard > compared + 200, "{heard} bytes");
}

#[test]
fn the_same_bytes_of_a_bench() {
    if !whippen_need::tools(&["arm-none-eabi-as", "arm-none-eabi-objcopy"]) {
        return;
    }
    let board = board::bundled("rp2350b_bench").expect("it is bundled");
    let board = support(&board).unwrap_or_else(|e| panic!("{e}"));
    let of = |keys: u32| Setup {
        keys: vec![keys],
        rate_hz: Rate::new(750_000, 17).expect("a rate"),
        coil: Some(Coil {
            resistance_mohm: 4000,
            kept: 3_922_000_000,
            peak_ma: 2000,
            torque_constant_un_m: 7000,
        }),
        ..setup()
    };
    let program = Rig::new(&kernel("virtual-spring.whip"), 0).programs;
    let refused = |setup: &Setup| constants(&program, setup, &board).expect_err("refused");
    let others = Setup {
        rate_hz: Rate::whole(44_100),
        ..of(8)
    };
    assert_eq!(
        [refused(&of(9)), refused(&others)],
        [
            FirmwareError::BenchKeys(9, 8),
            FirmwareError::Period(3400, Rate::whole(44_100)),
        ]
    );
    for keys in [1, 5, 8] {
        let compared = compare(&board, "cortex-m33", &of(keys), Form::Plain);
        assert!(compared > 1600, "{compared} bytes");
    }
}

#[test]
fn the_same_bytes_of_columns() {
    if !whippen_need::tools(&["arm-none-eabi-as", "arm-none-eabi-objcopy"]) {
        return;
    }
    let program = Rig::new(&kernel("virtual-spring.whip"), 0).programs;
    let of = |keys: &[u32]| Setup {
        keys: keys.to_vec(),
        rate_hz: Rate::new(750_000, 17).expect("a rate"),
        ..setup()
    };
    let images: [(usize, &[u32]); 5] = [
        (1, &[3]),
        (3, &[16]),
        (7, &[56]),
        (2, &[8, 1]),
        (7, &[24, 32]),
    ];
    for (columns, keys) in images {
        for pulls_down in [false, true] {
            let cores = keys.len();
            let mut board = crate::key_columns::board_of(columns, cores);
            board.columns.as_mut().expect("columns").pulls_down = pulls_down;
            let board = support(&board).unwrap_or_else(|e| panic!("{e}"));
            let most = 8 * columns as u32;
            let refused = |keys: &[u32]| constants(&program, &of(keys), &board);
            let too_many = [vec![most + 1], vec![8, most - 7]];
            assert_eq!(
                refused(&too_many[cores - 1]).expect_err("refused"),
                FirmwareError::ColumnsKeys(most + 1, most)
            );
            if cores > 1 {
                let split = refused(&[7, 1]).expect_err("refused");
                assert_eq!(split, FirmwareError::ColumnsDivided(7));
            }
            let compared = compare(&board, "cortex-m33", &of(keys), Form::Plain);
            assert!(compared > 1600, "{compared} bytes");
        }
    }
}

/// Names that the tests of mistakes would not find: a board's text is reported as it was named.
#[test]
fn a_board_s_mistake_is_told_with_its_line() {
    let rest = Source {
        name: "mine.s",
        text: "board_feed:\n  addd r0, r1\n",
    };
    let kernel = kernel("virtual-spring.whip");
    let rig = Rig::new(&kernel, 0);
    let of_board = board::bundled("rp2350").expect("it is bundled");
    let board = Support {
        rest: &[rest],
        ..support(&of_board).unwrap_or_else(|e| panic!("{e}"))
    };
    let (modes, notes) = (Modes::single(&kernel), midi(&kernel));
    let instrument = Instrument {
        modes: &modes,
        places: &[],
        midi: &notes,
        parts: None,
    };
    let refused = objects(&rig.programs, &[instrument], &setup(), &board);
    assert_eq!(
        refused.expect_err("refused").to_string(),
        "mine.s:2: `addd` is no instruction"
    );
}
