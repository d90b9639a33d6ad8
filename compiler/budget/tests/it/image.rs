//! Small images: Kernels in text, the RP2350, and the bounds of what is built of them.

#[path = "../made/chip.rs"]
mod chip;

use whippen_board::{Board, Bus, Placement};
use whippen_budget::{Bounded, Program, cores};
use whippen_firmware::{
    FirmwareImage, GuardedDrive, GuardedPort, InParts, Instrument, Midi, Motor, OwnTexts, Setup,
    Velocities, build_divided,
};
use whippen_keyboard::{InstrumentId, Layout, Program as Zones, ProgramId};
use whippen_modes::{INSTRUCTIONS, Modes, specialize};
use whippen_parts::{Beside, split_together};
use whippen_rate::Rate;

/// A key that is on or off, and pushes where it is on: two modes.
const SWITCH: &str = "kernel switch @44100 {
  in x: u16 [0..65535]
  out f: i16 [-32768..32767]
  event note(1)
  cell on: i1 [0..1] = 0
  tick {
    v0: i1 [0..1] = get on
    v1: i32 [0..65535] = in x
    v2: i32 [40000..40000] = const 40000
    v3: i1 [0..1] = lt v2 v1
    v4: i32 [20000..20000] = const 20000
    v5: i1 [0..1] = lt v4 v1
    v6: i1 [0..1] = and v0 v5
    v7: i1 [0..1] = or v3 v6
    set on v7
    v8: i32 [0..32767] = sar v1 1
    v9: i32 [0..0] = const 0
    v10: i32 [0..32767] = select v0 v8 v9
    out f v10
    if v3 {
      emit note v1
    }
  }
}
";

/// A key that pushes by its way: one mode.
const SPRING: &str = "kernel spring @44100 {
  in x: u16 [0..65535]
  out f: i16 [-32768..32767]
  event note(1)
  tick {
    v0: i32 [0..65535] = in x
    v1: i32 [0..32767] = sar v0 1
    out f v1
  }
}
";

/// A key that pushes by where it was: its line is emptied where it begins later than the start.
const ECHO: &str = "kernel echo @44100 {
  in x: u16 [0..65535]
  out f: i16 [-32768..32767]
  event note(1)
  line was: 200 [0..65535]
  tick {
    v0: i32 [0..65535] = in x
    v1: i32 [0..65535] = delay was 200
    push was v0
    v2: i32 [0..32767] = sar v1 1
    out f v2
  }
}
";

/// The RP2350 with a converter of the emulator's.
pub fn rp2350() -> Board {
    let places = [
        (".vectors", "flash"),
        (".image_def", "flash"),
        (".copy_table", "flash"),
        (".zero_table", "flash"),
        (".text.start*", "flash"),
        (".", "sram0"),
        (".core1", "sram4"),
        (".near", "sram8"),
        (".near.core1", "sram9"),
    ];
    let placed = |(pattern, memory): (&str, &str)| {
        let kinds: &[&str] = match memory {
            "flash" => &[""],
            _ => &[".text", ".rodata", ".data", ".bss"],
        };
        let own = pattern.trim_end_matches('.');
        let of_kind = |kind: &&str| Placement {
            pattern: match *kind {
                "" => pattern.to_string(),
                kind => format!("{kind}{own}*"),
            },
            memory: memory.to_string(),
        };
        kinds.iter().map(of_kind).collect::<Vec<_>>()
    };
    let devices = [
        ("converter", 0x4017_0000),
        ("uart", 0x4007_0000),
        ("io_bank0", 0x4002_8000),
        ("watchdog", 0x400d_8000),
    ];
    let mut board = chip::board();
    board.buses.push(Bus {
        name: "sio".into(),
        base: 0xd000_0000,
        size: 256 << 10,
        read_cycles: 1,
        write_cycles: 1,
    });
    board.devices = devices.map(|(name, at)| (name.to_string(), at)).to_vec();
    board.places = places.into_iter().flat_map(placed).collect();
    board
}

