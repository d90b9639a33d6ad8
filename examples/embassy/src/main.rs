//! Keys of a piano on a Pico 2: wraps of a PWM slice are the ticks, and a task prints what is
//! struck. The motion is made up; read converters where `finger` is called.
#![no_std]
#![no_main]

/// Written by `whippen build` beside the object.
#[path = "../target/piano.rs"]
mod piano;

use core::fmt::Write;
use core::ptr::{addr_of, addr_of_mut};

use embassy_executor::Spawner;
use embassy_rp::interrupt::{self, InterruptExt, Priority};
use embassy_rp::pac;
use embassy_rp::uart::{Blocking, Config, UartTx};
use embassy_time::Timer;
use panic_halt as _;

/// A slice whose wrap nothing else uses.
const SLICE: usize = 11;
const CYCLES_A_TICK: u32 = 150_000_000 / piano::RATE_HZ;

/// Ticks that are kept for whoever compares them.
const KEPT: usize = 1024;

/// How many ticks there were, and of the last ones the words that were read and driven.
#[unsafe(no_mangle)]
static mut TICKS: u32 = 0;
#[unsafe(no_mangle)]
static mut SENSED: [[u16; piano::KEYS]; KEPT] = [[0; piano::KEYS]; KEPT];
#[unsafe(no_mangle)]
static mut DRIVEN: [[i16; piano::KEYS]; KEPT] = [[0; piano::KEYS]; KEPT];

/// A sensor word: each key goes down and up again, one behind the other.
#[inline(always)]
fn finger(tick: u32, key: usize) -> u16 {
    let phase = tick.wrapping_mul(128).wrapping_add(key as u32 * 8192) % 131_072;
    phase.min(131_071 - phase) as u16
}

/// Puts the sensor words of a tick in their place.
///
/// # Safety
/// Nothing ticks the keys meanwhile.
#[inline(always)]
unsafe fn read_sensors(tick: u32) {
    let inputs = unsafe { &mut *addr_of_mut!(piano::STATE.inputs) };
    for (key, words) in inputs.iter_mut().enumerate() {
        words[piano::INPUT_X] = finger(tick, key);
    }
}

/// The interrupt: sensor words in, one tick of all keys, drive words out. It lies in SRAM, as the
/// keys do.
#[allow(non_snake_case)]
#[unsafe(no_mangle)]
#[unsafe(link_section = ".keys")]
unsafe extern "C" fn PWM_IRQ_WRAP_0() {
    pac::PWM.intr().write(|w| w.0 = 1 << SLICE);
    // Only this interrupt touches the words of a tick, and only it counts.
    unsafe {
        let tick = TICKS;
        read_sensors(tick);
        piano::tick(addr_of_mut!(piano::STATE));
        let at = tick as usize % KEPT;
        let state = addr_of!(piano::STATE);
        for key in 0..piano::KEYS {
            SENSED[at][key] = (&(*state).inputs)[key][piano::INPUT_X];
            DRIVEN[at][key] = (&(*state).outputs)[key][piano::OUTPUT_DRIVE];
        }
        addr_of_mut!(TICKS).write_volatile(tick.wrapping_add(1));
    }
}

/// Prepares the keys, then lets the slice count.
fn start() {
    // No interrupt ticks them yet.
    unsafe {
        read_sensors(0);
        piano::init(addr_of_mut!(piano::STATE));
    }
    let reset = pac::RESETS.reset();
    reset.modify(|w| w.set_pwm(false));
    while !pac::RESETS.reset_done().read().pwm() {}
    // Before the alarms of `embassy_time`; a tick then waits for critical sections alone.
    interrupt::TIMER0_IRQ_0.set_priority(Priority::P1);
    interrupt::PWM_IRQ_WRAP_0.set_priority(Priority::P0);
    unsafe { interrupt::PWM_IRQ_WRAP_0.enable() };
    let slice = pac::PWM.ch(SLICE);
    slice.top().write(|w| w.set_top((CYCLES_A_TICK - 1) as u16));
    pac::PWM.irq0_inte().modify(|w| w.0 |= 1 << SLICE);
    slice.csr().write(|w| w.set_en(true));
}

/// The serial port, for `write!`.
struct Port(UartTx<'static, Blocking>);

impl Write for Port {
    fn write_str(&mut self, text: &str) -> core::fmt::Result {
        self.0
            .blocking_write(text.as_bytes())
            .map_err(|_| core::fmt::Error)
    }
}

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let chip = embassy_rp::init(Default::default());
    let port = UartTx::new_blocking(chip.UART0, chip.PIN_0, Config::default());
    let mut port = Port(port);
    start();
    loop {
        // This task alone takes events.
        while let Some(event) = unsafe { piano::read_event(addr_of_mut!(piano::STATE)) } {
            let what = match event.event {
                piano::EVENT_NOTE => "note",
                _ => "release",
            };
            // A port that is not there is no reason to stop the keys.
            let _ = writeln!(port, "tick {}: key {}, {what}", event.tick, event.key);
        }
        Timer::after_millis(1).await;
    }
}
