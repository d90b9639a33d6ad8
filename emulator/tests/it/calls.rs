//! Calls of functions, their cycles, and how they end.

use crate::support::{CODE, Count, machine};
use whippen_emulator::{CoreKind, Fault, FaultKind, Reason, Stop};

#[test]
fn a_call_returns_its_result_and_its_cycles() {
    // adds r0, r0, r1; bx lr: 1 + 2, less the cycle that the branch shares with the instruction
    // before it.
    let mut m = machine(CoreKind::CortexM33, &[0x1840, 0x4770]);
    let Stop::Returned { cycles, result } = m.call(CODE, [40, 2, 0, 0], 100) else {
        panic!("no return")
    };
    assert_eq!((result[0], cycles), (42, 2));
    let mut count = Count::default();
    let again = m.call_observed(CODE, [40, 2, 0, 0], 100, &mut count);
    assert_eq!(
        again,
        Stop::Returned {
            cycles,
            result: [42, 2]
        }
    );
    assert_eq!((count.instructions, count.cycles), (2, 2));
}

/// `MOVS R5,#100; 1: SUBS R5,#1; BNE 1b`, published counts of RP2350: 299 with the loop word
/// aligned, 300 without.
#[test]
fn published_loops_take_the_published_cycles() {
    // A nop places MOVS at ...02; the difference to the loop that runs zero times is the loop.
    let aligned = [0xbf00, 0x2564, 0x3d01, 0xd1fd, 0x4770];
    let unaligned = [0x2564, 0x3d01, 0xd1fd, 0x4770];
    let with_mov = [0x2564, 0x3d01, 0x4611, 0xd1fc, 0x4770];
    for (code, skip, expected) in [
        (&aligned[..], 2, 299),
        (&unaligned[..], 0, 300),
        (&with_mov[..], 0, 300),
    ] {
        let mut m = machine(CoreKind::CortexM33, code);
        let mut starts = Loop::default();
        m.call_observed(CODE + skip, [0; 4], 10_000, &mut starts);
        assert_eq!(starts.cycles, expected, "{code:04x?}");
    }
}

/// Cycles of everything before BX.
#[derive(Default)]
struct Loop {
    cycles: u32,
}

impl whippen_emulator::Observer for Loop {
    fn instruction(&mut self, step: &whippen_emulator::Step<'_>) {
        if step.inst.op() != whippen_isa::Op::BX {
            self.cycles += step.cost.cycles();
        }
    }
}

#[test]
fn an_unhandled_fault_stops_with_its_reason() {
    let text = |halfwords: &[u16], r0| match machine(CoreKind::CortexM33, halfwords).call(
        CODE,
        [r0, 0, 0, 0],
        100,
    ) {
        Stop::Fault(fault) => fault.to_string(),
        stop => panic!("{stop}"),
    };
    // ldrd r2, r3, [r0]
    assert_eq!(
        text(&[0xe9d0, 0x2300], 0x2000_0102),
        "UsageFault: unaligned access at 0x20000102 by the instruction at 0x20000000"
    );
    assert_eq!(
        text(&[0x6800], 0x9000_0000),
        "BusFault: nothing answers a load at 0x90000000 by the instruction at 0x20000000"
    );
    assert_eq!(
        text(&[0xde00], 0),
        "UsageFault: undefined instruction at 0x20000000"
    );
    assert_eq!(
        text(&[0x4700], 0x2000_0100),
        "UsageFault: branch to an even address (no Thumb bit) at 0x20000100"
    );
    assert_eq!(
        text(&[0x4700], 0x9000_0001),
        "BusFault: no code at 0x90000000"
    );
    assert_eq!(
        text(&[0x4700], 0x4000_0001),
        "MemManage: execution of memory that never executes at 0x40000000"
    );
    assert_eq!(
        text(&[0xee00, 0x0410], 0),
        "UsageFault: coprocessor absent or disabled (floating point: CP10 and CP11 in CPACR) at 0x20000000"
    );
}

#[test]
fn a_call_that_does_not_end_reaches_its_limit() {
    let mut m = machine(CoreKind::CortexM4, &[0xe7fe]);
    assert_eq!(m.call(CODE, [0; 4], 1000), Stop::Limit);
    assert!((1000..1010).contains(&m.cycle(0)));
}

#[test]
fn code_that_changes_itself_is_decoded_again() {
    // strh r1, [r0, #8]; isb; movs r0, #1; bx lr; and the halfword at r0 + 8 becomes movs r0, #7.
    let code = [0x8101, 0xf3bf, 0x8f6f, 0xbf00, 0x2001, 0x4770];
    let mut m = machine(CoreKind::CortexM33, &code);
    let first = m.call(CODE, [CODE, 0x2001, 0, 0], 100);
    let second = m.call(CODE, [CODE, 0x2007, 0, 0], 100);
    assert!(
        matches!(first, Stop::Returned { result: [1, _], .. }),
        "{first}"
    );
    assert!(
        matches!(second, Stop::Returned { result: [7, _], .. }),
        "{second}"
    );
}

#[test]
fn unaligned_accesses_are_faults_when_ccr_says_so() {
    // str r1, [r0]; ldr r0, [r2]; bx lr
    let code = [0x6001, 0x6810, 0x4770];
    let call = |core, ccr| machine(core, &code).call(CODE, [0xe000_ed14, ccr, CODE + 1, 0], 100);
    assert!(matches!(
        call(CoreKind::CortexM33, 0x201),
        Stop::Returned {
            result: [0x7068_1060, _],
            ..
        }
    ));
    let trapped = call(CoreKind::CortexM33, 0x209);
    assert!(
        matches!(&trapped, Stop::Fault(fault) if fault.reason == Reason::Unaligned),
        "{trapped}"
    );
    let never_allowed = call(CoreKind::CortexM0Plus, 0);
    assert!(
        matches!(&never_allowed, Stop::Fault(fault) if fault.reason == Reason::Unaligned),
        "{never_allowed}"
    );
}

#[test]
fn a_stack_limit_is_a_fault() {
    let mut m = machine(CoreKind::CortexM33, &[0xb5ff, 0xbdff]);
    let limit = whippen_emulator::Register::named("msplim").expect("a name");
    m.cpu_mut(0).set(limit, crate::support::STACK - 16);
    let stop = m.call(CODE, [0; 4], 100);
    let reason = Reason::StackOverflow;
    let fault = Fault {
        core: 0,
        kind: FaultKind::UsageFault,
        reason,
        pc: CODE,
        address: CODE,
        lockup: false,
    };
    assert_eq!(stop, Stop::Fault(fault));
}
