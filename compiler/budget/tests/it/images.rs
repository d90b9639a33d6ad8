//! Whole images of small Kernels: no frame of the emulated board takes longer than its bound, and
//! an independent checker comes to the same sums.

use whippen_arm::image::executable;
use whippen_audit::{Elf, audit};
use whippen_board::{AccessTime, Board, Bus, Memory, MemoryKind, Placement, Start};
use whippen_budget::{Bounded, Program, certificate, cores};
use whippen_firmware::{
    FirmwareImage, GuardedDrive, GuardedPort, Instrument, Midi, Motor, OwnTexts, Setup, Velocities,
    build_image,
};
use whippen_isa::Arch;
use whippen_keyboard::{InstrumentId, Layout, Program as Zones, ProgramId};
use whippen_modes::{INSTRUCTIONS, Modes, specialize};
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

/// The RP2350, as the emulator has it.
pub fn rp2350() -> Board {
    let memory = |name: &str, base, size, banks: &[u8]| Memory {
        name: name.into(),
        base,
        size,
        kind: MemoryKind::Ram,
        access: AccessTime::Cycles(1),
        fetch: AccessTime::Cycles(1),
        striped: banks.len() > 1,
        banks: banks.to_vec(),
    };
    let flash = Memory {
        kind: MemoryKind::Flash,
        access: AccessTime::NotBounded,
        fetch: AccessTime::NotBounded,
        ..memory("flash", 0x1000_0000, 4 << 20, &[])
    };
    let bus = |name: &str, base, size, [read_cycles, write_cycles]: [u16; 2]| Bus {
        name: name.into(),
        base,
        size,
        read_cycles,
        write_cycles,
    };
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
    Board {
        name: "rp2350".into(),
        arch: Arch::V8M,
        cores: 2,
        clock_hz: 150_000_000,
        start: Start::ImageDef,
        uf2_family: None,
        fetches_apart: true,
        banks: (0..10).map(|bank| format!("SRAM{bank}")).collect(),
        memory: vec![
            flash,
            memory("sram0", 0x2000_0000, 256 << 10, &[0, 1, 2, 3]),
            memory("sram4", 0x2004_0000, 256 << 10, &[4, 5, 6, 7]),
            memory("sram8", 0x2008_0000, 4 << 10, &[8]),
            memory("sram9", 0x2008_1000, 4 << 10, &[9]),
        ],
        buses: vec![
            bus("apb", 0x4000_0000, 256 << 20, [3, 4]),
            bus("sio", 0xd000_0000, 256 << 10, [1, 1]),
        ],
        devices: devices.map(|(name, at)| (name.to_string(), at)).to_vec(),
        converter_interrupt: 46,
        stacks: vec![0x2008_1000, 0x2008_2000],
        places: places.into_iter().flat_map(placed).collect(),
        knob: None,
        bench: None,
        columns: None,
        i2s: None,
    }
}

/// Zones of a program: keys, and the number of what they play.
type Row<'a> = &'a [(u32, u32)];

/// An image with its bounds while each of its programs plays.
struct Played {
    image: FirmwareImage,
    program: Program,
    board: Board,
    bounds: Vec<Vec<Bounded>>,
}

const RATE: Rate = Rate::whole(44_100);

