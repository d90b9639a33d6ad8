//! Whole images of small Kernels: no frame of the emulated board takes longer than its bound, and
//! an independent checker comes to the same sums.

use whippen_arm::image::executable;
use whippen_audit::{Elf, audit};
use whippen_board::{AccessTime, Board, Bus, Memory, MemoryKind, Placement, Start};
use whippen_budget::{Bounded, Extent, NotBounded, Program, certificate, cores};
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
#[derive(Clone)]
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

/// A program that has a bound.
fn played() -> Played {
    Played::new(&[&[(5, 0)]], &[3, 2])
}

impl Played {
    /// Of what has been changed.
    fn bounded(&self) -> Result<Vec<Bounded>, NotBounded> {
        cores(&self.image, &self.program, &self.board, ProgramId(0))
    }

    /// With another word at an address of the image.
    fn with_word(&self, at: u32, word: u32) -> Result<Vec<Bounded>, NotBounded> {
        let mut changed = self.clone();
        let mut sections = changed.image.image.sections.iter_mut();
        let holds = |run: u32, bytes: &[u8]| (run..run + bytes.len() as u32).contains(&at);
        let section = sections.find(|own| holds(own.run, &own.bytes));
        let section = section.expect("it is in the image");
        let from = (at - section.run) as usize;
        section.bytes[from..from + 4].copy_from_slice(&word.to_le_bytes());
        changed.program = Program::of(&changed.image.image);
        changed.bounded()
    }
}

/// All vectors but the first two lead to the handler, to the end, or nowhere; so in both tables.
#[test]
fn another_interrupt_has_no_bound() {
    let played = played();
    let symbol = |name: &str| played.program.symbols[name];
    let other = symbol("midi_step");
    for table in ["vectors0", "vectors1"] {
        let last = played.program.words_of(symbol(table)).last();
        for at in [
            symbol(table) + 8,
            symbol(table) + 4 * (16 + 3),
            last.expect("a word"),
        ] {
            let refused = played.with_word(at, other | 1).expect_err("no bound");
            assert_eq!(refused, NotBounded::Interrupts { address: other });
            assert!(played.with_word(at, 0).is_ok(), "{at:#x} leads nowhere");
            assert!(played.with_word(at, symbol("dead") | 1).is_ok());
        }
        assert!(
            played.with_word(symbol(table) + 4, other | 1).is_ok(),
            "its start"
        );
    }
}

#[test]
fn an_image_without_a_firmware_has_no_bound() {
    for name in [
        "idle0",
        "tick_core1",
        "vectors0",
        "dead",
        "core0_tick",
        "core1.end",
    ] {
        let mut played = played();
        played.program.symbols.remove(name);
        let refused = played.bounded().expect_err("no bound");
        assert_eq!(refused, NotBounded::NoSymbol { name: name.into() });
        assert_eq!(
            refused.to_string(),
            format!("there is no `{name}` in the code")
        );
    }
}

/// Below a stack lies a section, another stack or the end of the memory: as far as it reaches there
/// is room, and not a byte less.
#[test]
fn a_stack_has_the_room_that_it_needs() {
    let played = played();
    for core in [0, 1] {
        let needed = played.bounds[0][core].alone.stack_bytes_max;
        let end = played.board.stacks[core];
        let below = |room: u32, change: &dyn Fn(&mut Played, u32)| {
            let mut changed = played.clone();
            change(&mut changed, end - room);
            changed.bounded().map(|_| ())
        };
        let of = |room: u32| Err(NotBounded::StackRoom { needed, room, end });
        let section = |played: &mut Played, top: u32| {
            played.program.sections.push(Extent {
                name: ".bss.below".into(),
                base: top - 4,
                size: 4,
            });
        };
        let stack = |played: &mut Played, top: u32| played.board.stacks.push(top);
        let memory = |played: &mut Played, top: u32| {
            let memories = &mut played.board.memory;
            let own = memories.iter().position(|memory| memory.contains(end - 4));
            let own = own.expect("its memory");
            let mut upper = memories[own].clone();
            (upper.base, upper.size) = (top, end - top);
            memories[own].size -= upper.size;
            memories.insert(own + 1, upper);
        };
        let changes: [&dyn Fn(&mut Played, u32); 3] = [&section, &stack, &memory];
        for change in changes {
            assert_eq!(below(needed, change), Ok(()));
            assert_eq!(below(needed - 4, change), of(needed - 4));
        }
        // A section that begins below and ends above.
        let over = |played: &mut Played, top: u32| {
            section(played, top);
            played.program.sections.last_mut().expect("it").size = 0x100;
        };
        assert_eq!(below(needed, &over), of(0));
    }
}

/// Code in a section that counts as the other core's, or the start's: of the handler, and of what
/// is between ticks.
#[test]
fn code_of_another_core_has_no_bound() {
    let played = played();
    for (symbol, core) in [
        ("tick_core0", 0),
        ("idle0", 0),
        ("tick_core1", 1),
        ("idle1", 1),
    ] {
        let address = played.program.symbols[symbol];
        for name in [[".text.core1.x", ".text.core0.x"][core], ".text.start.x"] {
            let mut changed = played.clone();
            let own = changed.program.sections.iter_mut();
            let mut own = own.filter(|section| section.contains(address));
            let section = own.next().expect("its section");
            section.name = name.into();
            let section = section.clone();
            let Err(NotBounded::Elsewhere {
                address,
                section: told,
                core: of,
            }) = changed.bounded()
            else {
                panic!("{symbol} in {name} is not refused so");
            };
            assert!(section.contains(address) && told == name && of == core);
        }
    }
}
