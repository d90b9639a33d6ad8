//! Who waits for whom at the ports of memory: the bus fabric of RP2350 and RP2040 (datasheets
//! 2.1.1).
//!
//! ```text
//!   core 0: fetch, data    core 1: fetch, data    DMA: read, write
//!        \______\___________/______/____________/______/   each bank serves one access a cycle
//!     SRAM0 SRAM1 SRAM2 SRAM3   SRAM4 ..   striped by word     SRAM8   SRAM9   flash   ROM
//! ```
//!
//! An access to a bank that somebody else uses in its cycle comes one cycle later. Of two at once
//! the one of higher priority (BUS_PRIORITY) goes first; of equals the one that did not wait last,
//! which follows from the one that waited holding the bank in the next cycle. Where the phase of
//! the chips' round robin begins is not documented, and a core's fetches are taken to run two words
//! ahead and never to make it wait, so what is counted here is a rule and no published count.
//!
//! A core's own fetches against its own data are counted only at the worst
//! ([`Fabric::meets_fetches`]; the timing document says why).
//!
//! Peripherals are behind bridges, each a port that an access holds for several cycles. There
//! nothing under way is pre-empted, and priorities are another manager's (erratum RP2350-E27).

/// Managers: two per core, then the reads and the writes of the DMA.
const CORES: usize = 2;
const DMA: usize = 2 * CORES;
const MANAGERS: usize = DMA + 2;

/// Where the words are that may be fetched, from the one that was fetched last, which is two words
/// ahead: nobody says how far a core does.
const AHEAD: [u32; 5] = [0_u32.wrapping_sub(8), 0_u32.wrapping_sub(4), 0, 4, 8];

/// Memory that is one port, or several striped by word. Memories may have ports in common.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Banks {
    /// First address.
    pub base: u32,
    /// Size.
    pub bytes: u32,
    /// The number of its first port.
    pub first_port: u32,
    /// How many ports: word n is in port n modulo this, from the first one on.
    pub ports: u32,
}

impl Banks {
    /// The port of an address, if it is here.
    pub fn port(&self, address: u32) -> Option<usize> {
        let offset = address.wrapping_sub(self.base);
        (offset < self.bytes).then(|| (self.first_port + offset / 4 % self.ports) as usize)
    }
}

/// Addresses behind a bridge to peripherals, and for how many cycles an access holds its port. Of
/// several that an address is in the first counts.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Bridge {
    pub base: u32,
    pub bytes: u32,
    /// Which bridge, from 0.
    pub number: usize,
    pub read: u64,
    pub write: u64,
}

impl Bridge {
    fn contains(&self, address: u32) -> bool {
        address.wrapping_sub(self.base) < self.bytes
    }
}

/// What the last access to a port was.
#[derive(Clone, Copy, Default)]
struct Port {
    /// Its first cycle, and the one after it.
    began: u64,
    free: u64,
    manager: usize,
}

/// An access to a port.
#[derive(Clone, Copy)]
struct Claim {
    manager: usize,
    port: usize,
    cycle: u64,
    /// For how long it holds the port.
    cycles: u64,
}

/// See the module.
#[derive(Default)]
pub(crate) struct Fabric {
    banks: Vec<Banks>,
    bridges: Vec<Bridge>,
    /// Of all banks, then of the bridges.
    ports: Vec<Port>,
    /// The first bridge's.
    first_bridge: usize,
    /// Whether each manager has high priority: at banks, and at bridges.
    high: [[bool; MANAGERS]; 2],
    /// Cycles that a manager lost to one of higher priority after it had been let through.
    owed: [u64; MANAGERS],
    /// The word that each core fetched last.
    fetched: [u32; CORES],
    /// Whether a core's data wait a cycle in the bank of one of the next words of its code: the
    /// most that the sources leave open.
    pub meets_fetches: bool,
    /// Whether a DMA is at work.
    pub dma: bool,
    /// Cycles beyond the first that accesses of the DMA took since somebody asked.
    dma_cycles: u64,
    /// Cycles that cores' data waited for others, at banks and at bridges.
    pub waited: [u64; 2],
}

