//! STM32F407: what lies where (RM0090, 2.3), and the blocks that a start-up touches (RM0090,
//! chapters 3, 7, 8, 9, 21, 30).
//!
//! One core and no other manager at work, so nobody waits for memory. Address 0 shows SRAM1, as a
//! program asks for in SYSCFG_MEMRMP; it does so from the start here.
//!
//! Not here: flash with its wait states, DMA, timers, interrupts of the serial ports, all other
//! peripherals.

use super::{ConverterSetup, PERIPHERAL, Ports};
use crate::board::{Board, CoreKind, Region};
use crate::bus::Bus;
use crate::device::converter::Converter;
use crate::device::iwdg::Iwdg;
use crate::device::registers::{Reads, Registers, Row, held, words};
use crate::device::uart::Uart;

const CLOCK_HZ: u32 = 168_000_000;
const FLASH: u32 = 0x0800_0000;
const SRAM1: u32 = 0x2000_0000;
/// Bytes of a block of registers.
const BLOCK: u32 = 0x400;

/// No chip has the converter: it lies in addresses that are reserved, and has the interrupt of a
/// DMA stream (DMA2_Stream0).
const CONVERTER: (u32, usize) = (0x4003_0000, 56);

/// USART1 and USART2: base, interrupt, cycles of the core for one of the port's own clock.
const USARTS: [(u32, usize, u32); 2] = [(0x4001_1000, 37, 2), (0x4000_4400, 38, 4)];

const REGISTERS: &[(u32, &[Row])] = &[
    (0x4002_3800, RCC),
    (0x4002_3c00, &[held(0, 0, 0x1f0f), words(4, 5)]),
    (
        0x4000_7000,
        &[held(0, 0x4000, 0xffff), held(4, 0x4000, 0x0300)],
    ),
    (0x4001_3800, &[words(0, 8)]),
    (0x4002_0000, GPIO),
    (0x4002_0400, GPIO),
    (0x4002_0800, GPIO),
    (0x4002_0c00, GPIO),
];

/// CR (an oscillator or PLL is ready as soon as it is on), PLLCFGR, CFGR (what is selected is used
/// at once), the rest.
const RCC: &[Row] = &[
    Row {
        reads: Reads::Follow {
            of: 0,
            mask: 0x0501_0001,
            up: 1,
        },
        ..held(0, 0x83, 0x050d_00f9)
    },
    held(4, 0x2400_3010, u32::MAX),
    Row {
        reads: Reads::Follow {
            of: 8,
            mask: 3,
            up: 2,
        },
        ..held(8, 0, 0xffff_fff3)
    },
    words(0xc, 32),
];

/// MODER to AFRH.
const GPIO: &[Row] = &[words(0, 10)];

pub(super) fn board() -> Board {
    let low = Region {
        name: "sram1 at 0".into(),
        base: 0,
        mirrors: Some(SRAM1),
        ..Region::ram("sram1", SRAM1, 112 << 10)
    };
    Board {
        core: CoreKind::CortexM4,
        cores: 1,
        clock_hz: CLOCK_HZ,
        interrupts: 82,
        regions: vec![
            Region::ram("sram1", SRAM1, 112 << 10),
            low,
            Region::ram("sram2", 0x2001_c000, 16 << 10),
            Region::ram("ccm", 0x1000_0000, 64 << 10),
            Region::rom("flash", FLASH, 1 << 20),
        ],
        banks: Vec::new(),
        vector_table: FLASH,
        others: None,
    }
}

pub(super) fn attach(bus: &mut Bus, setup: ConverterSetup) -> Ports {
    for (base, rows) in REGISTERS {
        bus.attach(*base, BLOCK, PERIPHERAL, Box::new(Registers::new(rows)));
    }
    bus.attach(
        0x4000_3000,
        BLOCK,
        PERIPHERAL,
        Box::new(Iwdg::new(CLOCK_HZ)),
    );
    let uarts = USARTS.map(|(base, irq, cycles)| {
        bus.attach(base, BLOCK, PERIPHERAL, Box::new(Uart::stm32(irq, cycles)))
    });
    let (base, irq) = CONVERTER;
    let converter = Converter::new(CLOCK_HZ, irq, setup.keys, setup.rate);
    let converter = bus.attach(base, 4 * BLOCK, PERIPHERAL, Box::new(converter));
    Ports { uarts, converter }
}
