//! Plays words to an image on the emulated board and counts.

use whippen_emulator::elf::Elf;
use whippen_emulator::{Board, CoreKind, Machine, Region, Register, Stop};
use whippen_runtime::device::Device;
use whippen_runtime::gesture;

use super::{Failure, KEYS, RATE_HZ};

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

/// One word per tick: the bundled gesture, then words at random, some of them staying for a while.
pub fn words(device: &Device) -> Vec<u16> {
    let positions = gesture::default_gesture().positions(RATE_HZ);
    let mut words: Vec<u16> = positions
        .iter()
        .map(|&x| device.word_of_position(x).0)
        .collect();
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
pub fn play(elf: &[u8], words: &[u16]) -> Result<Cycles, Failure> {
    let elf = Elf::parse(elf, false)?;
    let regions = vec![Region::ram("ram", RAM, RAM_BYTES)];
    let mut machine = Machine::new(Board {
        regions,
        vector_table: RAM,
        ..Board::generic(CoreKind::CortexM33)
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
    let call = |machine: &mut Machine, function: u32, word: u16| -> Result<u64, Failure> {
        machine
            .bus
            .memory
            .write(input, &word.to_le_bytes().repeat(KEYS))?;
        match machine.call(function, [0; 4], CYCLES_MAX) {
            Stop::Returned { cycles, .. } => Ok(cycles),
            other => Err(format!("{other:?}").into()),
        }
    };
    call(&mut machine, reset, words[0])?;
    let (mut worst, mut sum) = (0, 0);
    for &word in words {
        let cycles = call(&mut machine, tick, word)?;
        worst = worst.max(cycles);
        sum += cycles;
    }
    Ok(Cycles {
        worst: worst as f64,
        mean: sum as f64 / words.len() as f64,
    })
}
