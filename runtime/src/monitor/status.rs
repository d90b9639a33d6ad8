//! The status of a board, read out of its memory: what each core counts, what failed, gains.

use whippen_compiler::firmware::{FAULTS, core_block, key_guard, status};

use super::client::MonitorError;

/// Memory of a board that plays.
pub trait BoardMemory {
    /// So many words from an address on. Each is read at once; a tick may come between two.
    ///
    /// # Errors
    /// They cannot be read.
    fn read(&mut self, address: u32, words: usize) -> Result<Vec<u32>, MonitorError>;
}

/// Memory of a board that can be written as well.
pub trait BoardWrite: BoardMemory {
    /// Writes a word.
    ///
    /// # Errors
    /// It cannot be written.
    fn write(&mut self, address: u32, word: u32) -> Result<(), MonitorError>;
}

/// `WHIP`, with which a status begins.
const MAGIC: u32 = u32::from_le_bytes(*b"WHIP");
/// The version of its table.
const VERSION: u32 = 2;
/// Words of a core's block that every image has.
const BLOCK_WORDS: usize = core_block::BEGUN as usize / 4 + 1;
/// A gain of 1.
const WHOLE: u32 = 65_536;
/// Words of a descriptor that are read here.
const DESCRIPTOR_WORDS: usize = 8;

/// What a board does.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Status {
    /// Faults of the processor.
    pub faults: u32,
    /// Each core that plays.
    pub cores: Vec<CoreStatus>,
}

/// What a core does.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CoreStatus {
    /// The number of its last tick.
    pub ticks: u32,
    /// Ticks that were missed.
    pub missed: u32,
    /// Faults so far, a bit each ([`FAULTS`]).
    pub faults: u32,
    /// The key, of the whole keyboard, that went free last.
    pub faulty_key: Option<u32>,
    /// Its first key.
    pub first_key: u32,
    /// How many it has.
    pub keys: u32,
    /// The number of the program that plays; with that of programs added where it began anew.
    pub program: Option<u32>,
    /// Whether force comes up: ticks that are left.
    pub ramp_ticks: u32,
    /// The gain of each key, or the only one of an instrument that is played once: 65536 is 1.
    pub gains: Vec<u32>,
    /// The most that each may be.
    pub ceilings: Vec<u32>,
}

impl Status {
    /// What went wrong, in words.
    pub fn told_faults(&self) -> Vec<&'static str> {
        let all = self
            .cores
            .iter()
            .fold(self.faults, |all, core| all | core.faults);
        let happened = FAULTS.iter().filter(|fault| all & fault.bit != 0);
        happened.map(|fault| fault.what).collect()
    }

    /// Keys whose gain is less than 1: number and gain.
    pub fn held_back(&self) -> Vec<(u32, u32)> {
        let of_core = |core: &CoreStatus| {
            let gains = (core.first_key..).zip(core.gains.clone());
            gains.filter(|(_, gain)| *gain != WHOLE).collect::<Vec<_>>()
        };
        self.cores.iter().flat_map(of_core).collect()
    }

    /// Ticks missed by all cores.
    pub fn missed(&self) -> u32 {
        self.cores.iter().map(|core| core.missed).sum()
    }
}

/// Reads the status at its address.
///
/// # Errors
/// The memory cannot be read, or there is no status.
pub fn read_status(
    memory: &mut (impl BoardMemory + ?Sized),
    at: u32,
) -> Result<Status, MonitorError> {
    let head = memory.read(at, 7)?;
    let refused = |why: String| Err(MonitorError::Refused(why));
    if head[0] != MAGIC {
        return refused(format!(
            "at {at:#010x} is no status of Whippen's firmware: is the image on the board this one, \
             and does it run?"
        ));
    }
    if head[1] != VERSION {
        return refused(format!(
            "the status is of version {}, and this Whippen reads version {VERSION}",
            head[1]
        ));
    }
    let blocks: Vec<u32> = head[3..5].iter().copied().filter(|at| *at != 0).collect();
    let count = memory.read(head[6], 1)?[0];
    let programs = memory.read(head[6] + 4, count as usize * blocks.len())?;
    let core = |(number, &at): (usize, &u32)| {
        let own: Vec<u32> = (programs.iter().copied())
            .skip(number)
            .step_by(blocks.len())
            .collect();
        read_core(memory, at, &own)
    };
    let cores = blocks.iter().enumerate().map(core);
    let cores = cores.collect::<Result<_, _>>()?;
    Ok(Status {
        faults: head[status::FAULTS as usize / 4],
        cores,
    })
}

/// A core's status; `programs` are its descriptors.
fn read_core(
    memory: &mut (impl BoardMemory + ?Sized),
    at: u32,
    programs: &[u32],
) -> Result<CoreStatus, MonitorError> {
    let block = memory.read(at, BLOCK_WORDS)?;
    let word = |offset: u32| block[offset as usize / 4];
    let keys = word(core_block::KEYS);
    if !(1..=255).contains(&keys) {
        return Err(MonitorError::Refused(format!("a core with {keys} keys")));
    }
    let (first, faulty) = (word(core_block::FIRST), word(core_block::FAULTY));
    let playing = word(core_block::PROGRAM);
    let program = programs.iter().position(|own| *own == playing);
    let gains = read_gains(memory, &block, keys)?;
    let guards = memory.read(word(core_block::GUARDS), 4 * keys as usize)?;
    let ceiling = key_guard::CEILING as usize / 4;
    Ok(CoreStatus {
        ticks: word(core_block::TICK),
        missed: word(core_block::MISSED),
        faults: word(core_block::FAULTS),
        faulty_key: (faulty != u32::MAX).then(|| first.wrapping_add(faulty)),
        first_key: first,
        keys,
        program: program.map(|number| number as u32),
        ramp_ticks: word(core_block::RAMP),
        gains,
        ceilings: guards.chunks(4).map(|guard| guard[ceiling]).collect(),
    })
}

/// The gain of each key: in its record, or in one that a table has the address of.
fn read_gains(
    memory: &mut (impl BoardMemory + ?Sized),
    block: &[u32],
    keys: u32,
) -> Result<Vec<u32>, MonitorError> {
    let word = |offset: u32| block[offset as usize / 4];
    let gains = word(core_block::GAINS);
    let descriptor = memory.read(word(core_block::PROGRAM), DESCRIPTOR_WORDS)?;
    let (records, end) = (descriptor[6], descriptor[7]);
    if records == 0 {
        let table = memory.read(gains, 2 * keys as usize)?;
        let of_key = |row: &[u32]| Ok(memory.read(row[0] + 4, 1)?[0]);
        return table.chunks(2).map(of_key).collect();
    }
    let stride = end.wrapping_sub(records) as usize / 4 / keys as usize;
    let words = memory.read(gains, stride * (keys as usize - 1) + 1)?;
    Ok(words.into_iter().step_by(stride.max(1)).collect())
}
