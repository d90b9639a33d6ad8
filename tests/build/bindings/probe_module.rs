//! probe: 3 keys at 44100 ticks a second. Written by Whippen.
//!
//! Put this tick's sensor words into `inputs`, call `init` once and `tick` in every tick, and take the drive words
//! out of `outputs`. Link with the object file, or the compiled C, that came with this module.
#![allow(dead_code, non_snake_case)]

use core::ptr::{addr_of, addr_of_mut};

/// Keys.
pub const KEYS: usize = 3;
/// The number of the first key, from which events count.
pub const FIRST_KEY: u16 = 0;
/// Ticks per second.
pub const RATE_HZ: u32 = 44100;
/// Bytes of the state.
pub const STATE_BYTES: usize = 400;

/// Which word of a key is `x`.
pub const INPUT_X: usize = 0;
/// Value of one unit of `x`, in m.
pub const X_LSB_M: f64 = 1.678e-7;
/// Value of word 0 of `x`, in m.
pub const X_ZERO_M: f64 = -5e-4;

/// Which word of a key is `drive`.
pub const OUTPUT_DRIVE: usize = 0;
/// Value of one unit of `drive`, in N.
pub const DRIVE_LSB_N: f64 = 9.765625e-4;
/// Value of word 0 of `drive`, in N.
pub const DRIVE_ZERO_N: f64 = 0e0;

/// Smallest value of `weight`, in N.
pub const WEIGHT_MIN: fixed::FixedI32<fixed::types::extra::U30> = fixed::FixedI32::<fixed::types::extra::U30>::from_bits(-2147483648);

/// Largest value of `weight`, in N.
pub const WEIGHT_MAX: fixed::FixedI32<fixed::types::extra::U30> = fixed::FixedI32::<fixed::types::extra::U30>::from_bits(1073741824);

/// First value of `weight`, in N.
pub const WEIGHT_INIT: fixed::FixedI32<fixed::types::extra::U30> = fixed::FixedI32::<fixed::types::extra::U30>::from_bits(-7);

/// Smallest value of `slow`, in N*s/m.
pub const SLOW_MIN: i32 = 0;

/// Largest value of `slow`, in N*s/m.
pub const SLOW_MAX: i32 = 9;

/// First value of `slow`, in N*s/m.
pub const SLOW_INIT: i32 = 1;

/// First value of `Loud`, a switch.
pub const LOUD_INIT: bool = true;

/// Event `note`.
pub const EVENT_NOTE: u16 = 0;

/// Event `release`.
pub const EVENT_RELEASE: u16 = 1;

/// What happened to a key in a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Event {
    /// The tick, counted from 0.
    pub tick: u32,
    /// The key.
    pub key: u16,
    /// What: `EVENT_..`.
    pub event: u16,
    /// Its arguments.
    pub args: [i32; 1],
}

impl Event {
    /// `speed` of an event `note`, in m/s: argument 0.
    pub fn note_speed(&self) -> fixed::FixedI32<fixed::types::extra::U28> {
        fixed::FixedI32::<fixed::types::extra::U28>::from_bits(self.args[0])
    }
}

/// Memory of all keys. What is private belongs to the code.
#[repr(C)]
pub struct State {
    event_head: u32,
    event_tail: u32,
    events_lost: u32,
    tick: u32,
    private_16: [u32; 1],
    live_weight: i32,
    live_slow: i32,
    live_Loud: i32,
    private_32: [u32; 8],
    events: [i32; 64],
    /// Sensor words of this tick.
    pub inputs: [[u16; 1]; KEYS],
    private_326: [u8; 2],
    /// Drive words of this tick.
    pub outputs: [[i16; 1]; KEYS],
    private_334: [u8; 66],
}

const _: () = assert!(core::mem::size_of::<State>() == STATE_BYTES);
const _: () = assert!(core::mem::offset_of!(State, event_head) == 0);
const _: () = assert!(core::mem::offset_of!(State, event_tail) == 4);
const _: () = assert!(core::mem::offset_of!(State, events_lost) == 8);
const _: () = assert!(core::mem::offset_of!(State, tick) == 12);
const _: () = assert!(core::mem::offset_of!(State, live_weight) == 20);
const _: () = assert!(core::mem::offset_of!(State, live_slow) == 24);
const _: () = assert!(core::mem::offset_of!(State, live_Loud) == 28);
const _: () = assert!(core::mem::offset_of!(State, events) == 64);
const _: () = assert!(core::mem::offset_of!(State, inputs) == 320);
const _: () = assert!(core::mem::offset_of!(State, outputs) == 328);

