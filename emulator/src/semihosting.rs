//! Semihosting: how a program speaks to its host through BKPT 0xAB.
//!
//! The crate does no input or output: what a program prints is gathered here for the caller, and
//! what it may read is put here before. Only the console (`:tt`) can be opened; files answer as if
//! they did not exist.

use crate::memory::Memory;

/// The host's side of the conversation.
#[derive(Clone, Default)]
pub struct Semihosting {
    /// Whether BKPT 0xAB is answered; else it is a breakpoint.
    pub enabled: bool,
    /// What the program wrote to standard output. Take it whenever you like.
    pub output: Vec<u8>,
    /// What it wrote to standard error.
    pub errors: Vec<u8>,
    /// What it has not read yet of standard input.
    pub input: std::collections::VecDeque<u8>,
    /// What SYS_GET_CMDLINE gives.
    pub command_line: String,
    /// Cycles per second, for SYS_CLOCK and SYS_TICKFREQ; the board's.
    pub(crate) clock_hz: u32,
}

/// What a call gives back.
pub(crate) enum Answer {
    /// R0.
    Value(u32),
    /// The program ends.
    Exit(u32),
}

/// The handles of the console.
const STDIN: u32 = 1;
const STDOUT: u32 = 2;
const STDERR: u32 = 3;
const FAILED: u32 = u32::MAX;
/// The reason that SYS_EXIT gives for an orderly end, `ADP_Stopped_ApplicationExit`.
const APPLICATION_EXIT: u32 = 0x20026;

impl Semihosting {
    /// Call `number` with parameter R1, in a cycle.
    pub(crate) fn call(&mut self, memory: &mut Memory, number: u32, r1: u32, cycle: u64) -> Answer {
        let word = |memory: &Memory, index: u32| read_word(memory, r1.wrapping_add(4 * index));
        Answer::Value(match number {
            0x01 => self.open(memory, r1),
            0x03 => self.put(STDOUT, &read_bytes(memory, r1, 1)),
            0x04 => self.put(STDOUT, &read_string(memory, r1)),
            0x05 => {
                let (handle, bytes) = (
                    word(memory, 0),
                    read_bytes(memory, word(memory, 1), word(memory, 2)),
                );
                if self.put(handle, &bytes) == 0 {
                    0
                } else {
                    word(memory, 2)
                }
            }
            0x06 => self.read(memory, word(memory, 0), word(memory, 1), word(memory, 2)),
            0x07 => self.input.pop_front().map_or(0, u32::from),
            0x02 | 0x0b | 0x11 | 0x13 => 0,
            0x08 => FAILED,
            0x09 => u32::from(word(memory, 0) <= STDERR),
            0x10 => (cycle / u64::from((self.clock_hz / 100).max(1))) as u32,
            0x15 => self.give_command_line(memory, r1),
            0x16 => 0,
            0x18 => return Answer::Exit(u32::from(r1 != APPLICATION_EXIT)),
            0x20 => {
                let fine = word(memory, 0) == APPLICATION_EXIT;
                return Answer::Exit(if fine { word(memory, 1) } else { 1 });
            }
            0x30 => {
                let written = memory.write(r1, &cycle.to_le_bytes());
                if written.is_ok() { 0 } else { FAILED }
            }
            0x31 => self.clock_hz,
            _ => FAILED,
        })
    }

    /// Opens the console for reading, writing or appending, by mode.
    fn open(&self, memory: &Memory, block: u32) -> u32 {
        let name = read_string(memory, read_word(memory, block));
        match read_word(memory, block.wrapping_add(4)) {
            _ if name != b":tt" => FAILED,
            0..4 => STDIN,
            4..8 => STDOUT,
            _ => STDERR,
        }
    }

    fn put(&mut self, handle: u32, bytes: &[u8]) -> u32 {
        match handle {
            STDOUT => self.output.extend_from_slice(bytes),
            STDERR => self.errors.extend_from_slice(bytes),
            _ => return FAILED,
        }
        0
    }

    /// How many bytes of `count` were not read.
    fn read(&mut self, memory: &mut Memory, handle: u32, address: u32, count: u32) -> u32 {
        let available = if handle == STDIN {
            self.input.len().min(count as usize)
        } else {
            0
        };
        let bytes: Vec<u8> = self.input.drain(..available).collect();
        match memory.write(address, &bytes) {
            Ok(()) => count - available as u32,
            Err(_) => count,
        }
    }

    fn give_command_line(&self, memory: &mut Memory, block: u32) -> u32 {
        let mut text = self.command_line.clone().into_bytes();
        text.push(0);
        let (buffer, size) = (
            read_word(memory, block),
            read_word(memory, block.wrapping_add(4)),
        );
        let length = (text.len() as u32 - 1).to_le_bytes();
        let fits = text.len() <= size as usize;
        let given = fits
            && memory.write(buffer, &text).is_ok()
            && memory.write(block.wrapping_add(4), &length).is_ok();
        if given { 0 } else { FAILED }
    }
}

/// What memory does not have reads as zero.
fn read_word(memory: &Memory, address: u32) -> u32 {
    let mut bytes = [0; 4];
    memory
        .read(address, &mut bytes)
        .map_or(0, |()| u32::from_le_bytes(bytes))
}

/// Up to the end of memory.
fn read_bytes(memory: &Memory, address: u32, count: u32) -> Vec<u8> {
    let byte = |i: u32| {
        let mut byte = [0];
        memory
            .read(address.checked_add(i)?, &mut byte)
            .ok()
            .map(|()| byte[0])
    };
    (0..count).map_while(byte).collect()
}

/// Up to a zero.
fn read_string(memory: &Memory, address: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut byte = [0];
    for at in address..=u32::MAX {
        match memory.read(at, &mut byte) {
            Ok(()) if byte[0] != 0 => bytes.push(byte[0]),
            _ => break,
        }
    }
    bytes
}