impl Played {
    /// Of programs of switches (0) and springs (1), for cores with so many keys.
    fn new(programs: &[Row], keys: &[u32]) -> Played {
        let modes = [SWITCH, SPRING].map(|text| {
            let kernel = whippen_kernel::parse(text).unwrap_or_else(|why| panic!("{why:?}"));
            specialize(&kernel, INSTRUCTIONS)
        });
        let board = rp2350();
        let image = image_of(&modes, programs, keys, &board);
        let program = Program::of(&image.image);
        let playing = (0..programs.len()).map(|playing| ProgramId(playing as u32));
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

fn image_of(modes: &[Modes; 2], programs: &[Row], keys: &[u32], board: &Board) -> FirmwareImage {
    let midi = Midi {
        note: Some(0),
        release: None,
        velocities: Velocities {
            speed_shift: 8,
            table: std::array::from_fn(|at| 100 * at as u16),
        },
        release_velocities: None,
    };
    let instruments = modes.each_ref().map(|modes| Instrument {
        modes,
        places: &[],
        midi: &midi,
        parts: None,
    });
    let motor = Motor {
        rated: 8192,
        peak_ms: 100,
        newton: 1024,
    };
    let setup = Setup {
        keys: keys.to_vec(),
        rate_hz: RATE,
        ports: vec![GuardedPort {
            mid_travel: [10_000, 50_000],
            rails: [true; 2],
            update_ticks: 1,
            drive: Some(GuardedDrive { word: 0, motor }),
        }],
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
    build_image(&layout, &instruments, &setup, board).unwrap_or_else(|why| panic!("{why}"))
}

impl Played {
    /// An independent checker comes to the same cycles of every frame. Where a core has a row of
    /// zones, it plays all keys also while one begins.
    fn is_audited(&self) {
        let file = executable(&self.image.image, &[], None);
        let deadline = RATE.cycles_min(self.board.clock_hz);
        let certificate = certificate(&self.image, &self.program, &self.board, deadline, "", &file);
        let certificate = certificate.unwrap_or_else(|why| panic!("{why}"));
        let mut elf = Elf::read(&file).expect("an ELF file");
        elf.kernels = Some(String::new());
        let checked = audit(&elf, &certificate).unwrap_or_else(|why| panic!("{why}"));
        assert_eq!(checked.len(), 2 * self.bounds.len());
        for checked in &checked {
            let bound = &self.bounds[checked.program as usize][checked.core as usize].contended;
            let more = checked.cycles.checked_sub(bound.cycles_max);
            let more = more.expect("the checker is no less careful");
            let keys = if bound.zones.len() == 1 { 0 } else { 2 };
            assert!(more <= keys * bound.key_cycles_max(), "{more}");
            assert_eq!(checked.keys, bound.keys);
            assert_eq!(checked.key, bound.key_cycles_max());
            assert_eq!(checked.stack, bound.stack_bytes_max);
            assert_eq!(checked.class, bound.class);
        }
    }

    /// What is told of a frame.
    fn told(&self) -> String {
        let mut told = String::new();
        for (program, cores) in self.bounds.iter().enumerate() {
            for (core, bounds) in cores.iter().enumerate() {
                let (alone, contended) = (&bounds.alone, &bounds.contended);
                told += &format!(
                    "program {program}, core {core}: {} cycles alone, {} at most, \
                     around keys {} and {}, a key {} and {}\n",
                    alone.cycles_max,
                    contended.cycles_max,
                    alone.around_cycles_max(),
                    contended.around_cycles_max(),
                    alone.key_cycles_max(),
                    contended.key_cycles_max(),
                );
                let parts = alone.parts.iter().zip(&contended.parts);
                for ((name, alone), (same, contended)) in parts {
                    assert_eq!(name, same);
                    told += &format!("  {alone:4} {contended:4}  {name}\n");
                }
                for waited in bounds.waiting() {
                    let for_whom = format!("{} {}", waited.cause, waited.data);
                    told += &format!("       {:4}  {}\n", waited.cycles, for_whom.trim_end());
                }
            }
        }
        told
    }
}

#[test]
fn a_program_has_a_bound_that_a_checker_comes_to() {
    Played::new(&[&[(5, 0)]], &[3, 2]).is_audited();
}

#[test]
fn a_program_that_begins_has_a_bound_that_a_checker_comes_to() {
    let played = Played::new(&[&[(9, 0)], &[(9, 1)]], &[5, 4]);
    played.is_audited();
    insta::assert_snapshot!(played.told());
}

#[test]
fn zones_have_a_bound_that_a_checker_comes_to() {
    Played::new(&[&[(2, 0), (5, 1), (2, 0)], &[(9, 1)]], &[6, 3]).is_audited();
}