/// The same with three columns of keys, on one core, and a DMA that moves their words.
pub fn columns() -> Board {
    let mut board = rp2350();
    board.cores = 1;
    board.stacks.truncate(1);
    board.columns = Some(chip::columns(3));
    board.buses.insert(
        1,
        Bus {
            name: "fast".into(),
            base: 0x5000_0000,
            size: 256 << 20,
            read_cycles: 2,
            write_cycles: 2,
        },
    );
    let devices = [
        ("uart", 0x4007_0000),
        ("io_bank0", 0x4002_8000),
        ("pads_bank0", 0x4003_8000),
        ("pwm", 0x400a_8000),
        ("dma", 0x5000_0000),
        ("pio0", 0x5020_0000),
        ("pio1", 0x5030_0000),
        ("pio2", 0x5040_0000),
        ("busctrl", 0x4006_8000),
        ("watchdog", 0x400d_8000),
    ];
    board.devices = devices.map(|(name, at)| (name.to_string(), at)).to_vec();
    board.converter_interrupt = 8;
    let rings = [".data.ring", ".bss.ring"].map(|pattern| Placement {
        pattern: pattern.into(),
        memory: "sram4".into(),
    });
    board.places.extend(rings);
    board
}

/// Zones of a program: keys, and the number of what they play.
pub type Row<'a> = &'a [(u32, u32)];

/// An image with its bounds while each of its programs plays.
#[derive(Clone)]
pub struct Played {
    pub image: FirmwareImage,
    pub program: Program,
    pub board: Board,
    pub bounds: Vec<Vec<Bounded>>,
}

/// Ticks a second: the board's own, where it has one.
pub fn rate_of(board: &Board) -> Rate {
    let own = board.columns.as_ref();
    let own = own.and_then(|own| Rate::new(board.clock_hz, own.period_cycles));
    own.unwrap_or(Rate::whole(44_100))
}

impl Played {
    /// Of programs of switches (0), springs (1) and echoes (2), for cores with so many keys.
    pub fn new(programs: &[Row], keys: &[u32]) -> Played {
        Played::on(rp2350(), programs, keys)
    }

    pub fn on(board: Board, programs: &[Row], keys: &[u32]) -> Played {
        let modes = [SWITCH, SPRING, ECHO].map(|text| {
            let kernel = whippen_kernel::parse(text).unwrap_or_else(|why| panic!("{why:?}"));
            specialize(&kernel, INSTRUCTIONS)
        });
        let image = image_of(
            &modes.each_ref().map(|own| (own, None)),
            programs,
            keys,
            &board,
        );
        Played::of(image, board)
    }

    /// An instrument of two members in parts, played once, with what another core does beside them.
    pub fn in_parts(text: &str, beside: Beside) -> Played {
        let whole = whippen_kernel::parse(text).unwrap_or_else(|why| panic!("{why:?}"));
        let parts = split_together(&whole, &[0, 1], beside).expect("its members are worth it");
        let modes = parts.parts.iter();
        let modes = modes.map(|part| specialize(&part.kernel, INSTRUCTIONS));
        let in_parts = InParts {
            instructions: INSTRUCTIONS,
            modes: modes.collect(),
            parts,
            whole: whole.clone(),
        };
        let modes = specialize(&whole, INSTRUCTIONS);
        let board = rp2350();
        let image = image_of(&[(&modes, Some(&in_parts))], &[&[(1, 0)]], &[1], &board);
        Played::of(image, board)
    }

    fn of(image: FirmwareImage, board: Board) -> Played {
        let program = Program::of(&image.image);
        let playing = (0..image.programs.len()).map(|playing| ProgramId(playing as u32));
        let bounds = playing
            .map(|playing| cores(&image, &program, &board, playing))
            .collect::<Result<_, _>>()
            .unwrap_or_else(|why| panic!("{why}"));
        Played {
            image,
            program,
            board,
            bounds,
        }
    }
}

