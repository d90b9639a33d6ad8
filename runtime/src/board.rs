//! Boards: which memory there is and what goes where, read from TOML files as devices are.
//!
//! A board file is all that a board of one's own needs. What the linker does with it is
//! `whippen_compiler::image`'s.

mod bench;
mod columns;
mod i2s;
mod knob;
mod known;

use std::path::Path;

use whippen_compiler::board::{AccessTime, BANKS_MAX, Bus};
use whippen_compiler::image::{Board, Memory, MemoryKind, Placement, Start};
use whippen_instruments::BOARDS as BUNDLED;
use whippen_isa::Arch;

pub use knob::knob_pins;
use known::KEYS;

use crate::entries::Entries;
use crate::files::{FileError, InputKind, read_text};

/// Cores by name, and their architectures.
const CORES: &[(&str, Arch)] = &[
    ("cortex-m0plus", Arch::V6M),
    ("cortex-m4", Arch::V7EM),
    ("cortex-m33", Arch::V8M),
];
/// What a chip may look for when it starts.
const STARTS: &[(&str, Start)] = &[
    ("vectors", Start::Vectors),
    ("image definition", Start::ImageDef),
    ("boot2", Start::Boot2),
];
/// What one access at a time may be said to take.
const CYCLES: &[(&str, u32)] = &[("cycle", 1), ("cycles", 1)];
const MILLIVOLTS: &[(&str, u32)] = &[("mV", 1), ("V", 1000)];
const SIZES: &[(&str, u32)] = &[("KiB", 1 << 10), ("MiB", 1 << 20), ("bytes", 1)];
const PORTS: &[(&str, bool)] = &[("1", false), ("2", true)];
const KINDS: &[(&str, MemoryKind)] = &[("flash", MemoryKind::Flash), ("ram", MemoryKind::Ram)];

/// The bundled board of that name, if there is one.
pub fn bundled(name: &str) -> Option<Board> {
    let (file, text) = BUNDLED
        .iter()
        .find(|(file, _)| file.strip_suffix(".toml") == Some(name))?;
    Some(read(Path::new(file), text).expect("bundled board files are correct"))
}

/// Reads a board file.
///
/// # Errors
/// The file cannot be read or is no TOML; a key is unknown or missing; a value is no string or
/// makes no sense; facts contradict each other ([`Board::contradiction`]); something is placed in a
/// memory that is not there. Each names the file, the line and the key.
pub fn load(path: &Path) -> Result<Board, FileError> {
    read(path, &read_text(path, InputKind::DESCRIPTION)?)
}

fn read(path: &Path, text: &str) -> Result<Board, FileError> {
    let entries = Entries::parse(path, text, KEYS)?;
    let mut banks = Vec::new();
    let memory = memories(&entries, &mut banks)?;
    let places = placements(&entries, &memory)?;
    let family = entries
        .find("uf2_family")
        .map(|_| address(&entries, "uf2_family"))
        .transpose()?;
    let board = Board {
        name: entries.text("name")?.to_string(),
        arch: one_of(&entries, "core", CORES)?,
        cores: cores(&entries)?,
        clock_hz: scaled(
            &entries,
            "clock",
            &[
                ("GHz", 1_000_000_000),
                ("MHz", 1_000_000),
                ("kHz", 1000),
                ("Hz", 1),
            ],
        )?,
        start: one_of(&entries, "start", STARTS)?,
        uf2_family: family,
        fetches_apart: one_of(&entries, "ports", PORTS)?,
        banks,
        memory,
        buses: buses(&entries)?,
        devices: devices(&entries)?,
        converter_interrupt: interrupt(&entries)?,
        stacks: stacks(&entries)?,
        places,
        knob: knob::knob(&entries)?,
        bench: bench::bench(&entries)?,
        columns: columns::columns(&entries)?,
        i2s: i2s::i2s(&entries)?,
    };
    match board.contradiction() {
        Some(wrong) => Err(entries.error(&wrong.key, &wrong.what)),
        None => Ok(board),
    }
}

