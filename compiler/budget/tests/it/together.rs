//! Two cores that want one bank on purpose, or one bridge: the bound of a few accesses with another
//! manager at it is met, so a bound that is a cycle lower would not hold.

use whippen_budget::{
    Annotations, Code, Interference, Lies, Neighbour, Others, Query, Reach, bound,
};
use whippen_emulator::{
    BoardKind, ConverterSetup, Machine, Observer, Register, Start, Step, Stop, build,
};
use whippen_isa::timing::{Core, Target};

use crate::image::rp2350;

/// Where core 1 runs, which is measured, as core 0 is served first: in its own group of banks.
const CODE: u32 = 0x2000_0100;
/// Where core 0 runs.
const OTHER_CODE: u32 = 0x2008_1000;
/// What both access: in the other group, or a word of the watchdog's, behind the APB.
const DATA: u32 = 0x2004_0000;
const DEVICE: u32 = 0x400d_800c;

/// Instructions before the first access, so that the other core is under way.
const BEFORE: usize = 16;

/// `adds r1, #1` some times; `ldr r0, [r4]`, `str r0, [r4]`, and so on, so many; `b` to itself.
fn accesses(count: usize) -> Vec<u16> {
    let mut code = vec![0x3101; BEFORE];
    code.extend([0x6820, 0x6020].into_iter().cycle().take(count));
    code.push(0xe7fe);
    code
}

/// Where they end.
fn end(count: usize) -> u32 {
    CODE + 2 * (BEFORE + count) as u32
}

/// Remembers when core 1 comes to its end first.
struct Ends {
    at: u32,
    cycle: Option<u64>,
    began: Option<u64>,
}

impl Observer for Ends {
    fn instruction(&mut self, step: &Step<'_>) {
        if step.core == 1 {
            self.began.get_or_insert(step.cycle);
            if step.address == self.at {
                self.cycle.get_or_insert(step.cycle);
            }
        }
    }
}

/// Cycles of so many accesses of core 1 to a place, while core 0 makes 20 there in each round with
/// that instruction, `apart` instructions from the next.
fn measured(place: u32, [count, apart]: [usize; 2], access: u16) -> u64 {
    let kind = BoardKind::Rp2350;
    let (mut machine, _) =
        build(kind, kind.board(), ConverterSetup::default()).expect("the board can be");
    let write = |machine: &mut Machine, at: u32, code: &[u16]| {
        let bytes: Vec<u8> = code.iter().flat_map(|half| half.to_le_bytes()).collect();
        machine.bus.memory.write(at, &bytes).expect("memory");
    };
    write(&mut machine, CODE, &accesses(count));
    // With that many `adds r1, #1` before, and back.
    let mut other = vec![0x3101; apart];
    other.extend([access; 20]);
    let back = -(other.len() as i32) - 2;
    other.push(0xe000 | (back as u16 & 0x7ff));
    write(&mut machine, OTHER_CODE, &other);
    for (core, address) in [OTHER_CODE, CODE].into_iter().enumerate() {
        let start = Start {
            vector_table: CODE,
            stack: 0x2008_0000,
            address: address | 1,
        };
        machine.start(core, start);
        machine.cpu_mut(core).set(Register::core(4), place);
    }
    let mut ends = Ends {
        at: end(count),
        cycle: None,
        began: None,
    };
    assert_eq!(machine.run_observed(2000, &mut ends), Stop::Limit);
    let (began, ended) = (ends.began.expect("it ran"), ends.cycle.expect("it ended"));
    ended - began
}

/// The bound of these accesses to a place with another manager at the bank or the bridge, and with
/// nobody.
fn bounds(place: u32, count: usize) -> [u64; 2] {
    let board = rp2350();
    let code = accesses(count);
    let code = Code::new(CODE, code.into_iter().flat_map(u16::to_le_bytes).collect());
    let banks = |at: u32| board.memory_at(at).map_or(0, |memory| memory.bank_set());
    let annotations = Annotations {
        stops: [end(count)].into(),
        entered: [(4, [place, place])].into(),
        return_to: Some(Target {
            address: 0,
            wide: false,
        }),
        ..Annotations::default()
    };
    // An access of the other core at its longest is a write.
    let bridge = Neighbour {
        device: DEVICE,
        wait_cycles: 4,
    };
    [(vec![banks(DATA)], Some(bridge)), (Vec::new(), None)].map(|(contenders, neighbour)| {
        let others = Others {
            fetches: true,
            contenders,
            remote_accesses: 0,
            dma: None,
            neighbour,
        };
        let lies = Lies {
            code: banks(CODE),
            data: Reach {
                banks: banks(DATA),
                unknown: None,
            },
            ..Lies::default()
        };
        let around = Interference::new(&board, &[], lies, others);
        let query = Query {
            core: &Core::cortex_m33(),
            code: &code,
            entry: CODE,
            annotations: &annotations,
            interference: Some(&around),
        };
        bound(&query).expect("a bound").cycles_max
    })
}

/// That the most of what is measured of accesses to a place is their bound.
fn is_met(place: u32, access: u16) {
    for count in [1, 2, 5] {
        let [contended, alone] = bounds(place, count);
        let longest = (0..12).map(|apart| measured(place, [count, apart], access));
        let longest = longest.max().expect("some");
        println!("{count} accesses: {longest} cycles, bound {contended}, alone {alone}");
        assert!(longest > alone, "{longest} > {alone}");
        assert_eq!(longest, contended, "a cycle less would be exceeded");
    }
}

/// `ldr r0, [r4]`.
#[test]
fn a_bank_that_the_other_core_wants_is_waited_for_as_bounded() {
    is_met(DATA, 0x6820);
}

/// `str r0, [r4]`.
#[test]
fn a_bridge_that_the_other_core_wants_is_waited_for_as_bounded() {
    is_met(DEVICE, 0x6020);
}