fn image_of(
    instruments: &[(&Modes, Option<&InParts>)],
    programs: &[Row],
    keys: &[u32],
    board: &Board,
) -> FirmwareImage {
    let midi = Midi {
        note: Some(0),
        release: None,
        velocities: Velocities {
            speed_shift: 8,
            table: std::array::from_fn(|at| 100 * at as u16),
        },
        release_velocities: None,
    };
    let instruments = instruments.iter().map(|(modes, parts)| Instrument {
        modes,
        places: &[],
        midi: &midi,
        parts: *parts,
    });
    let instruments: Vec<Instrument> = instruments.collect();
    let motor = Motor {
        rated: 8192,
        peak_ms: 100,
        newton: 1024,
    };
    // The first port alone is driven.
    let port = |word| GuardedPort {
        mid_travel: [10_000, 50_000],
        rails: [true; 2],
        update_ticks: 1,
        drive: (word == 0).then_some(GuardedDrive { word, motor }),
    };
    let ports = instruments[0].modes.kernel.inputs.len() as u32;
    let setup = Setup {
        keys: keys.to_vec(),
        rate_hz: rate_of(board),
        ports: (0..ports).map(port).collect(),
        first_note: 21,
        coil: None,
        passivity: None,
        tuning: None,
        fine_velocity: false,
        passes_midi: false,
        monitor: None,
        own_texts: OwnTexts::default(),
    };
    let row = |row: &Row| {
        let zones = row.iter().map(|&(keys, plays)| (keys, InstrumentId(plays)));
        Zones::of_zones("zones", zones)
    };
    let layout = Layout {
        first_note: 21,
        keys: keys.iter().sum(),
        programs: programs.iter().map(row).collect::<Vec<_>>().into(),
    };
    let in_parts = instruments.iter().find_map(|instrument| instrument.parts);
    let on_cores = in_parts.map(|parts| parts.on_own_cores(board.stacks.len()));
    let on_cores = on_cores.unwrap_or_default();
    build_divided(&layout, &instruments, &setup, board, &on_cores)
        .unwrap_or_else(|why| panic!("{why}"))
}

/// A Kernel of two members, each of twelve quotients of words of its own; where something is
/// `early`, both begin with what four others make, to which no sensor leads; of what is heard there
/// are so many quotients.
pub fn members(early: bool, heard: usize) -> String {
    let mut cells = String::new();
    let mut tick = String::from("    v0: i32 [0..65535] = in x\n");
    let mut value = 1;
    let mut line = |text: String| {
        tick += &format!("    v{value}: i32 {text}\n");
        value += 1;
        value - 1
    };
    let mut ends = Vec::new();
    let mut sets = Vec::new();
    let mut shared = None;
    let chains = [("e", 4), ("0", 12), ("1", 12)];
    for (chain, quotients) in chains.into_iter().skip(usize::from(!early)) {
        cells += &format!("  cell a{chain}: i32 [0..49152] = 0\n");
        cells += &format!("  cell b{chain}: i32 [40000..60000] = 40000\n");
        let own = line(format!("[0..49152] = get a{chain}"));
        let by = line(format!("[40000..60000] = get b{chain}"));
        let mut last = own;
        if let Some(shared) = shared {
            let both = line(format!("[0..89417] = add v{own} v{shared}"));
            last = line(format!("[0..44708] = sar v{both} 1"));
        }
        for _ in 0..quotients {
            let quotient = line(format!("[0..80531] = div_round v{last} v{by} 16"));
            last = line(format!("[0..40265] = sar v{quotient} 1"));
        }
        sets.push(format!("    set a{chain} v{last}\n"));
        match chain {
            "e" => shared = Some(last),
            _ => ends.push(last),
        }
    }
    if heard > 0 {
        cells += "  cell sum.emit: i32 [0..16] = 0\n";
        let by = line("[65535..65535] = const 65535".into());
        let mut last = line(format!("[0..40265] = min v{} v{}", ends[0], ends[1]));
        for _ in 0..heard {
            let quotient = line(format!("[0..40266] = div_round v{last} v{by} 16"));
            last = line(format!("[0..40265] = min v{quotient} v{last}"));
        }
        let less = line(format!("[0..9] = sar v{last} 12"));
        sets.push(format!("    set sum.emit v{less}\n"));
    }
    let half = line("[0..32767] = sar v0 1".into());
    let less = ends
        .iter()
        .map(|end| line(format!("[0..2516] = sar v{end} 4")));
    let less: Vec<i32> = less.collect();
    let both = line(format!("[0..5032] = add v{} v{}", less[0], less[1]));
    let out = line(format!("[-5032..32767] = sub v{half} v{both}"));
    tick += &sets.concat();
    format!(
        "kernel members @44100 {{\n  in x: u16 [0..65535]\n  in y: u16 [0..65535]\n  \
         out f: i16 [-32768..32767]\n  event note(1)\n{cells}  tick {{\n{tick}    out f v{out}\n  }}\n}}\n"
    )
}