/// The names of the tables of one kind, such as `memory`.
fn tables<'a>(entries: &'a Entries, kind: &str) -> Vec<&'a str> {
    let names = entries
        .all()
        .filter_map(|(key, _)| {
            let rest = key.strip_prefix(kind)?.strip_prefix('.')?;
            rest.rsplit_once('.')
        })
        .map(|(name, _)| name);
    let mut names: Vec<&str> = names.collect();
    names.sort_unstable();
    names.dedup();
    names
}

/// First address and bytes of a table.
fn range(entries: &Entries, table: &str) -> Result<(u32, u32), FileError> {
    let base = address(entries, &format!("{table}.base"))?;
    let key = format!("{table}.size");
    let size = scaled(entries, &key, SIZES)?;
    if base % 4 != 0 || size % 4 != 0 || size == 0 || base.checked_add(size).is_none() {
        return Err(entries.error(
            &key,
            "must be a multiple of 4, not zero, and end below 4 GiB",
        ));
    }
    Ok((base, size))
}

fn memories(entries: &Entries, banks: &mut Vec<String>) -> Result<Vec<Memory>, FileError> {
    let mut memory = Vec::new();
    for name in tables(entries, "memory") {
        let table = format!("memory.{name}");
        let (base, size) = range(entries, &table)?;
        memory.push(Memory {
            name: name.to_string(),
            base,
            size,
            kind: one_of(entries, &format!("{table}.kind"), KINDS)?,
            access: data_time(entries, &format!("{table}.access"))?,
            fetch: fetch_time(entries, &format!("{table}.fetch"))?,
            banks: banks_of(entries, &format!("{table}.banks"), banks)?,
            striped: is_striped(entries, &format!("{table}.stripe"))?,
        });
    }
    memory.sort_by_key(|memory| memory.base);
    Ok(memory)
}

/// How long a load or store takes.
fn data_time(entries: &Entries, key: &str) -> Result<AccessTime, FileError> {
    match entries.text(key)? {
        "not bounded" => Ok(AccessTime::NotBounded),
        _ => Ok(AccessTime::Cycles(cycles(entries, key)?)),
    }
}

/// How long a fetch takes: what is slower than a cycle has no bound.
fn fetch_time(entries: &Entries, key: &str) -> Result<AccessTime, FileError> {
    match entries.text(key)? {
        "1 cycle" => Ok(AccessTime::Cycles(1)),
        "not bounded" => Ok(AccessTime::NotBounded),
        "none" => Ok(AccessTime::Impossible),
        other => {
            let what = format!(
                "is `{other}`, but must be `1 cycle`, `not bounded` (also where it takes more than \
                 a cycle) or `none`"
            );
            Err(entries.error(key, &what))
        }
    }
}

/// Cycles of an access, at least 1.
fn cycles(entries: &Entries, key: &str) -> Result<u16, FileError> {
    let number = scaled(entries, key, CYCLES)?;
    let cycles = u16::try_from(number).ok().filter(|n| (1..=255).contains(n));
    cycles.ok_or_else(|| entries.error(key, "must be 1 to 255 cycles"))
}

/// The numbers of a memory's banks; names that are new are added to all of them.
fn banks_of(entries: &Entries, key: &str, banks: &mut Vec<String>) -> Result<Vec<u8>, FileError> {
    let mut own = Vec::new();
    for name in entries.find(key).unwrap_or_default().split_whitespace() {
        let known = banks.iter().position(|bank| bank == name);
        let number = known.unwrap_or_else(|| {
            banks.push(name.to_string());
            banks.len() - 1
        });
        let number = u8::try_from(number)
            .ok()
            .filter(|n| usize::from(*n) < BANKS_MAX);
        let Some(number) = number else {
            let what = format!("names more than {BANKS_MAX} banks in all");
            return Err(entries.error(key, &what));
        };
        if own.contains(&number) {
            return Err(entries.error(key, &format!("names `{name}` twice")));
        }
        own.push(number);
    }
    Ok(own)
}

/// Whether neighbouring words are in neighbouring banks.
fn is_striped(entries: &Entries, key: &str) -> Result<bool, FileError> {
    match entries.find(key) {
        None => Ok(false),
        Some("4 bytes") => Ok(true),
        Some(other) => {
            let what = format!(
                "is `{other}`, but must be `4 bytes`; without it banks lie one behind the other"
            );
            Err(entries.error(key, &what))
        }
    }
}

