//! What runs on the cores while they play: the table that comes with the texts, for who bounds
//! their cycles.
//!
//! Loop bounds and targets of indirect branches stand in the texts themselves (`@! rounds`, `@!
//! targets`).

/// One core, by the names in the texts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Running {
    /// The handler of the converter's interrupt, the only one that comes.
    pub handler: &'static str,
    /// What runs between ticks.
    pub idle: &'static str,
    /// The table of vectors that is used while the core plays.
    pub vectors: &'static str,
    /// The converter's words of its keys.
    pub words: &'static str,
    /// What the other core reads and writes between two of its ticks in memory that is otherwise
    /// this core's (words). Core 1 at core 0's: the program that plays and its reader, the first
    /// key, head and tail of the ring, two words of an event, the tail anew, so eight a round, two
    /// rounds (the second one finds WFE without an event); the alarm, twice in each of two ticks.
    /// Core 0 at core 1's: the number of its tick, two words for another program, two rounds. What
    /// only some images have comes to that
    /// ([`FirmwareImage::visits`](super::FirmwareImage::visits)).
    pub visits: u32,
    /// What comes to that where MIDI is passed on, in two rounds. Core 1 at core 0's: how far the
    /// ring is filled, two messages. Core 0 at core 1's: how far it is sent.
    pub visits_passing: u32,
    /// The same in an image with the monitor. Core 1 at core 0's: the program that plays and its
    /// reader, head, tail and a word of an event, the tail anew, the event that triggers, and then
    /// the capture (whether it goes on and waits, the tick, how long, when and until when, that it
    /// has its trigger), so fourteen a round, two rounds; the alarm. Core 0 at core 1's: the number
    /// of its tick; of its capture the group, what it waits for, whether it runs, and its trigger
    /// (three words); at most nine words of a request (the start of a capture; four that are read
    /// or set), two rounds.
    pub visits_monitored: u32,
}

/// Both cores.
pub const RUNNING: [Running; 2] = [
    Running {
        handler: "tick_core0",
        idle: "idle0",
        vectors: "vectors0",
        words: "words0",
        visits: 20,
        visits_passing: 6,
        visits_monitored: 32,
    },
    Running {
        handler: "tick_core1",
        idle: "idle1",
        vectors: "vectors1",
        words: "words1",
        visits: 6,
        visits_passing: 2,
        visits_monitored: 32,
    },
];

/// Where all other vectors lead: no forces, and the end.
pub const DEAD: &str = "dead";

/// The part of the handler in which a program begins: it ticks the keys that have begun, never all,
/// and one more begins.
pub const BEGINS: &str = "a program that begins";

/// The parts of the handler, by the symbols that begin them.
pub const PARTS: &[(&str, &str)] = &[
    ("tick_core0", "which tick, which words"),
    ("tick_core1", "which tick, which words"),
    ("latch", "a live value that is set"),
    ("send_sound", "what is heard, of all keys"),
    ("sum_sound", "what is heard, of this core"),
    ("missed", "after a missed tick"),
    ("beginning", BEGINS),
    ("chain_to", BEGINS),
    ("emptying", BEGINS),
    ("capture", "the monitor's capture"),
    ("linearise", "sensors through their calibration"),
    ("watch", "sensors that are tuned"),
    ("forget", "sensors that are tuned"),
    ("service", "heat and gain of every 16th key"),
    ("passivity", "energy of every key"),
    ("guard", "sensor and limits of one key"),
    ("ports", "heat and sensor of one port, gain of all"),
    ("board_begin", "board_begin"),
    ("board_end", "board_end"),
];

/// Who uses a section while the cores play.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Owner {
    /// One core alone, but for visits.
    Core(usize),
    /// Nobody: it belongs to the start.
    Start,
}

/// Who uses a section, by its name.
pub fn owner(section: &str) -> Owner {
    // The keys of further programs are in sections like `.text.core1_2`.
    let has = |part: &str| {
        section
            .split('.')
            .any(|own| own.split('_').next() == Some(part))
    };
    match () {
        () if section.starts_with(".text.start") || !section.starts_with(['.']) => Owner::Start,
        () if ["vectors", "exceptions"]
            .iter()
            .any(|end| section.ends_with(end))
            || [".boot2", ".image_def", ".copy_table", ".zero_table"].contains(&section) =>
        {
            Owner::Start
        }
        () => Owner::Core(usize::from(has("core1"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_section_has_its_owner() {
        let owners = [
            ".text.core0",
            ".data.core1_2",
            ".text.core1.frame",
            ".bss.ledger",
            ".data.near.core1_2",
        ]
        .map(owner);
        assert_eq!(owners, [0, 1, 1, 0, 1].map(Owner::Core));
        assert_eq!(
            [".text.start", ".vectors", ".copy_table"].map(owner),
            [Owner::Start; 3]
        );
    }
}
