//! Two cores that want one bank on purpose: the bound of a few accesses with another manager at it
//! is met, so a bound that is a cycle lower would not hold.

use whippen_compiler::budget::{
    Annotations, Code, Interference, Lies, Others, Query, Reach, bound,
};
use whippen_emulator::{
    Board as EmulatedBoard, BoardKind, CoreKind, Machine, Observer, Register, Start, Step, Stop,
};
use whippen_isa::timing::{Core, Target};
use whippen_runtime::board;

/// Where core 1 runs, which is measured, as core 0 is served first: in its own group of banks.
const CODE: u32 = 0x2000_0100;
/// Where core 0 runs.
const OTHER_CODE: u32 = 0x2008_1000;
/// What both access: in the other group.
const DATA: u32 = 0x2004_0000;

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

/// Cycles of so many accesses of core 1, while core 0 makes some in each round, `apart`
/// instructions from the next.
fn measured(count: usize, apart: usize) -> u64 {
    let board = EmulatedBoard {
        cores: 2,
        banks: BoardKind::Rp2350.board().banks,
        vector_table: CODE,
        ..EmulatedBoard::generic(CoreKind::CortexM33)
    };
    let mut machine = Machine::new(board).expect("a board");
    let write = |machine: &mut Machine, at: u32, code: &[u16]| {
        let bytes: Vec<u8> = code.iter().flat_map(|half| half.to_le_bytes()).collect();
        machine.bus.memory.write(at, &bytes).expect("memory");
    };
    write(&mut machine, CODE, &accesses(count));
    // `ldr r0, [r4]` 20 times with that many `adds r1, #1` before, and back.
    let mut other = vec![0x3101; apart];
    other.extend([0x6820; 20]);
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
        machine.cpu_mut(core).set(Register::core(4), DATA);
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

/// The bound of these accesses with another manager at the bank, and with nobody.
fn bounds(count: usize) -> [u64; 2] {
    let board = board::bundled("rp2350").expect("it is bundled");
    let code = accesses(count);
    let code = Code::new(CODE, code.into_iter().flat_map(u16::to_le_bytes).collect());
    let banks = |at: u32| board.memory_at(at).map_or(0, |memory| memory.bank_set());
    let annotations = Annotations {
        stops: [end(count)].into(),
        entered: [(4, [DATA, DATA])].into(),
        return_to: Some(Target {
            address: 0,
            wide: false,
        }),
        ..Annotations::default()
    };
    [vec![banks(DATA)], Vec::new()].map(|contenders| {
        let others = Others {
            fetches: true,
            contenders,
            remote_accesses: 0,
            dma: None,
            neighbour: None,
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

#[test]
fn a_bank_that_the_other_core_wants_is_waited_for_as_bounded() {
    for count in [1, 2, 5] {
        let [contended, alone] = bounds(count);
        let longest = (0..12).map(|apart| measured(count, apart)).max();
        let longest = longest.expect("some");
        println!("{count} accesses: {longest} cycles, bound {contended}, alone {alone}");
        assert!(longest > alone, "{longest} > {alone}");
        assert_eq!(longest, contended, "a cycle less would be exceeded");
    }
}