fn buses(entries: &Entries) -> Result<Vec<Bus>, FileError> {
    let mut buses = Vec::new();
    for name in tables(entries, "bus") {
        let table = format!("bus.{name}");
        let (base, size) = range(entries, &table)?;
        buses.push(Bus {
            name: name.to_string(),
            base,
            size,
            read_cycles: cycles(entries, &format!("{table}.read"))?,
            write_cycles: cycles(entries, &format!("{table}.write"))?,
        });
    }
    buses.sort_by_key(|bus| bus.base);
    Ok(buses)
}

fn devices(entries: &Entries) -> Result<Vec<(String, u32)>, FileError> {
    let keys = entries
        .all()
        .filter_map(|(key, _)| Some((key, key.strip_prefix("device.")?)));
    keys.map(|(key, name)| Ok((name.to_string(), address(entries, key)?)))
        .collect()
}

fn interrupt(entries: &Entries) -> Result<u32, FileError> {
    let key = "interrupt.converter";
    let value = entries.text(key)?;
    let number = value.parse().ok().filter(|number| *number < 480);
    number.ok_or_else(|| {
        entries.error(
            key,
            &format!("is `{value}`, but must be a number from 0 to 479"),
        )
    })
}

/// Where stacks end, by core.
fn stacks(entries: &Entries) -> Result<Vec<u32>, FileError> {
    let words = entries.text("stacks")?.split_whitespace();
    words
        .map(|word| {
            hexadecimal(word).ok_or_else(|| {
                let what = format!(
                    "has `{word}`, but must be the end of each core's stack, as in `0x20081000`"
                );
                entries.error("stacks", &what)
            })
        })
        .collect()
}

fn placements(entries: &Entries, memory: &[Memory]) -> Result<Vec<Placement>, FileError> {
    let places = entries
        .all()
        .filter_map(|(key, value)| Some((key, key.strip_prefix("place.")?, value)));
    let place = |(key, pattern, value): (&str, &str, &str)| {
        if memory.iter().all(|memory| memory.name != value) {
            let names: Vec<&str> = memory.iter().map(|memory| memory.name.as_str()).collect();
            let what = format!(
                "is `{value}`, but there is no such memory; there are: {}",
                names.join(", ")
            );
            return Err(entries.error(key, &what));
        }
        Ok(Placement {
            pattern: pattern.to_string(),
            memory: value.to_string(),
        })
    };
    places.map(place).collect()
}

fn one_of<T: Copy>(entries: &Entries, key: &str, all: &[(&str, T)]) -> Result<T, FileError> {
    let value = entries.text(key)?;
    let found = all.iter().find(|(name, _)| *name == value);
    found.map(|(_, meaning)| *meaning).ok_or_else(|| {
        let names: Vec<String> = all.iter().map(|(name, _)| format!("`{name}`")).collect();
        entries.error(
            key,
            &format!("is `{value}`, but must be one of {}", names.join(", ")),
        )
    })
}

fn cores(entries: &Entries) -> Result<u32, FileError> {
    let value = entries.text("cores")?;
    let count = value.parse().ok().filter(|cores| (1..=8).contains(cores));
    count.ok_or_else(|| {
        entries.error(
            "cores",
            &format!("is `{value}`, but must be a number from 1 to 8"),
        )
    })
}

/// A hexadecimal number.
fn address(entries: &Entries, key: &str) -> Result<u32, FileError> {
    let value = entries.text(key)?;
    hexadecimal(value).ok_or_else(|| {
        entries.error(
            key,
            &format!("is `{value}`, but must be a number such as `0x20000000`"),
        )
    })
}

fn hexadecimal(text: &str) -> Option<u32> {
    let digits = text.strip_prefix("0x")?.replace('_', "");
    u32::from_str_radix(&digits, 16).ok()
}