impl Fabric {
    pub fn new(banks: &[Banks]) -> Self {
        let ends = banks.iter().map(|b| (b.first_port + b.ports) as usize);
        Self {
            banks: banks.to_vec(),
            ports: vec![Port::default(); ends.max().unwrap_or(0)],
            ..Self::default()
        }
    }

    /// Bridges to peripherals, where there are any.
    pub fn set_bridges(&mut self, bridges: &[Bridge]) {
        self.bridges = bridges.to_vec();
        self.first_bridge = self.ports.len();
        let count = bridges.iter().map(|bridge| bridge.number + 1).max();
        let all = self.first_bridge + count.unwrap_or(0);
        self.ports.resize(all, Port::default());
    }

    /// Whether anything is arbitrated.
    pub fn arbitrates(&self) -> bool {
        !self.ports.is_empty()
    }

    /// Priorities as BUS_PRIORITY has them: bit 0 core 0, bit 4 core 1, bits 8 and 12 the DMA's
    /// reads and writes. At bridges bit 4 is the DMA's writes (E27); that bit 8 is core 1 there and
    /// bit 12 the DMA's reads is a guess, which no test and no firmware rests on.
    pub fn set_priorities(&mut self, register: u32) {
        let high = |bit: u32| register >> bit & 1 != 0;
        let [core0, core1, reads, writes] = [0, 4, 8, 12].map(high);
        self.high = [
            [core0, core0, core1, core1, reads, writes],
            [core0, core0, reads, reads, writes, core1],
        ];
    }

    /// Cycles that a core's data access has to wait.
    pub fn data(&mut self, core: usize, address: u32, cycle: u64, write: bool) -> u64 {
        if core >= CORES {
            return 0;
        }
        let Some((port, cycles)) = self.hold(address, write) else {
            return 0;
        };
        let manager = 2 * core + 1;
        let wait = self.claim(Claim {
            manager,
            port,
            cycle,
            cycles,
        });
        let at_bridge = self.is_bridge(port);
        self.waited[usize::from(at_bridge)] += wait;
        wait + u64::from(self.meets_fetches && !at_bridge && self.meets(core, port))
    }

    /// Whether a port is in the way of one of the words behind the instruction that is executed.
    fn meets(&self, core: usize, port: usize) -> bool {
        let ahead = AHEAD.map(|bytes| self.fetched[core].wrapping_add(bytes));
        ahead.iter().any(|word| self.port(*word) == Some(port))
    }

    fn is_bridge(&self, port: usize) -> bool {
        port >= self.first_bridge && !self.bridges.is_empty()
    }

    /// A core fetches ahead of the instruction that it begins.
    pub fn fetch(&mut self, core: usize, instruction: u32, cycle: u64) {
        let word = fetched_word(instruction);
        if core < CORES && self.fetched[core] != word {
            self.fetched[core] = word;
            self.access(2 * core, word, cycle, false);
        }
    }

    /// A DMA's access.
    pub fn dma(&mut self, address: u32, cycle: u64, write: bool) {
        let held = self
            .hold(address, write)
            .map_or(0, |(_, cycles)| cycles - 1);
        let wait = self.access(DMA + usize::from(write), address, cycle, write);
        self.dma_cycles += held + wait;
    }

    /// Cycles beyond the first that the DMA's accesses took since this was asked last.
    pub fn take_dma_cycles(&mut self) -> u64 {
        std::mem::take(&mut self.dma_cycles)
    }

    /// An access of a manager: how long it waits.
    fn access(&mut self, manager: usize, address: u32, cycle: u64, write: bool) -> u64 {
        let Some((port, cycles)) = self.hold(address, write) else {
            return 0;
        };
        self.claim(Claim {
            manager,
            port,
            cycle,
            cycles,
        })
    }

