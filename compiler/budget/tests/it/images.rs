//! Whole images of small Kernels: an independent checker comes to the same cycles of every frame,
//! and what makes a frame impossible is told.

use whippen_arm::image::executable;
use whippen_audit::{Elf, audit};
use whippen_board::{AccessTime, Board, ColumnWires};
use whippen_budget::{
    Bounded, Budget, Extent, NotBounded, Program, Unknown, calling_tick_without_waiting,
    certificate, cores, tick_without_waiting,
};
use whippen_firmware::{LOOKS, TIMED};
use whippen_keyboard::ProgramId;
use whippen_parts::{Beside, EARLY_CYCLES_MIN};
use whippen_rate::Rate;

use super::image::{Played, Row, columns, members, rate_of, rp2350};

impl Played {
    /// An independent checker comes to the same cycles of every frame, or to so many less where it
    /// knows of more accesses where they go. Where a core has a row of zones, it plays all keys
    /// also while one begins.
    pub fn is_audited(&self, less: u64) {
        let file = executable(&self.image.image, &[], None);
        let deadline = rate_of(&self.board).cycles_min(self.board.clock_hz);
        let certificate = certificate(&self.image, &self.program, &self.board, deadline, "", &file);
        let certificate = certificate.unwrap_or_else(|why| panic!("{why}"));
        let mut elf = Elf::read(&file).expect("an ELF file");
        elf.kernels = Some(String::new());
        let checked = audit(&elf, &certificate).unwrap_or_else(|why| panic!("{why}"));
        assert_eq!(checked.len(), self.bounds.iter().flatten().count());
        for checked in &checked {
            let bound = &self.bounds[checked.program as usize][checked.core as usize].contended;
            let more = (checked.cycles + less).checked_sub(bound.cycles_max);
            let more = more.unwrap_or_else(|| panic!("{} less", bound.cycles_max - checked.cycles));
            let begins = bound.zones.len() > 1 && self.bounds.len() > 1;
            let keys = if begins { 2 } else { 0 };
            assert!(more <= less + keys * bound.key_cycles_max(), "{more}");
            // The checker takes a part for a key.
            if bound.cut.is_none() {
                assert_eq!(checked.keys, bound.keys);
                assert_eq!(checked.key, bound.key_cycles_max());
            }
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
                for sending in [&alone.sending, &contended.sending].into_iter().flatten() {
                    let (late, until) = (sending.cycles_max, sending.until_cycles);
                    told += &format!("       {late:4}  until it sends, {until} at most\n");
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
    Played::new(&[&[(5, 0)]], &[3, 2]).is_audited(0);
}

#[test]
fn a_program_that_begins_has_a_bound_that_a_checker_comes_to() {
    let played = Played::new(&[&[(9, 0)], &[(9, 1)]], &[5, 4]);
    played.is_audited(0);
    insta::assert_snapshot!(played.told());
}

#[test]
fn zones_have_a_bound_that_a_checker_comes_to() {
    let row: Row = &[(2, 0), (5, 1), (2, 0)];
    Played::new(&[row, &[(9, 1)]], &[6, 3]).is_audited(0);
    Played::new(&[row], &[6, 3]).is_audited(0);
}

/// All keys play on the longest way of a frame, or none: that on which lines are emptied takes
/// longer than one key.
#[test]
fn a_frame_takes_what_its_handler_takes_and_what_is_around_it() {
    let switches = Played::new(&[&[(2, 0)], &[(2, 1)]], &[1, 1]);
    let echoes = Played::new(&[&[(2, 2)], &[(2, 1)]], &[1, 1]);
    for (played, plays) in [(switches, true), (echoes, false)] {
        let ticks = ["core0_tick", "core1_tick"].map(|name| played.program.symbols[name]);
        for (bounds, tick) in played.bounds[0].iter().zip(ticks) {
            let (bound, handler) = (&bounds.contended, &bounds.contended.handler);
            let mut path = handler.path.iter();
            assert_eq!(path.any(|step| step.address == tick), plays);
            let around = AROUND.map(|part| cycles_of(bounds, part).unwrap_or(0));
            let around: u64 = around.iter().sum();
            assert_eq!(bound.cycles_max, handler.cycles_max + around);
        }
    }
}

/// What is no part of the handler.
const AROUND: [&str; 4] = [
    "the instruction in progress",
    "entry of the interrupt",
    "return from the interrupt",
    VISITS,
];

/// Members on both cores, which wait for each other.
#[test]
fn parts_have_a_bound_that_a_checker_comes_to() {
    let played = Played::in_parts(&members(false, 0), Beside::default());
    let cut = played.image.cut().expect("it is in parts");
    assert!(cut.has_helper() && !cut.has_early());
    played.is_audited(0);
    insta::assert_snapshot!(played.told());
}

/// Core 1 does what both members need while core 0 begins.
#[test]
fn what_is_early_has_a_bound_that_a_checker_comes_to() {
    let beside = Beside {
        early_cycles_min: Some(EARLY_CYCLES_MIN),
        ..Beside::default()
    };
    let played = Played::in_parts(&members(true, 0), beside);
    assert!(played.image.cut().expect("it is in parts").has_early());
    played.is_audited(0);
    insta::assert_snapshot!(played.told());
}

/// What is left of a period, and for how many more keys, is that of the bounds with both cores at
/// work.
#[test]
fn a_budget_is_of_its_bounds() {
    let played = Played::new(&[&[(10, 0)]], &[6, 4]);
    let bounds = &played.bounds[0];
    let budget = Budget::of(bounds, &played.board, Rate::whole(50_000));
    assert_eq!((budget.period_cycles, budget.clock_hz), (3000, 150_000_000));
    let keys = |of: &dyn Fn(&Bounded) -> u64| bounds.iter().map(of).max().expect("cores");
    let alone = keys(&|core| core.alone.key_cycles_max());
    let contended = keys(&|core| core.contended.key_cycles_max());
    assert_eq!(
        (budget.key_cycles_max, budget.contended_key_cycles_max),
        (alone, contended)
    );
    assert_eq!(budget.cores.len(), 2);
    for ((own, bound), keys) in budget.cores.iter().zip(bounds).zip([6, 4]) {
        let (cycles, key) = (bound.contended.cycles_max, bound.contended.key_cycles_max());
        assert_eq!((own.keys, own.cycles_max), (keys, cycles));
        assert_eq!(own.slack_cycles, 3000 - cycles as i64);
        let more = u64::from(own.more_keys);
        assert!(cycles + more * key <= 3000 && cycles + (more + 1) * key > 3000);
        assert!(more > 0);
    }
}

/// Columns of keys, with a DMA.
#[test]
fn columns_have_a_bound_that_a_checker_comes_to() {
    let played = Played::on(columns(), &[&[(20, 0)]], &[20]);
    played.is_audited(1);
    insta::assert_snapshot!(played.told());
}

/// More columns, whose words come later than a tick of these looks for them.
#[test]
fn words_are_not_looked_for_before_they_lie_there() {
    let mut played = Played::on(columns(), &[&[(20, 0)]], &[20]);
    let more = ColumnWires {
        to_dac: 12,
        from_adc: 13,
    };
    let mut refused = Vec::new();
    for _ in 0..40 {
        let of_board = |board: &mut Board| {
            let columns = board.columns.as_mut().expect("it has columns");
            columns.columns.push(more);
            u64::from(columns.words_cycles())
        };
        let words = of_board(&mut played.board);
        match played.bounded() {
            Ok(_) => assert!(refused.is_empty()),
            Err(NotBounded::LooksEarly {
                cycles_min,
                words_cycles,
            }) => {
                assert!(cycles_min < words_cycles && words_cycles == words);
                refused.push(cycles_min);
            }
            Err(other) => panic!("{other}"),
        }
    }
    assert!(refused.len() > 1 && refused.len() < 40, "{refused:?}");
    refused.dedup();
    assert_eq!(refused.len(), 1);
}

/// Where it reads how late it is, and where it looks for words, is on its way.
#[test]
fn what_is_never_come_to_is_not_in_time() {
    let played = Played::on(columns(), &[&[(20, 0)]], &[20]);
    for name in [TIMED, LOOKS] {
        let mut elsewhere = played.clone();
        let idle = elsewhere.program.symbols["idle0"];
        elsewhere.program.symbols.insert(name.into(), idle);
        let refused = elsewhere.bounded().map(|_| ());
        assert_eq!(refused, Err(NotBounded::NoSymbol { name: name.into() }));
    }
}

fn cycles_of(bounds: &Bounded, part: &str) -> Option<u64> {
    let mut parts = bounds.contended.parts.iter();
    parts
        .find(|(own, _)| own == part)
        .map(|(_, cycles)| *cycles)
}

/// Where the start lets no core go before the DMA, each of its accesses holds up a load and a fetch
/// at once; so it does before a core has read whether it is too late to send.
#[test]
fn a_dma_at_memory_may_come_first() {
    let mut played = Played::on(columns(), &[&[(20, 0)]], &[20]);
    let traffic = played.board.dma_traffic().expect("it has a DMA");
    let more = 2 * u64::from(traffic.in_memory);
    assert!(more > 0);
    let first = played.bounds[0][0].clone();
    assert_eq!(cycles_of(&first, "the DMA at memory"), None);
    played.image.yields_dma = false;
    // It is late then, by the words of columns alone.
    let refused = played.bounded().expect_err("no bound");
    let sending = first.contended.sending.expect("it sends");
    let (cycles_max, until_cycles) = (sending.cycles_max + more, sending.until_cycles);
    let late = NotBounded::SendsLate {
        cycles_max,
        until_cycles,
    };
    assert_eq!(refused, late);
}

/// Keys by themselves, and a function around them, as in a relocatable file: what they cost with
/// nobody else at the bus.
#[test]
fn keys_without_waiting_cost_what_they_cost_alone() {
    let played = played();
    let (alone, core) = (&played.bounds[0][0].alone, played.board.timing());
    let tick = tick_without_waiting(&played.program, "core0", &core).expect("a bound");
    assert_eq!(tick.key_cycles_max(), alone.key_cycles_max());
    assert_eq!(tick.modes.len(), alone.zones[0].tick.modes.len());
    let around = |keys| {
        let ticked = ("core0", &tick, keys);
        calling_tick_without_waiting(&played.program, "tick_core0", ticked, &core)
            .expect("a bound")
            .cycles_max
    };
    assert_eq!(around(5) - around(3), 2 * tick.key_cycles_max());
    assert!(around(3) > tick.cycles_max(3));
}

/// A word that the other core looks up takes as long as memory does.
#[test]
fn visits_take_what_an_access_takes() {
    let mut played = played();
    let visits = |bounds: &[Bounded]| [0, 1].map(|core| cycles_of(&bounds[core], VISITS));
    assert_eq!(visits(&played.bounds[0]), [Some(20), Some(6)]);
    for memory in &mut played.board.memory[1..] {
        memory.access = AccessTime::Cycles(3);
    }
    let slow = played.bounded().expect("a bound");
    assert_eq!(visits(&slow), [Some(3 * 20), Some(3 * 6)]);
    let before = |bounds: &Bounded| cycles_of(bounds, "entry of the interrupt");
    // Two cycles more for each of eight words and the vector, and for that the other core's.
    assert_eq!(before(&slow[0]), Some(12 + 8 * 2 + 2 + 1));
}

const VISITS: &str = "the other core's visits";

/// Where stacks lie among the code, each of the eight words that are saved and taken back waits for
/// a fetch.
#[test]
fn stacks_among_code_have_a_bound_that_a_checker_comes_to() {
    let mut board = rp2350();
    board.stacks = vec![0x2004_0000, 0x2008_0000];
    let played = Played::on(board, &[&[(5, 0)]], &[3, 2]);
    played.is_audited(1);
    for bounds in &played.bounds[0] {
        let cycles = |name: &str| cycles_of(bounds, name);
        // The vector, in flash's copy among the code, waits too.
        assert_eq!(cycles("entry of the interrupt"), Some(12 + 8 + 1));
        assert_eq!(cycles("return from the interrupt"), Some(12 + 8));
        let waiting = bounds.waiting();
        let mut saved = waiting
            .iter()
            .filter(|waited| waited.data.ends_with(" saves"));
        assert_eq!(saved.next().map(|waited| waited.cycles), Some(2 * 8 + 1));
    }
}

/// A program that has a bound.
fn played() -> Played {
    Played::new(&[&[(5, 0)]], &[3, 2])
}

impl Played {
    /// Of what has been changed.
    pub fn bounded(&self) -> Result<Vec<Bounded>, NotBounded> {
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

/// All vectors but the first two lead to the end or nowhere, and one of them to the handler; so in
/// both tables.
#[test]
fn another_interrupt_has_no_bound() {
    let played = played();
    let symbol = |name: &str| played.program.symbols[name];
    let other = symbol("midi_step");
    for (table, handler) in [("vectors0", "tick_core0"), ("vectors1", "tick_core1")] {
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
        // The last one is the handler's own; another one that leads to it is refused.
        let (at, address) = (symbol(table) + 8, symbol(handler));
        let refused = played.with_word(at, address | 1).expect_err("no bound");
        assert_eq!(refused, NotBounded::Interrupts { address });
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

/// Something that lies below an address.
type Change<'a> = &'a dyn Fn(&mut Played, u32);

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
        for change in [&section as Change, &stack, &memory] {
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

/// A stack that ends nowhere, or in memory without a known time.
#[test]
fn a_stack_lies_in_memory_with_a_known_time() {
    let played = played();
    for (end, what) in [
        (
            0x3000_0000,
            Unknown::Nothing {
                target: 0x2fff_fffc,
            },
        ),
        (
            0x1000_1000,
            Unknown::Memory {
                memory: "flash".into(),
                section: None,
            },
        ),
    ] {
        let refused = played.with_word(played.program.symbols["vectors0"], end);
        let Err(NotBounded::UnknownTime(refused)) = refused else {
            panic!("{refused:?}");
        };
        assert_eq!(refused.what, what);
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