/// A whole number with one of these units.
fn scaled(entries: &Entries, key: &str, units: &[(&str, u32)]) -> Result<u32, FileError> {
    let value = entries.text(key)?;
    let parts = value.split_once(' ');
    let unit = parts.and_then(|(_, unit)| units.iter().find(|(name, _)| *name == unit));
    let number = parts
        .zip(unit)
        .and_then(|((number, _), (_, scale))| number.parse::<u32>().ok()?.checked_mul(*scale));
    number.ok_or_else(|| {
        let names: Vec<&str> = units.iter().map(|(name, _)| *name).collect();
        entries.error(
            key,
            &format!(
                "is `{value}`, but must be a whole number of {}",
                names.join(", ")
            ),
        )
    })
}

/// A whole number.
fn whole(entries: &Entries, key: &str, text: &str) -> Result<u32, FileError> {
    let what = || format!("has `{text}`, but must be a whole number");
    text.parse().map_err(|_| entries.error(key, &what()))
}

/// Whole numbers, with spaces between them.
fn wholes(entries: &Entries, key: &str) -> Result<Vec<u32>, FileError> {
    let words = entries.text(key)?.split_whitespace();
    words.map(|word| whole(entries, key, word)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bundled_boards_have_a_place_for_everything() {
        for name in whippen_compiler::bundled::boards() {
            let board = bundled(name).expect("bundled");
            assert_eq!(board.name, name);
            for section in [
                ".vectors",
                ".copy_table",
                ".text.start",
                ".text.piano",
                ".rodata",
                ".data.piano",
                ".bss",
            ] {
                assert!(board.memory_for(section).is_some(), "{name}: {section}");
            }
        }
        let board = bundled("rp2350").expect("bundled");
        let memory = |section: &str| board.memory_for(section).map(|memory| memory.name.as_str());
        assert_eq!(
            [memory(".text.core0"), memory(".text.core1.piano")],
            [Some("sram0"), Some("sram4")]
        );
        assert_eq!(
            [memory(".vectors"), memory(".vectors2"), memory(".note")],
            [Some("flash"), None, None]
        );
    }

    #[test]
    fn keyboards_may_name_what_is_bundled() {
        for device in whippen_compiler::bundled::devices() {
            assert!(crate::device::Device::bundled(device).is_some(), "{device}");
        }
    }

    /// A sector that is none, and one in which an image may lie.
    #[test]
    fn what_a_knob_keeps_lies_behind_the_image() {
        let knob = BUNDLED.iter().find(|(name, _)| *name == "pico2_knob.toml");
        let text = knob.expect("bundled").1;
        let own = |to: &str| read(Path::new("own.toml"), &text.replace("0x103ff000", to));
        assert!(own("0x103ff000").is_ok() && own("0x10fff000").is_ok());
        let told = ["0x103fe000", "0x103ff800", "0x20000000"].map(|to| {
            let wrong = own(to).expect_err(to);
            wrong.to_string()
        });
        assert!(
            told[0].contains("lies inside `memory.flash`"),
            "{}",
            told[0]
        );
        assert!(
            told[1..]
                .iter()
                .all(|text| text.contains("sector of flash"))
        );
    }

    #[test]
    fn mistakes_are_named_with_their_place() {
        let good = BUNDLED[0].1;
        let changed = |from: &str, to: &str| {
            assert!(good.contains(from), "{from}");
            read(Path::new("own.toml"), &good.replacen(from, to, 1))
                .expect_err(to)
                .to_string()
        };
        let messages = [
            changed("cores =", "core5 ="),
            changed("[memory.flash]\nbase", "[memory.flash]\nbsae"),
            changed("\"cortex-m33\"", "\"cortex-m7\""),
            changed("cores = \"2\"", "cores = \"0\""),
            changed("150 MHz", "150 mhz"),
            changed("150 MHz", "150000 MHz"),
            changed("\"image definition\"", "\"picobin\""),
            changed("0xe48bff59", "e48bff59"),
            changed("\"256 KiB\"", "\"256 kB\""),
            changed("\"256 KiB\"", "\"2 bytes\""),
            changed("\"256 KiB\"", "\"257 KiB\""),
            changed("kind = \"flash\"", "kind = \"rom\""),
            changed("\".data*\"         = \"sram0\"", "\".data*\" = \"sram5\""),
            changed("name  = \"rp2350\"", ""),
        ];
        insta::assert_snapshot!(messages.join("\n"));
    }
}
