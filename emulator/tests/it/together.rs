//! Two cores, devices and time: who sees what when.

use crate::support::{CODE, Count, DATA, STACK, machine};
use std::any::Any;
use whippen_emulator::{
    Access, Board, Bus, BusError, CoreKind, Device, Machine, Region, Register, Start, Stop, Waits,
};

/// Remembers every access, and raises interrupt 3 of core 0 in a cycle.
#[derive(Default)]
struct Recorder {
    accesses: Vec<(usize, u64, u32)>,
    alarm: Option<u64>,
}

impl Device for Recorder {
    fn read(&mut self, access: Access, _: &mut Bus) -> Result<u32, BusError> {
        self.accesses
            .push((access.core, access.cycle, access.offset));
        Ok(access.cycle as u32)
    }

    fn write(&mut self, access: Access, value: u32, bus: &mut Bus) -> Result<(), BusError> {
        self.accesses.push((access.core, access.cycle, value));
        if access.offset == 4 {
            bus.lines.set(0, 3, false);
        }
        Ok(())
    }

    fn due(&self) -> u64 {
        self.alarm.unwrap_or(u64::MAX)
    }

    fn attend(&mut self, _: u64, bus: &mut Bus) {
        self.alarm = None;
        bus.lines.set(0, 3, true);
    }
}

const PORT: u32 = 0x4000_0000;

fn pair(halfwords: &[u16]) -> Machine {
    let board = Board {
        cores: 2,
        regions: vec![Region::ram("ram", CODE, 0x4_0000)],
        vector_table: CODE,
        ..Board::generic(CoreKind::CortexM33)
    };
    let mut m = Machine::new(board).expect("a board");
    let bytes: Vec<u8> = halfwords.iter().flat_map(|h| h.to_le_bytes()).collect();
    m.bus.memory.write(CODE, &bytes).expect("code fits");
    for core in 0..2 {
        m.start(
            core,
            Start {
                vector_table: CODE,
                stack: STACK - 0x1000 * core as u32,
                address: CODE | 1,
            },
        );
    }
    m
}

#[test]
fn accesses_of_two_cores_come_in_the_order_of_cycles() {
    // loop: str r0, [r4]; adds r0, #1; udiv r1, r0, r2; b loop, with another divisor on each core.
    let mut m = pair(&[0x6020, 0x3001, 0xfbb0, 0xf1f2, 0xe7fa]);
    let id = m.bus.attach(
        PORT,
        0x1000,
        Waits { read: 2, write: 3 },
        Box::new(Recorder::default()),
    );
    for core in 0..2 {
        m.cpu_mut(core).set(Register::core(4), PORT);
        m.cpu_mut(core).set(Register::core(0), 0x7fff_0000);
        m.cpu_mut(core)
            .set(Register::core(2), [3, 0x0100_0000][core]);
    }
    assert_eq!(m.run(5_000), Stop::Limit);
    let recorder: &Recorder = m.bus.device(id).expect("the device");
    assert!(
        recorder.accesses.iter().any(|a| a.0 == 0) && recorder.accesses.iter().any(|a| a.0 == 1)
    );
    assert!(
        recorder
            .accesses
            .is_sorted_by_key(|(core, cycle, _)| (*cycle, *core))
    );
    // str 1 + 3, adds 1, udiv 2 + 4 + 29 / 4 (published rule), b 2.
    let of = |core| {
        recorder
            .accesses
            .iter()
            .filter(move |a| a.0 == core)
            .map(|a| a.1)
    };
    let period: Vec<u64> = of(0).zip(of(0).skip(1)).map(|(a, b)| b - a).collect();
    assert!(period[2..].iter().all(|p| *p == period[2]), "{period:?}");
}

#[test]
fn cores_count_together_without_losing_anything() {
    // loop: ldrex r0, [r4]; adds r0, #1; strex r1, r0, [r4]; cmp r1, #0; bne loop; subs r5, #1; bne
    // loop; wfi
    let code = [
        0xe854, 0x0f00, 0x3001, 0xe844, 0x0100, 0x2900, 0xd1f8, 0x3d01, 0xd1f6, 0xbf30, 0xe7fd,
    ];
    let ready = || {
        let mut m = pair(&code);
        for core in 0..2 {
            m.cpu_mut(core).set(Register::core(4), DATA);
            m.cpu_mut(core).set(Register::core(5), 1000);
        }
        m
    };
    let (mut m, mut observed) = (ready(), ready());
    assert_eq!(m.run(1_000_000), Stop::Asleep);
    assert_eq!(
        observed.run_observed(1_000_000, &mut Count::default()),
        Stop::Asleep
    );
    let mut bytes = [0; 4];
    m.bus.memory.read(DATA, &mut bytes).expect("data");
    assert_eq!(u32::from_le_bytes(bytes), 2000);
    assert_eq!(
        (m.cycle(0), m.cycle(1)),
        (observed.cycle(0), observed.cycle(1))
    );
}

