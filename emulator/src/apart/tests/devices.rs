//! What the random programs ask of the chip, and the handlers of what comes of it.

use super::{GROUPS, Random, write};
use crate::board::Board;
use crate::boards::{BoardKind, ConverterSetup, Ports, build};
use crate::bus::Access;
use crate::device::converter::Converter;
use crate::device::uart::Uart;
use crate::machine::Machine;
use whippen_isa::{Arch, Code, parse};

/// Instructions, with semicolons between them.
pub fn assemble(text: &str) -> Vec<u16> {
    let code = text.split(';').flat_map(|one| {
        let inst = parse(one, Arch::V8M, None).unwrap_or_else(|why| panic!("{one}: {why:?}"));
        match inst.encode(Arch::V8M).expect(one) {
            Code::Narrow(word) => vec![word],
            Code::Wide(first, second) => vec![first, second],
        }
    });
    code.collect()
}

/// R3 becomes an address.
fn at(address: u32, then: &str) -> Vec<u16> {
    let (low, high) = (address & 0xffff, address >> 16);
    assemble(&format!("movw r3, #{low}; movt r3, #{high}; {then}"))
}

/// One of some texts, with R3 as that address.
fn one_of(random: &mut Random, address: u32, texts: &[&str]) -> Vec<u16> {
    at(address, texts[random.below(texts.len() as u32) as usize])
}

const SIO: u32 = 0xd000_0000;
const UART: u32 = 0x4007_0000;
const TIMER: u32 = 0x400b_0000;
const CONVERTER: u32 = 0x4017_0000;
const DMA: u32 = 0x5000_0000;
const CONTROL: u32 = 0xe000_e000;

/// An access to a device of the chip or to a register of the core.
pub fn access(random: &mut Random) -> Vec<u16> {
    match random.below(17) {
        0 | 1 => mailbox(random),
        2 => at(
            SIO,
            &format!("ldr r0, [r3, #{}]", 0x100 + 4 * random.below(2)),
        ),
        3 => at(
            SIO,
            &format!("str r0, [r3, #{}]", 0x100 + 4 * random.below(2)),
        ),
        4 => one_of(random, SIO, &["str r1, [r3, #40]", "ldr r0, [r3, #4]"]),
        5 | 6 => uart(random),
        7 | 8 => timer(random),
        9..=11 => converter(random),
        12 => dma(random),
        13 | 14 => control(random),
        15 => set_timer(50 + random.below(200) as u8),
        _ => assemble("vldr s0, [r6, #4]; vadd.f32 s1, s0, s1; vstr s1, [r6, #8]"),
    }
}

/// FIFOs and doorbells.
fn mailbox(random: &mut Random) -> Vec<u16> {
    one_of(
        random,
        SIO,
        &[
            "str r1, [r3, #84]",
            "str r1, [r3, #84]; str r1, [r3, #84]",
            "ldr r0, [r3, #88]",
            "ldr r0, [r3, #80]",
            "str r1, [r3, #80]",
            "ldr r0, [r3, #0]",
            "movs r0, #1; str r0, [r3, #384]",
            "movs r0, #3; str r0, [r3, #388]",
            "movs r0, #1; str r0, [r3, #392]",
            "movs r0, #3; str r0, [r3, #396]",
        ],
    )
}

fn uart(random: &mut Random) -> Vec<u16> {
    one_of(
        random,
        UART,
        &[
            "str r1, [r3, #0]",
            "strb r1, [r3, #0]",
            "ldr r0, [r3, #0]",
            "ldr r0, [r3, #24]",
            "ldrb r0, [r3, #24]",
            "movs r0, #48; str r0, [r3, #56]",
            "movs r0, #16; str r0, [r3, #56]",
        ],
    )
}

/// A reading, or an alarm in some microseconds.
fn timer(random: &mut Random) -> Vec<u16> {
    let later = 1 + random.below(20);
    match random.below(3) {
        0 => at(TIMER, "ldr r0, [r3, #40]"),
        1 => at(TIMER, "ldr r0, [r3, #36]; ldr r1, [r3, #40]"),
        _ => {
            let alarm = 16 + 4 * random.below(4);
            let set = format!("ldr r0, [r3, #40]; adds r0, #{later}; str r0, [r3, #{alarm}]");
            at(TIMER, &set)
        }
    }
}

