//! The layout of what firmware and readers share: words of a core's block, of a key's guard, of the
//! tables of programs; and the faults. One table each, from which the texts get their constants and
//! readers in Rust their numbers; `docs/firmware.md` shows what users may read.

use std::collections::BTreeMap;

use super::monitor;

/// Offsets in bytes: a module of constants for readers, and the names that the texts know them by.
macro_rules! offsets {
    ($($(#[$doc:meta])* $module:ident, $prefix:literal {
        $($name:ident = $at:literal, $what:literal;)*
    })*) => {$(
        $(#[$doc])*
        pub mod $module {
            $(#[doc = $what] pub const $name: u32 = $at;)*

            /// All of them, by their names in the texts.
            pub const ALL: &[(&str, u32)] =
                &[$((concat!($prefix, stringify!($name)), $name),)*];
        }
    )*};
}

offsets! {
    /// Offsets in a core's block (bytes).
    core_block, "C_" {
        CODE = 0, "The tick of the program that plays.";
        STATE = 4, "The state of its keys.";
        ROWS = 8, "Both rows of the converter's words.";
        KEYS = 16, "How many keys the core has.";
        GAINS = 20, "The gain of its first key, or its table of records where it has zones.";
        GUARDS = 24, "The guard of its first key.";
        TICK = 28, "The number of the last tick.";
        ALARM = 32, "The alarm as it was seen last.";
        MISSED = 36, "Ticks that were missed.";
        FAULTS = 40, "Faults so far, a bit each: [`FAULTS`](super::FAULTS).";
        FAULTY = 44, "The key of the last fault.";
        TURN = 48, "Which key's service is next.";
        FIRST = 52, "MIDI number of the first key.";
        ROW = 56, "The row of the tick that is served.";
        RAMP = 60, "Ticks for which force still comes up.";
        PROGRAM = 64, "The descriptor of the program that plays.";
        WANTED = 68, "The descriptor of the program that is to play.";
        BEGUN = 72, "How many keys of it have begun.";
        LATCH = 76, "The tick of a live value that is set.";
        WHERE = 80, "Its word on this core.";
        VALUE = 84, "The value.";
        CLIPPED = 88, "Samples of all keys together that were beyond full scale.";
        PIECE = 92, "The piece of memory that is emptied.";
        SLOT = 96, "How far it is; 0 where all are empty.";
    }
    /// Offsets in a key's guard (bytes).
    key_guard, "G_" {
        HEAT = 0, "The heat of its motor.";
        CEILING = 4, "The most that its gain may be.";
        WORD = 8, "The sensor word that has not changed.";
        DRIVE = 10, "The drive word of that time.";
        SINCE = 12, "For how many ticks it has not.";
    }
    /// Offsets in the descriptor of a core's program (bytes).
    descriptor, "P_" {
        CORE = 0, "The core's block.";
        STATE = 4, "The state of its keys.";
        INIT = 8, "What prepares them.";
        TICK = 12, "Their tick.";
        BEGIN = 16, "What prepares one of them.";
        GAINS = 20, "The gain of the first key, or the table of records.";
        RECORDS = 24, "The record of the first key.";
        END = 28, "Behind the record of the last key.";
        READER = 32, "What the reader of its events knows.";
        SOUND = 36, "Where each key's samples are.";
        LINES = 40, "The pieces of memory that are emptied before it begins.";
    }
    /// Offsets in what the reader of a zone's events knows (bytes).
    reader, "R_" {
        STATE = 0, "The state of the zone.";
        EVENTS = 4, "Its ring of events.";
        EVENT = 8, "Bytes of an event.";
        NOTE = 12, "The number of the event that is a note.";
        RELEASE = 16, "The number of the event that ends one.";
        SHIFT = 20, "How far a speed is shifted right.";
        VELOCITIES = 24, "Velocities by speed.";
        MASK = 28, "Bytes of the ring, less 1.";
        RELEASE_SHIFT = 32, "How far the speed of a release is shifted right.";
        RELEASE_VELOCITIES = 36, "Velocities by that; 0 where a release has no speed.";
        NEXT = 40, "The reader of the next zone.";
    }
    /// Offsets in what is kept of MIDI that goes on to the next chip (bytes).
    passed, "PASSED_" {
        FIRST = 0, "The first byte of data of a message.";
        AHEAD = 4, "A control change 88 that waits for its message; 0 for none.";
        HEAD = 8, "How many messages went into the ring.";
        LOST = 12, "How many found no room.";
        RING = 16, "The ring.";
    }
    /// Offsets in what the firmware of a knob keeps (bytes).
    knob_block, "K_" {
        TICK = 0, "The number of the last word.";
        FRAME_ANGLE = 4, "The angle of the last word that was right, of 16384 a turn.";
        POSITION = 8, "How far it has turned since the start, in those.";
        SPEED = 12, "How fast, in 1/1024 of those a tick, over 64 ticks.";
        LIMIT = 16, "The most that it may turn in a tick.";
        AGE = 20, "Words in a row that were wrong.";
        WRONG = 24, "Words that were wrong so far.";
        TURN = 28, "Electrical angle of a step of the sensor, of 65536 a turn; its sign is the direction.";
        OFFSET = 32, "Electrical angle of the force that is against its angle 0.";
        DRIVE = 36, "The drive word of the tick before.";
        GAIN = 40, "Voltage of a drive word.";
        LEAD = 44, "Voltage of a drive word's change.";
        BACK = 48, "Voltage of the speed.";
    }
    /// Offsets in what the monitor captures of a core (bytes); from SETTING on they are set by a
    /// request.
    captured, "V_" {
        NEXT = 0, "Where the next row goes; 0 while nothing is captured.";
        STOP = 4, "The number of the tick whose row is the last one.";
        AT = 8, "The number of the tick of the trigger.";
        HALT = 12, "The number of the tick in which the capture before was ended, then of the one before its first row.";
        START = 16, "The first row of the ring.";
        END = 20, "Behind its last one.";
        LAST = 24, "Behind the row that was written last, once it is over.";
        SETTING = 28, "The first word of the setting.";
        STRIDE = 28, "From a row to the next.";
        CELLS_AT = 32, "From a row to its words of memory.";
        BYTES = 36, "The size of the ring.";
        KEYS = 40, "From the row of the converter's words to the sensor words of four keys.";
        CELLS = 56, "The addresses of four words of memory.";
        MODE = 72, "What it waits for: 0 for somebody else, 1 for a word below its level, 2 for one over it, 3 for its end.";
        WORD = 76, "From a row to that word.";
        SHIFT = 80, "How far it is shifted left.";
        FLIP = 84, "What it is then combined with by exclusive or.";
        LEVEL = 88, "The level, to which it is compared without a sign.";
        POST = 92, "Ticks from the trigger to the last row.";
        EVENT = 96, "The event that triggers it, in the upper half, of the key in the lower; 0xffff for any key, or for none.";
        GROUP = 100, "The same number for captures that have one trigger, not 0.";
        BLOCK = 104, "Behind its last word.";
    }
    /// Offsets in what the firmware of a bench or of columns keeps (bytes).
    bench_block, "B_" {
        AT = 0, "Where the DMA had come to in the last tick that had new words.";
        TICK = 4, "The number of the last tick.";
        AGE = 8, "Ticks in a row without words that are new and whole.";
        CURRENTS = 16, "The current that each coil has at the end of the tick, in drive words.";
    }
    /// Offsets in what the cores of columns say to each other (bytes).
    columns_handed, "D_" {
        NEXT = 0, "By core 0: the number of the next tick.";
        AT = 4, "Where the DMA comes to before its words.";
        HALF = 8, "The half of words for DACs that it writes, 0 or 32.";
        OWN_HALF = 12, "The half that core 1 writes in its tick.";
        AGE = 16, "Ticks in a row in which nothing new was said.";
        DONE = 20, "By core 1: the number of the last tick that it has finished.";
    }
    /// Offsets in the table of the status (bytes).
    status, "S_" {
        FAULTS = 8, "Faults of the processor.";
    }
}

/// Something that went wrong on a board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fault {
    /// Its bit in the words of faults.
    pub bit: u32,
    /// What the texts call the bit.
    name: &'static str,
    /// What happened and what followed.
    pub what: &'static str,
}

impl Fault {
    /// What C calls it, behind the keys' prefix: as in `FAULT_RAIL`.
    pub fn name(&self) -> &'static str {
        self.name
    }
}