#[test]
fn a_plain_store_of_the_other_core_breaks_an_exclusive_access() {
    // Core 0: nop * 4; ldrex r0, [r4]; nop * 8; strex r1, r0, [r4]; wfi. Core 1: str r0, [r4]; wfi,
    // at once or after nop * 8.
    let nops = [0xbf00; 8];
    let (load, store, end) = ([0xe854, 0x0f00], [0xe844, 0x0100, 0xbf30], [0x6020, 0xbf30]);
    let code = [&nops[..4], &load[..], &nops, &store, &end, &nops, &end].concat();
    for (start, fails) in [(34, 0), (38, 1)] {
        let mut m = pair(&code);
        for core in 0..2 {
            m.cpu_mut(core).set(Register::core(4), DATA);
        }
        m.cpu_mut(1).set(Register::PC, CODE + start);
        assert_eq!(m.run(1000), Stop::Asleep);
        assert_eq!(
            m.cpu(0).get(Register::core(1)),
            fails,
            "core 1 from {start}"
        );
    }
}

#[test]
fn an_event_wakes_the_other_core() {
    // Core 0: wfe; wfe; movs r0, #1; wfi. Core 1: nop; nop; sev; wfi
    let mut m = pair(&[
        0xbf20, 0x2001, 0xbf30, 0xbf00, 0xbf00, 0xbf00, 0xbf40, 0xbf30,
    ]);
    m.cpu_mut(1).set(Register::PC, CODE + 6);
    assert_eq!(m.run(1000), Stop::Asleep);
    assert_eq!(m.cpu(0).get(Register::core(0)), 1);
}

#[test]
fn an_interrupt_comes_in_its_cycle() {
    // Vectors: 19 is interrupt 3. Handler at +0x100: str r1, [r4, #4]; bx lr. Thread: b .
    let mut m = machine(CoreKind::CortexM33, &[]);
    let mut image = vec![0_u32; 64];
    (image[0], image[1], image[19]) = (STACK, CODE + 0x81, CODE + 0x101);
    let bytes: Vec<u8> = image.iter().flat_map(|w| w.to_le_bytes()).collect();
    m.bus.memory.write(CODE, &bytes).expect("vectors");
    m.bus
        .memory
        .write(CODE + 0x80, &0xe7fe_u16.to_le_bytes())
        .expect("code");
    m.bus
        .memory
        .write(CODE + 0x100, &0x4770_6061_u32.to_le_bytes())
        .expect("handler");
    let id = m.bus.attach(
        PORT,
        0x1000,
        Waits::default(),
        Box::new(Recorder {
            alarm: Some(500),
            ..Recorder::default()
        }),
    );
    m.reset();
    m.cpu_mut(0).set(Register::core(4), PORT);
    // Enables interrupt 3 as the program would.
    m.bus
        .memory
        .write(DATA, &[0x20, 0x60, 0x70, 0x47])
        .expect("code");
    m.call(DATA | 1, [8, 0, 0, 0], 100);
    m.cpu_mut(0).set(Register::core(4), 0xe000_e100);
    m.call(DATA | 1, [8, 0, 0, 0], 100);
    m.cpu_mut(0).set(Register::core(4), PORT);
    m.cpu_mut(0).set(Register::core(1), 9);
    m.cpu_mut(0).set(Register::PC, CODE + 0x80);
    assert_eq!(m.run(600), Stop::Limit);
    let recorder: &dyn Any = m.bus.device::<Recorder>(id).expect("the device");
    let recorder = recorder.downcast_ref::<Recorder>().expect("a recorder");
    let (core, cycle, value) = *recorder.accesses.last().expect("the handler ran");
    // At most one branch (3 cycles) is in the way; entry takes 12.
    assert_eq!((core, value), (0, 9));
    assert!((512..515).contains(&cycle), "{cycle}");
}

#[test]
fn sleeping_takes_no_time_and_ends_when_something_is_due() {
    // wfi; movs r0, #5; wfi
    let mut m = machine(CoreKind::CortexM0Plus, &[0xbf30, 0x2005, 0xbf30]);
    m.bus.attach(
        PORT,
        0x1000,
        Waits::default(),
        Box::new(Recorder {
            alarm: Some(1 << 40),
            ..Recorder::default()
        }),
    );
    m.start(
        0,
        Start {
            vector_table: CODE,
            stack: STACK,
            address: CODE | 1,
        },
    );
    assert_eq!(m.run(1 << 39), Stop::Limit);
    assert_eq!(m.cycle(0), 1 << 39);
    // The interrupt is not enabled: it does not wake.
    assert_eq!(m.run(u64::MAX), Stop::Asleep);
    assert_eq!(m.cpu(0).get(Register::core(0)), 0);
}
