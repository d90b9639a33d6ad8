//! Contradictions in the description of a board: what no board can be.
//!
//! Whether a description is true of a chip cannot be seen here; that its facts fit together can.

use whippen_isa::Arch;

use crate::{AccessTime, Board, MemoryKind, Start, Target};

/// A fact that contradicts another one, by the key of the board's file that says it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Contradiction {
    /// The key.
    pub key: String,
    /// What is wrong with it, and what to write.
    pub what: String,
}

/// A run of addresses with its key.
struct Range {
    key: String,
    base: u32,
    size: u32,
}

impl Board {
    /// The first contradiction, if there is one.
    pub fn contradiction(&self) -> Option<Contradiction> {
        self.overlapping()
            .or_else(|| self.ports_of_core())
            .or_else(|| self.banks_that_do_not_cover())
            .or_else(|| self.fetches_over_the_data_bus())
            .or_else(|| self.stacks_outside())
            .or_else(|| self.devices_outside())
            .or_else(|| self.start_outside_flash())
            .or_else(|| self.knob_that_cannot_be())
            .or_else(|| self.bench_that_cannot_be())
            .or_else(|| self.columns_that_cannot_be())
            .or_else(|| self.sound_that_cannot_be())
    }

    /// Memories and buses that share addresses.
    fn overlapping(&self) -> Option<Contradiction> {
        let memories = self.memory.iter().map(|memory| Range {
            key: format!("memory.{}", memory.name),
            base: memory.base,
            size: memory.size,
        });
        let buses = self.buses.iter().map(|bus| Range {
            key: format!("bus.{}", bus.name),
            base: bus.base,
            size: bus.size,
        });
        let mut ranges: Vec<Range> = memories.chain(buses).collect();
        ranges.sort_by_key(|range| range.base);
        let pair = ranges
            .windows(2)
            .find(|pair| pair[1].base - pair[0].base < pair[0].size)?;
        Some(Contradiction {
            key: format!("{}.base", pair[1].key),
            what: format!("lies inside `{}`", pair[0].key),
        })
    }

    /// A core that cannot have the ports that it is said to have.
    fn ports_of_core(&self) -> Option<Contradiction> {
        let has_two = self.arch != Arch::V6M;
        (self.fetches_apart != has_two).then(|| Contradiction {
            key: "ports".into(),
            what: if has_two {
                "is `1`, but this core fetches and accesses data through one port each: write `2`"
                    .into()
            } else {
                "is `2`, but this core fetches and accesses data through one port: write `1`".into()
            },
        })
    }

    /// Banks that are missing, more than there can be, or of different sizes.
    fn banks_that_do_not_cover(&self) -> Option<Contradiction> {
        self.memory.iter().find_map(|memory| {
            let bounded = memory.access.extra_cycles().is_some();
            let what = match memory.banks.len() as u32 {
                0 if bounded => {
                    "is missing: name the banks that serve this memory, as in `banks = \"SRAM0\"`"
                        .to_string()
                }
                0 => return None,
                _ if !bounded => "is of use only where `access` is a number of cycles".into(),
                count if !memory.size.is_multiple_of(4 * count) => format!(
                    "names {count} banks, which do not cover {} bytes in equal parts",
                    memory.size
                ),
                _ => return None,
            };
            let key = format!("memory.{}.banks", memory.name);
            Some(Contradiction { key, what })
        })
    }

    /// A Cortex-M4 fetches at full speed only below 0x20000000, where it has a bus for that.
    fn fetches_over_the_data_bus(&self) -> Option<Contradiction> {
        let fast = |memory: &&crate::Memory| {
            matches!(memory.fetch, AccessTime::Cycles(_)) && memory.base >= 0x2000_0000
        };
        let memory = self.memory.iter().find(fast)?;
        (self.arch == Arch::V7EM).then(|| Contradiction {
            key: format!("memory.{}.fetch", memory.name),
            what:
                "must be `not bounded`: from 0x20000000 on a Cortex-M4 fetches over the bus of its \
                   data; give the address below at which the chip shows this memory, if it does"
                    .into(),
        })
    }

    /// Stacks that do not end in RAM whose time is known.
    fn stacks_outside(&self) -> Option<Contradiction> {
        let contradiction = |what: String| {
            let key = "stacks".into();
            Some(Contradiction { key, what })
        };
        if self.stacks.len() != self.cores as usize {
            return contradiction(format!(
                "lists {}, and `cores` is {}: give the end of one stack for each core",
                self.stacks.len(),
                self.cores
            ));
        }
        let twice = |(at, end): &(usize, &u32)| self.stacks[..*at].contains(end);
        if let Some((_, end)) = self.stacks.iter().enumerate().find(twice) {
            return contradiction(format!(
                "has {end:#010x} twice: each core needs a stack of its own"
            ));
        }
        self.stacks.iter().find_map(|&end| {
            let memory = end.checked_sub(4).and_then(|top| self.memory_at(top));
            match memory {
                _ if end % 8 != 0 => contradiction(format!("{end:#010x} is no multiple of 8")),
                None => contradiction(format!("{end:#010x} is at the end of no memory's word")),
                Some(memory) if memory.kind != MemoryKind::Ram => contradiction(format!(
                    "{end:#010x} is in `{}`, which is no RAM",
                    memory.name
                )),
                Some(memory) if memory.access.extra_cycles().is_none() => contradiction(format!(
                    "{end:#010x} is in `{}`, whose `access` is not bounded",
                    memory.name
                )),
                Some(_) => None,
            }
        })
    }

    /// What runs or is read before RAM has its contents, and is placed there.
    fn start_outside_flash(&self) -> Option<Contradiction> {
        let flash = self.flash()?;
        let early = [".vectors", ".text.start", ".copy_table", ".zero_table"];
        let of_start = match self.start {
            Start::Vectors => None,
            Start::ImageDef => Some(".image_def"),
            Start::Boot2 => Some(".boot2"),
        };
        let in_ram = |section: &&str| {
            let memory = self.memory_for(section);
            memory.is_some_and(|memory| memory.kind != MemoryKind::Flash)
        };
        let section = early.into_iter().chain(of_start).find(|own| in_ram(own))?;
        Some(Contradiction {
            key: "place".into(),
            what: format!(
                "puts `{section}` into RAM, which is empty when the chip starts: put it into `{}`",
                flash.name
            ),
        })
    }

    /// Devices that are on no bus.
    fn devices_outside(&self) -> Option<Contradiction> {
        let outside = |(_, at): &&(String, u32)| !matches!(self.target(*at), Target::Bus(_));
        let (name, at) = self.devices.iter().find(outside)?;
        Some(Contradiction {
            key: format!("device.{name}"),
            what: format!(
                "is at {at:#010x}, on no bus: describe it, as in `[bus.apb]` with `base`, `size`, \
                 `read` and `write`"
            ),
        })
    }
}
