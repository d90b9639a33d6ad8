//! The memory of a board over OpenOCD's Tcl port: text commands that end with 0x1a, and so do
//! their answers (OpenOCD User's Guide, "Tcl Scripting API").
//!
//! `read_memory` and `write_memory` go over the core's memory port while it runs: nothing is
//! halted.

use std::io::{Read, Write};

use super::client::MonitorError;
use super::status::{BoardMemory, BoardWrite};

/// Ends a command, and an answer.
const END: u8 = 0x1a;
/// Words that are read at once.
const WORDS_MAX: usize = 256;
/// Bytes of an answer at most; more is no answer.
const ANSWER_MAX: usize = 1 << 16;

/// A connection to OpenOCD.
pub struct OpenOcd<S> {
    stream: S,
}

impl<S: Read + Write> OpenOcd<S> {
    /// Over a stream on which nothing was said yet.
    pub fn new(stream: S) -> OpenOcd<S> {
        OpenOcd { stream }
    }

    fn say(&mut self, command: &str) -> Result<String, MonitorError> {
        let mut bytes = command.as_bytes().to_vec();
        bytes.push(END);
        self.stream.write_all(&bytes)?;
        let mut answer = Vec::new();
        let mut byte = [0];
        loop {
            if self.stream.read(&mut byte)? == 0 {
                return Err(MonitorError::Line("OpenOCD has closed it".to_string()));
            }
            match byte[0] {
                END => break,
                _ if answer.len() == ANSWER_MAX => return Err(refused("no answer ends")),
                other => answer.push(other),
            }
        }
        Ok(String::from_utf8_lossy(&answer).into_owned())
    }
}

fn refused(answer: &str) -> MonitorError {
    MonitorError::Refused(format!("OpenOCD says: {answer}"))
}

impl<S: Read + Write> BoardMemory for OpenOcd<S> {
    fn read(&mut self, address: u32, words: usize) -> Result<Vec<u32>, MonitorError> {
        let mut all = Vec::with_capacity(words);
        while all.len() < words {
            let count = (words - all.len()).min(WORDS_MAX);
            let from = address.wrapping_add(4 * all.len() as u32);
            let answer = self.say(&format!("read_memory {from:#x} 32 {count}"))?;
            let parsed: Option<Vec<u32>> = answer.split_whitespace().map(number).collect();
            let part = parsed.filter(|part| part.len() == count);
            all.extend(part.ok_or_else(|| refused(answer.trim()))?);
        }
        Ok(all)
    }
}

impl<S: Read + Write> BoardWrite for OpenOcd<S> {
    fn write(&mut self, address: u32, word: u32) -> Result<(), MonitorError> {
        let answer = self.say(&format!("write_memory {address:#x} 32 {{{word:#x}}}"))?;
        match answer.trim() {
            "" => Ok(()),
            other => Err(refused(other)),
        }
    }
}

/// A word as it is printed.
fn number(text: &str) -> Option<u32> {
    match text.strip_prefix("0x") {
        Some(digits) => u32::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    }
}