    /// The port of an address, and for how long an access holds it.
    fn hold(&self, address: u32, write: bool) -> Option<(usize, u64)> {
        if let Some(port) = self.port(address) {
            return Some((port, 1));
        }
        let bridge = self.bridges.iter().find(|own| own.contains(address))?;
        let cycles = if write { bridge.write } else { bridge.read };
        Some((self.first_bridge + bridge.number, cycles))
    }

    fn claim(&mut self, claim: Claim) -> u64 {
        let Claim {
            manager,
            port,
            cycle,
            cycles,
        } = claim;
        let at_bridge = self.is_bridge(port);
        let high = &self.high[usize::from(at_bridge)];
        let owed = std::mem::take(&mut self.owed[manager]);
        let port = &mut self.ports[port];
        let same_core = manager / 2 == port.manager / 2 && manager < DMA;
        let taken = port.free > cycle && !same_core;
        // What began earlier holds a bridge to its end.
        let begins = !at_bridge || port.began >= cycle;
        let first = taken && begins && high[manager] && !high[port.manager];
        if first {
            // The other one was let through in this cycle because it came to be counted first.
            self.owed[port.manager] += cycles;
        }
        let wait = if taken && !first {
            port.free - cycle
        } else {
            0
        };
        *port = Port {
            began: cycle + wait,
            free: port.free.max(cycle + wait + cycles),
            manager,
        };
        wait + owed
    }

    /// Whether cores that use no port in common never wait: none is owed a cycle, and no DMA is at
    /// work.
    pub fn is_even(&self) -> bool {
        !self.dma && !self.meets_fetches && self.owed.iter().all(|owed| *owed == 0)
    }

    /// The ports that each core holds in a cycle or later, a bit each; nothing when a DMA holds
    /// one, or a core one that others may take from it: its next fetch there changes what it is
    /// then owed.
    pub fn held(&self, cycle: u64) -> Option<[u32; CORES]> {
        let mut held = [0; CORES];
        for (port, last) in self.ports.iter().enumerate() {
            if last.free > cycle {
                let taken = !self.is_bridge(port) && self.yields(last.manager);
                *held.get_mut(last.manager / 2).filter(|_| !taken)? |= 1 << port;
            }
        }
        Some(held)
    }

    /// Whether some manager goes before this one at banks.
    fn yields(&self, manager: usize) -> bool {
        let [high, _] = &self.high;
        !high[manager] && high.contains(&true)
    }

    /// What is left of a core's accesses at ports that nobody else used: each with its port and
    /// cycle, and the instruction that it executed last.
    pub fn settle(&mut self, core: usize, accesses: impl Iterator<Item = (u8, u64)>, last: u32) {
        for (port, cycle) in accesses {
            if let Some(port) = self.ports.get_mut(port as usize) {
                *port = Port {
                    began: cycle,
                    free: port.free.max(cycle + 1),
                    manager: 2 * core + 1,
                };
            }
        }
        self.fetched[core] = fetched_word(last);
    }

    /// The ports that are held in a cycle or later: which, up to when, and by whom; whether by
    /// fetches or data where that matters.
    #[cfg(test)]
    pub fn busy(&self, cycle: u64) -> Vec<(usize, u64, usize)> {
        let busy = self.ports.iter().enumerate();
        let busy = busy.filter(|(_, last)| last.free > cycle);
        let by = |manager: usize| match self.yields(manager) {
            true => manager,
            false => manager & !1,
        };
        busy.map(|(port, last)| (port, last.free, by(last.manager)))
            .collect()
    }

    fn port(&self, address: u32) -> Option<usize> {
        self.banks.iter().find_map(|banks| banks.port(address))
    }
}

/// The word that is fetched while an instruction is executed.
pub(crate) fn fetched_word(instruction: u32) -> u32 {
    (instruction & !3).wrapping_add(8)
}

#[cfg(test)]
mod tests;