unsafe extern "C" {
    /// All memory of the keys, with its values at the start.
    #[link_name = "probe_state"]
    pub static mut STATE: State;
    /// Prepares all keys for the first tick, whose words are in `inputs`.
    #[link_name = "probe_init"]
    pub fn init(state: *mut State);
    /// One tick of all keys: reads `inputs`, writes `outputs`.
    #[link_name = "probe_tick"]
    pub fn tick(state: *mut State);
}

/// A live value that was not set: it is out of its range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OutOfRange;

/// Sets `weight` from the next tick on.
///
/// # Errors
/// It is out of range; nothing is changed.
///
/// # Safety
/// `state` points to the state.
pub unsafe fn set_weight(state: *mut State, value: fixed::FixedI32<fixed::types::extra::U30>) -> Result<(), OutOfRange> {
    if !(WEIGHT_MIN..=WEIGHT_MAX).contains(&value) {
        return Err(OutOfRange);
    }
    unsafe { addr_of_mut!((*state).live_weight).write_volatile(value.to_bits()) };
    Ok(())
}

/// Sets `slow` from the next tick on.
///
/// # Errors
/// It is out of range; nothing is changed.
///
/// # Safety
/// `state` points to the state.
pub unsafe fn set_slow(state: *mut State, value: i32) -> Result<(), OutOfRange> {
    if !(SLOW_MIN..=SLOW_MAX).contains(&value) {
        return Err(OutOfRange);
    }
    unsafe { addr_of_mut!((*state).live_slow).write_volatile(value) };
    Ok(())
}

/// Sets `Loud` from the next tick on.
///
/// # Safety
/// `state` points to the state.
pub unsafe fn set_Loud(state: *mut State, value: bool) {
    unsafe { addr_of_mut!((*state).live_Loud).write_volatile(i32::from(value)) };
}

/// In `faults`: a tick was missed: all forces went to zero and came back.
pub const FAULT_MISSED: u32 = 1;

/// In `faults`: a sensor word stayed at a rail for 10 ms: its key went free.
pub const FAULT_RAIL: u32 = 2;

/// In `faults`: a sensor word stayed the same for 100 ms in mid-travel while the drive moved: its key went free.
pub const FAULT_FROZEN: u32 = 4;

/// In `faults`: a motor got too warm: its force was held at what it stands for ever.
pub const FAULT_HOT: u32 = 8;

/// What the safety of the keys tells.
#[repr(C)]
pub struct Safety {
    private_0: [u32; 7],
    /// It is the number of the last tick.
    pub tick: u32,
    private_32: [u32; 1],
    /// It is ticks that were missed.
    pub missed: u32,
    /// It is faults so far, a bit each.
    pub faults: u32,
    /// It is the key that went free last, counted from 0; -1 for none.
    pub faulty_key: i32,
    private_48: [u32; 4],
}

unsafe extern "C" {
    /// What the safety tells; read it volatile, write nothing.
    #[link_name = "probe_safety"]
    pub static mut SAFETY: Safety;
    /// Prepares all keys, whose first words are in `inputs`; forgets faults, and takes all force away.
    #[link_name = "probe_safe_init"]
    pub fn safe_init();
    /// One tick of all keys, in place of `tick`. `number` counts ticks by a clock of yours, not by calls: where it is not the
    /// one before and 1, a tick was missed, no key is ticked, and forces go to zero and come back.
    #[link_name = "probe_safe_tick"]
    pub fn safe_tick(number: u32);
}

/// Takes the oldest event. What found the ring full is counted, and lost.
///
/// # Safety
/// `state` points to the state, and nobody else takes events.
pub unsafe fn read_event(state: *mut State) -> Option<Event> {
    let mut tail = unsafe { addr_of!((*state).event_tail).read_volatile() };
    let head = unsafe { addr_of!((*state).event_head).read_volatile() };
    let at = |tail: u32| (tail % 256 / 4) as usize;
    if head != tail && unsafe { addr_of!((*state).events[at(tail) + 1]).read_volatile() } == -1 {
        // A mark, no event: the ring goes on at its beginning.
        tail = (tail | 255).wrapping_add(1);
        unsafe { addr_of_mut!((*state).event_tail).write_volatile(tail) };
    }
    if head == tail {
        return None;
    }
    let word = |offset: usize| unsafe { addr_of!((*state).events[at(tail) + offset]).read_volatile() };
    let what = word(1) as u32;
    let event = Event { tick: word(0) as u32, key: what as u16, event: (what >> 16) as u16, args: [word(2)] };
    unsafe { addr_of_mut!((*state).event_tail).write_volatile(tail.wrapping_add(16)) };
    Some(event)
}

/// How many events found the ring full.
///
/// # Safety
/// `state` points to the state.
pub unsafe fn events_lost(state: *const State) -> u32 {
    unsafe { addr_of!((*state).events_lost).read_volatile() }
}
