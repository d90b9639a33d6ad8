//! Plays words to an image on the emulated board and counts.

use whippen_compiler::model::Model;
use whippen_emulator::elf::Elf;
use whippen_emulator::{Board, Machine, Region, Register, Stop};
use whippen_runtime::device::Device;
use whippen_runtime::gesture;

use super::{Failure, RATE_HZ, Setting};

const RAM: u32 = 0x2000_0000;
const RAM_BYTES: u32 = 0x8_0000;
/// More than any frame takes.
const CYCLES_MAX: u64 = 1_000_000;
/// Words at random after the gesture.
const RANDOM: usize = 5_000;

/// Cycles of a frame, call and return included.
pub struct Cycles {
    pub worst: f64,
    pub mean: f64,
}

impl Cycles {
    /// The same of one key.
    pub fn of_key(&self, setting: &Setting) -> [f64; 2] {
        [self.worst, self.mean].map(|cycles| cycles / setting.keys as f64)
    }
}

/// Rows of words, one for each port: the bundled gesture, then words at random, some of them
/// staying for a while.
pub fn rows(model: &Model) -> Vec<Vec<u16>> {
    let ports: Vec<Vec<u16>> = if model.is_of_key() {
        vec![words(&Device::mikey())]
    } else {
        let device = Device::of(model);
        let gestures = gesture::bundled_ports(model).into_iter();
        let moved = gestures.zip(device.ports_of(model)).map(|(gesture, port)| {
            let places = gesture.positions(RATE_HZ);
            with_random(places.iter().map(|&x| port.word(x).0).collect())
        });
        moved.collect()
    };
    let ticks = ports.iter().map(Vec::len).min().unwrap_or(0);
    let row = |tick: usize| ports.iter().map(|words| words[tick]).collect();
    (0..ticks).map(row).collect()
}

/// The words of a key.
fn words(device: &Device) -> Vec<u16> {
    let positions = gesture::default_gesture().positions(RATE_HZ);
    with_random(
        positions
            .iter()
            .map(|&x| device.word_of_position(x).0)
            .collect(),
    )
}

/// Words at random behind others.
fn with_random(mut words: Vec<u16>) -> Vec<u16> {
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    let mut word = 0;
    for _ in 0..RANDOM {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        if state & 7 < 3 {
            word = (state >> 40) as u16;
        }
        words.push(word);
    }
    words
}

/// Cycles of an image's frames.
pub fn play(elf: &[u8], setting: &Setting) -> Result<Cycles, Failure> {
    let elf = Elf::parse(elf, false)?;
    let regions = vec![Region::ram("ram", RAM, RAM_BYTES)];
    let mut machine = Machine::new(Board {
        regions,
        vector_table: RAM,
        ..Board::generic(setting.core)
    })?;
    elf.load(&mut machine.bus.memory, true)?;
    machine.reset();
    let sp = Register::named("sp").ok_or("a stack pointer")?;
    machine.cpu_mut(0).set(sp, RAM + RAM_BYTES);
    let address = |name: &str| {
        elf.symbols
            .named(name)
            .map(|s| s.address)
            .map_err(|e| format!("{e:?}"))
    };
    let (reset, tick, input) = (
        address("bench_reset")?,
        address("bench_tick")?,
        address("in_words")?,
    );
    let call = |machine: &mut Machine, function: u32, row: &[u16]| -> Result<u64, Failure> {
        let bytes: Vec<u8> = row.iter().flat_map(|word| word.to_le_bytes()).collect();
        machine
            .bus
            .memory
            .write(input, &bytes.repeat(setting.keys))?;
        match machine.call(function, [0; 4], CYCLES_MAX) {
            Stop::Returned { cycles, .. } => Ok(cycles),
            other => Err(format!("{other:?}").into()),
        }
    };
    let rows = &setting.rows;
    call(&mut machine, reset, &rows[0])?;
    let (mut worst, mut sum) = (0, 0);
    for row in rows {
        let cycles = call(&mut machine, tick, row)?;
        worst = worst.max(cycles);
        sum += cycles;
    }
    Ok(Cycles {
        worst: worst as f64,
        mean: sum as f64 / rows.len() as f64,
    })
}