fn converter(random: &mut Random) -> Vec<u16> {
    one_of(
        random,
        CONVERTER,
        &[
            "movs r0, #1; str r0, [r3, #4]",
            "ldr r0, [r3, #4]",
            "str r1, [r3, #52]; str r1, [r3, #56]",
            "ldr r0, [r3, #28]",
            "ldr r0, [r3, #32]",
            "movw r0, #771; str r0, [r3, #0]",
            "movw r0, #257; str r0, [r3, #0]",
            "movw r0, #513; str r0, [r3, #0]",
            "movs r0, #0; str r0, [r3, #0]",
        ],
    )
}

/// A copy of some words from the core's own data to shared ones, or to the other's data, or of
/// shared ones to the core's own.
fn dma(random: &mut Random) -> Vec<u16> {
    let channel = random.below(3);
    // Enabled, words, both addresses step, chained to none, without a request.
    let control = 1 | 2 << 2 | 1 << 4 | 1 << 6 | channel << 13 | 0x3f << 17;
    let (low, high) = (control & 0xffff, control >> 16);
    let [from, to] = [["r6", "r5"], ["r6", "r8"], ["r5", "r6"]][random.below(3) as usize];
    let count = 1 + random.below(12);
    let words = format!("str {from}, [r3, #0]; str {to}, [r3, #4]; movs r0, #{count}");
    let go = format!("str r0, [r3, #8]; movw r0, #{low}; movt r0, #{high}; str r0, [r3, #12]");
    at(DMA + 0x40 * channel, &format!("{words}; {go}"))
}

/// Registers of the core: NVIC, SysTick, SCB, special ones.
fn control(random: &mut Random) -> Vec<u16> {
    let own = [
        ("ldr r0, [r3, #24]", CONTROL),
        ("ldr r0, [r3, #16]", CONTROL),
        (
            "movs r0, #99; str r0, [r3, #20]; str r0, [r3, #24]; movs r0, #7; str r0, [r3, #16]",
            CONTROL,
        ),
        ("movw r0, #3000; str r0, [r3, #20]", CONTROL),
        ("movs r0, #0; str r0, [r3, #16]", CONTROL),
        ("str r1, [r3, #512]", CONTROL),
        ("str r1, [r3, #640]", CONTROL),
        (
            "movw r0, #8; str r0, [r3, #384]; mvn r0, #0; str r0, [r3, #256]",
            CONTROL,
        ),
        (
            "movs r0, #0; movt r0, #4096; str r0, [r3, #4]",
            CONTROL + 0xd00,
        ),
        ("movs r0, #16; str r0, [r3, #16]", CONTROL + 0xd00),
        ("movs r0, #2; str r0, [r3, #16]", CONTROL + 0xd00),
        ("movs r0, #0; str r0, [r3, #16]", CONTROL + 0xd00),
        (
            "movw r0, #768; movt r0, #1530; str r0, [r3, #12]",
            CONTROL + 0xd00,
        ),
        ("ldr r0, [r3, #4]", 0xe000_1000),
    ];
    let special = [
        "movs r0, #64; msr basepri, r0; movs r0, #0; msr basepri, r0",
        "movs r0, #64; msr basepri, r0",
        "movs r0, #0; msr basepri, r0",
        "mrs r0, basepri; mrs r1, primask",
        "wfi",
        "sev; wfe; wfe",
        "svc #0",
        "isb sy",
        "cpsid i; ldr r0, [r6, #0]; cpsie i",
    ];
    let picked = random.below((own.len() + special.len()) as u32) as usize;
    match own.get(picked) {
        Some((then, address)) => at(*address, then),
        None => assemble(special[picked - own.len()]),
    }
}

