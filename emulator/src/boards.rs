//! The boards that the emulator knows by name: RP2350, RP2040 and STM32F407 with their devices.
//!
//! ```text
//!   build(kind, setup) -> machine + the devices a host talks to (serial ports, converter)
//! ```
//!
//! What stands where and with which wait states is here; what the devices do is in `device`. A
//! start goes as after the chip's own boot ROM: core 0 from the image's vector table, core 1 of an
//! RP waiting in ROM for its start over the FIFO.
//!
//! Not here, and answered with a bus fault: USB, SPI, I2C, RTC, OTP, RP2040's interface of the
//! flash chip, HSTX, SHA-256, TRNG. Flash reads as memory that is always in the cache.

use crate::board::{Board, BoardError, CoreKind, Region};
use crate::bus::{Bus, DeviceId, Waits};
use crate::device::adc::{Adc, AdcLayout};
use crate::device::alias::BLOCK;
use crate::device::bootram::BootRam;
use crate::device::busctrl::BusCtrl;
use crate::device::clocks::{self, Clocks, Resets};
use crate::device::converter::Converter;
use crate::device::dma::{self, Dma, Requesters};
use crate::device::iobank::{IoBank, PadsBank};
use crate::device::pio::{Pio, PioLayout};
use crate::device::power::{Power, Stages, Ticks, Watchdog, Wiring};
use crate::device::pwm::{Pwm, PwmLayout};
use crate::device::qmi::Qmi;
use crate::device::registers::{Registers, Row};
use crate::device::sio::{Chip, Sio};
use crate::device::timer::Timer;
use crate::device::uart::Uart;
use crate::fabric::{Banks, Bridge};
use crate::lines::Start;
use crate::machine::Machine;
use crate::pins::{PinLayout, Pins};

mod rp2040;
mod rp2350;
mod stm32f4;

/// A board by name.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum BoardKind {
    /// Two Cortex-M33 at 150 MHz, 520 KiB SRAM (Raspberry Pi Pico 2).
    Rp2350,
    /// Two Cortex-M0+ at 133 MHz, 264 KiB SRAM (Raspberry Pi Pico).
    Rp2040,
    /// One Cortex-M4 at 168 MHz, 192 KiB SRAM (STM32F407).
    Stm32f4,
}

impl BoardKind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Rp2350, Self::Rp2040, Self::Stm32f4];

    /// The name that the command line uses.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Rp2350 => "rp2350",
            Self::Rp2040 => "rp2040",
            Self::Stm32f4 => "stm32f4",
        }
    }

    /// The chips of Raspberry Pi are tables of one form.
    fn chip(self) -> Option<&'static ChipTable> {
        match self {
            Self::Rp2350 => Some(&rp2350::CHIP),
            Self::Rp2040 => Some(&rp2040::CHIP),
            Self::Stm32f4 => None,
        }
    }

    /// The board's cores and memory. Its vector table is where flash begins, or behind the second
    /// stage of RP2040.
    pub fn board(self) -> Board {
        let Some(chip) = self.chip() else {
            return stm32f4::board();
        };
        let regions = chip.regions.iter().map(region).collect();
        Board {
            core: chip.core,
            cores: 2,
            clock_hz: chip.clock_hz,
            interrupts: chip.interrupts,
            regions,
            banks: chip.banks.to_vec(),
            vector_table: chip.vectors,
            others: Some(chip.core1()),
        }
    }
}

/// What the host fixes of a converter.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ConverterSetup {
    /// Keys, until the program says otherwise.
    pub keys: u32,
    /// Ticks, and in how many seconds there are so many, until the program says otherwise.
    pub rate: [u32; 2],
}

impl Default for ConverterSetup {
    /// 88 keys at 44.1 kHz.
    fn default() -> Self {
        Self {
            keys: 88,
            rate: [44_100, 1],
        }
    }
}

