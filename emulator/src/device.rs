//! The devices of the boards: what a bare-metal image of an RP2350, RP2040 or STM32F407 finds
//! beside memory, and the converter.
//!
//! ```text
//!   registers   blocks that only hold what is written, with the status bits that start-up code polls (tables)
//!   busctrl     priorities at the ports of memory
//!   clocks      sources of clk_ref and clk_sys, and how they are switched; which blocks leave their reset
//!   iobank      which function has a pin, and what its pad does
//!   sio         core number, mailbox between cores, spinlocks, doorbells, pins; the divider of RP2040
//!   timer       microseconds and four alarms        power   switching core 1 off and on, the watchdog
//!   uart        PL011, or an STM32's: bytes         dma     channels, paced by requests
//!   pio         state machines on pins
//!   pwm         slices that count and compare
//!   qmi         bytes to the flash chip and back
//!   adc         samples of pins
//!   iwdg        the watchdog of an STM32
//!   converter   sensor words of N keys in, drive words out, once per tick
//! ```
//!
//! Time is cycles of the system clock, which the board fixes: registers of clocks and dividers are
//! kept and answered, and make the watchdog's ticks, but do not change how long a cycle is.

pub(crate) mod adc;
pub(crate) mod alias;
pub(crate) mod bootram;
pub(crate) mod busctrl;
pub(crate) mod clocks;
pub mod converter;
pub(crate) mod dma;
pub(crate) mod iobank;
pub(crate) mod iwdg;
pub(crate) mod pio;
pub(crate) mod power;
pub(crate) mod pwm;
pub(crate) mod qmi;
pub(crate) mod registers;
pub(crate) mod sio;
pub(crate) mod timer;
pub(crate) mod uart;