/// All faults, by their bits.
pub const FAULTS: &[Fault] = &[
    Fault {
        bit: 1,
        name: "FAULT_MISSED",
        what: "a tick was missed: all forces went to zero and came back",
    },
    Fault {
        bit: 2,
        name: "FAULT_RAIL",
        what: "a sensor word stayed at a rail for 10 ms: its key went free",
    },
    Fault {
        bit: 4,
        name: "FAULT_FROZEN",
        what: "a sensor word stayed the same for 100 ms in mid-travel while the drive moved: \
               its key went free",
    },
    Fault {
        bit: 8,
        name: "FAULT_HOT",
        what: "a motor got too warm: its force was held at what it stands for ever",
    },
    Fault {
        bit: 16,
        name: "FAULT_DEAD",
        what: "the processor met a fault: all forces stay zero",
    },
    Fault {
        bit: 32,
        name: "FAULT_DRIVER",
        what: "a driver told of a fault, a knob's, a bridge or an amplifier: it is disabled until the \
               next start, and so are all bridges and amplifiers",
    },
    Fault {
        bit: 64,
        name: "FAULT_SENSOR",
        what: "a knob's sensor had no magnet, or no word that can be for 10 ms, or an ADC \
               of keys had no words for 10 ms, or DACs got none in eight ticks, as a core stood \
               still: drivers are disabled until the next start",
    },
    Fault {
        bit: 128,
        name: "FAULT_ALIGN",
        what: "a knob's motor did not turn as its field did at the start: its driver stays \
               disabled",
    },
];

/// After how long without a sign of life the watchdog starts the board again.
const WATCHDOG_US: u32 = 10_000;

/// All of these for the texts.
pub(super) fn assembly_constants() -> BTreeMap<String, i64> {
    let tables = [
        core_block::ALL,
        key_guard::ALL,
        descriptor::ALL,
        reader::ALL,
        status::ALL,
        captured::ALL,
        passed::ALL,
        knob_block::ALL,
        bench_block::ALL,
        columns_handed::ALL,
        &[("WATCHDOG_US", WATCHDOG_US)],
        monitor::CONSTANTS,
    ];
    let offsets = tables.into_iter().flatten().copied();
    let faults = FAULTS.iter().map(|fault| (fault.name, fault.bit));
    offsets
        .chain(faults)
        .map(|(name, value)| (name.to_string(), value.into()))
        .collect()
}