/// The devices of a board that a host talks to.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Ports {
    /// The serial ports, [`Uart`].
    pub uarts: [DeviceId; 2],
    /// The converter, [`Converter`].
    pub converter: DeviceId,
}

/// A chip as data.
struct ChipTable {
    core: CoreKind,
    clock_hz: u32,
    interrupts: usize,
    rom: &'static [u8],
    /// Where the vector table is that the ROM, or RP2040's second stage, starts with.
    vectors: u32,
    /// Name, base, bytes, writable.
    regions: &'static [(&'static str, u32, u32, bool)],
    /// The ports of these.
    banks: &'static [Banks],
    /// Bridges to peripherals, where the DMA and a core may wait for each other.
    bridges: &'static [Bridge],
    /// Blocks that only hold what is written.
    registers: &'static [(u32, &'static [Row])],
    /// Base of the clocks, and what is particular to them.
    clocks: (u32, clocks::ClockLayout),
    /// Base of the resets, their registers, the blocks that need clk_peri to leave theirs.
    resets: (u32, &'static [Row], u32),
    /// Function selects and pads of pins: base and registers.
    io_bank: (u32, &'static [Row]),
    pads: (u32, &'static [Row]),
    pins: PinLayout,
    /// SIO, and how much faster than memory it is.
    sio: Chip,
    sio_waits: Waits,
    /// Bases of the timers, with the number of their first interrupt; where INTR lies in them.
    timers: &'static [(u32, usize)],
    timer_intr: u32,
    /// Bases and interrupts of the serial ports.
    uarts: [(u32, usize); 2],
    /// PSM: base, what its bits mean.
    power: (u32, Stages),
    /// Base, counts per tick.
    watchdog: (u32, u32),
    /// The generator of its ticks in a block of registers: the block's base, the generator's
    /// offset.
    watchdog_ticks: Option<(u32, u32)>,
    pwm: PwmLayout,
    adc: AdcLayout,
    pios: &'static [PioLayout],
    dma: dma::Layout,
    /// Base and interrupt of the converter, which no chip has.
    converter: (u32, usize),
    busctrl: u32,
    /// The interface of the flash chip, and how many bytes that has.
    qmi: Option<(u32, u32)>,
    bootram: Option<u32>,
}

/// The bridge to the peripherals: a read takes at least 3 cycles, a write at least 4 (RP2350
/// datasheet 2.1.5).
const PERIPHERAL: Waits = Waits { read: 2, write: 3 };
const DMA_BASE: u32 = 0x5000_0000;
const SIO_BASE: u32 = 0xd000_0000;

impl ChipTable {
    /// Where core 1 begins: the second word of the ROM's vector table.
    fn core1(&self) -> Start {
        let word = |i: usize| {
            self.rom[i..i + 4]
                .iter()
                .rev()
                .fold(0, |word, byte| word << 8 | u32::from(*byte))
        };
        Start {
            vector_table: 0,
            stack: word(0),
            address: word(4),
        }
    }
}

fn region((name, base, bytes, writable): &(&str, u32, u32, bool)) -> Region {
    Region {
        writable: *writable,
        ..Region::ram(name, *base, *bytes)
    }
}

/// A machine of that kind with all its devices, its memory zero but for the ROM, its cores halted.
///
/// # Errors
/// The board's memory map cannot be (only when `board` was changed by hand).
pub fn build(
    kind: BoardKind,
    board: Board,
    setup: ConverterSetup,
) -> Result<(Machine, Ports), BoardError> {
    let mut machine = Machine::new(board)?;
    let bus = &mut machine.bus;
    let ports = match kind.chip() {
        Some(chip) => {
            // The ROM region is the first of every such chip and larger than its content.
            let _ = bus.memory.write(0, chip.rom);
            attach(chip, bus, setup)
        }
        None => stm32f4::attach(bus, setup),
    };
    Ok((machine, ports))
}

fn attach(chip: &'static ChipTable, bus: &mut Bus, setup: ConverterSetup) -> Ports {
    let clock_hz = chip.clock_hz;
    bus.fabric.set_bridges(chip.bridges);
    attach_pins(chip, bus);
    let sio = bus.attach(
        SIO_BASE,
        0x1000,
        chip.sio_waits,
        Box::new(Sio::new(chip.sio)),
    );
    let uarts = chip
        .uarts
        .map(|(base, irq)| bus.attach(base, BLOCK, PERIPHERAL, Box::new(Uart::new(irq))));
    for (base, irq) in chip.timers {
        bus.attach(
            *base,
            BLOCK,
            PERIPHERAL,
            Box::new(Timer::new(clock_hz, *irq, chip.timer_intr)),
        );
    }
    let mut ticks = Ticks::Own;
    for (base, rows) in chip.registers {
        let block = bus.attach(*base, BLOCK, PERIPHERAL, Box::new(Registers::new(rows)));
        if let Some((of, at)) = chip.watchdog_ticks
            && of == *base
        {
            ticks = Ticks::Block(block, at);
        }
    }
    let (base, layout) = chip.clocks;
    let clocks = bus.attach(base, BLOCK, PERIPHERAL, Box::new(Clocks::new(layout)));
    let (base, rows, on_peri) = chip.resets;
    let resets = Resets::new(rows, clocks, on_peri);
    bus.attach(base, BLOCK, PERIPHERAL, Box::new(resets));
    let (base, stages) = chip.power;
    let power = Power::new(stages, sio, chip.core1());
    let power = bus.attach(base, BLOCK, PERIPHERAL, Box::new(power));
    let (base, counts_per_tick) = chip.watchdog;
    let wiring = Wiring {
        power,
        clocks,
        ticks,
    };
    let watchdog = Watchdog::new(clock_hz, counts_per_tick, wiring);
    bus.attach(base, BLOCK, PERIPHERAL, Box::new(watchdog));
    attach_paced(chip, bus, uarts);
    bus.attach(chip.busctrl, BLOCK, PERIPHERAL, Box::new(BusCtrl::new()));
    if let Some((base, bytes)) = chip.qmi {
        let qmi = Qmi::new(chip.vectors, bytes, clock_hz);
        bus.attach(base, BLOCK, PERIPHERAL, Box::new(qmi));
    }
    if let Some(base) = chip.bootram {
        bus.attach(base, BLOCK, PERIPHERAL, Box::new(BootRam::new()));
    }
    let (base, irq) = chip.converter;
    let converter = Converter::new(clock_hz, irq, setup.keys, setup.rate);
    let converter = bus.attach(base, BLOCK, PERIPHERAL, Box::new(converter));
    Ports { uarts, converter }
}

/// What requests transfers, and the DMA that makes them.
fn attach_paced(chip: &'static ChipTable, bus: &mut Bus, uarts: [DeviceId; 2]) {
    let pwm = Box::new(Pwm::new(chip.pwm));
    bus.attach(chip.pwm.base, BLOCK, PERIPHERAL, pwm);
    let adc = Box::new(Adc::new(chip.adc, chip.clock_hz));
    let adc = bus.attach(chip.adc.base, BLOCK, PERIPHERAL, adc);
    let pios = Pio::attach(bus, chip.pios);
    let requesters = Requesters { uarts, pios, adc };
    Dma::attach(bus, DMA_BASE, Dma::new(chip.dma, requesters));
}

fn attach_pins(chip: &'static ChipTable, bus: &mut Bus) {
    bus.pins = Pins::new(chip.pins);
    let (base, rows) = chip.io_bank;
    bus.attach(base, BLOCK, PERIPHERAL, Box::new(IoBank::new(rows)));
    let (base, rows) = chip.pads;
    bus.attach(base, BLOCK, PERIPHERAL, Box::new(PadsBank::new(rows)));
}

#[cfg(test)]
mod tests;