/// What a handler does, by the first and the last exception that it is for.
fn handlers(random: &mut Random) -> Vec<(u32, u32, Vec<u16>)> {
    let leave = [
        "bx lr",
        "push {r4, lr}; pop {r4, pc}",
        "push {lr}; pop {pc}",
    ];
    let mut with = |first, last, body: Vec<u16>| {
        let end = assemble(leave[random.below(3) as usize]);
        (first, last, [body, end].concat())
    };
    let own = assemble("ldr r0, [r6, #0]; adds r0, #1; str r0, [r6, #0]");
    let float = assemble("vldr s0, [r6, #4]; vmul.f32 s0, s0, s0; vstr s0, [r6, #4]");
    vec![
        with(16, 67, own.clone()),
        with(11, 14, float),
        with(15, 15, own),
        with(16, 19, at(TIMER, "movs r0, #15; str r0, [r3, #60]")),
        with(26, 29, at(DMA, "movs r0, #255; str r0, [r3, #1036]")),
        with(
            41,
            41,
            at(SIO, "ldr r0, [r3, #88]; movs r0, #12; str r0, [r3, #80]"),
        ),
        with(42, 42, at(SIO, "movs r0, #255; str r0, [r3, #396]")),
        with(
            49,
            49,
            at(UART, "ldr r0, [r3, #0]; movs r0, #16; str r0, [r3, #56]"),
        ),
        with(
            62,
            62,
            at(
                CONVERTER,
                "movs r0, #1; str r0, [r3, #4]; str r1, [r3, #56]",
            ),
        ),
        with(
            14,
            14,
            at(CONTROL + 0xd00, "movs r0, #0; str r0, [r3, #16]"),
        ),
    ]
}

/// Writes handlers behind a core's vectors, and has them there.
pub fn write_handlers(m: &mut Machine, base: u32, random: &mut Random) {
    let mut to = base + 0x140;
    for (first, last, code) in handlers(random) {
        write(m, to, &code);
        for number in first..=last {
            let vector = [to as u16 | 1, (to >> 16) as u16];
            write(m, base + 4 * number, &vector);
        }
        to += 4 * (code.len() as u32).div_ceil(2);
    }
    assert!(to <= base + super::CODE);
}

/// A chip with a converter of a few keys, a serial port that receives, and alarms that interrupt.
pub fn chip(random: &mut Random) -> (Machine, Ports) {
    let kind = BoardKind::Rp2350;
    let setup = ConverterSetup {
        keys: 4,
        rate: [20_000 + random.below(200_000), 1],
    };
    let board: Board = kind.board();
    let (mut m, ports) = build(kind, board, setup).unwrap();
    let converter: &mut Converter = m.bus.device_mut(ports.converter).unwrap();
    (converter.recording, converter.listening) = (true, true);
    converter
        .samples
        .extend((0..4000).map(|word: u16| word.wrapping_mul(77)));
    let half = random.below(2) == 0;
    let serves = [0x101, 0x301, 0x303][random.below(3) as usize];
    for (address, value) in [
        (UART + 0x24, 1),
        (UART + 0x2c, 0x60 | random.below(2) << 4),
        (UART + 0x30, 0x301),
        (UART + 0x38, random.below(2) << 4),
        (TIMER + 0x40, 15),
        (DMA + 0x404, 7),
        (CONVERTER + 0x0c, GROUPS[0] + super::DATA + 0x40),
        (
            CONVERTER + 0x10,
            GROUPS[usize::from(half)] + super::DATA + 0x60,
        ),
        (CONVERTER + 0x14, 8),
        (CONVERTER, if random.below(2) == 0 { serves } else { 0 }),
    ] {
        m.bus
            .device_write(address, 4, value, Access::DMA, 0)
            .unwrap();
    }
    let uart: &mut Uart = m.bus.device_mut(ports.uarts[0]).unwrap();
    uart.receive(b"some bytes that the port receives", 0);
    (m, ports)
}

/// What the host can see of devices.
pub fn heard(m: &Machine, ports: &Ports) -> impl PartialEq + std::fmt::Debug + use<> {
    let converter: &Converter = m.bus.device(ports.converter).unwrap();
    let of_converter = (
        converter.drives.clone(),
        converter.outputs().to_vec(),
        converter.heard.clone(),
        (
            converter.ticks(),
            converter.overruns(),
            converter.words_given(),
        ),
    );
    let uart: &Uart = m.bus.device(ports.uarts[0]).unwrap();
    (of_converter, uart.output.clone())
}

/// SysTick interrupts in so many cycles, and again.
pub fn set_timer(cycles: u8) -> Vec<u16> {
    let reload = format!("movs r0, #{cycles}; str r0, [r3, #20]; str r0, [r3, #24]");
    at(
        CONTROL,
        &format!("{reload}; movs r0, #7; str r0, [r3, #16]"),
    )
}
