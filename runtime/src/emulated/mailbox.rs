//! The mailbox of a board: live values are put into it one after the other, as whoever talks to the
//! firmware does.

use std::collections::VecDeque;

use super::Emulated;

/// What is to be put into the mailbox.
#[derive(Debug, Default)]
pub(super) struct Mailbox {
    /// Parameters and values that wait.
    waiting: VecDeque<(u32, i32)>,
    /// The number of the last request.
    request: u32,
}

/// Where the mailbox has what (bytes).
const PARAMETER: u32 = 4;
const VALUE: u32 = 8;
const DONE: u32 = 12;
const OUTCOME: u32 = 16;

impl Emulated {
    /// Sets a live value, when those that were set before it have been taken.
    pub fn set_live(&mut self, live: u32, value: i32) {
        self.mailbox.waiting.push_back((live, value));
    }

    /// Puts the next value into the mailbox, if the last one was taken.
    pub(super) fn post(&mut self) -> Result<(), String> {
        let Some(&(live, value)) = self.mailbox.waiting.front() else {
            return Ok(());
        };
        let mailbox = self.symbol("mailbox")?;
        if self.word(mailbox + DONE)? != self.mailbox.request {
            return Ok(());
        }
        if self.mailbox.request > 0 && self.word(mailbox + OUTCOME)? != 0 {
            return Err("the board refuses a live value".to_string());
        }
        self.mailbox.waiting.pop_front();
        self.mailbox.request += 1;
        self.write(mailbox + PARAMETER, &live.to_le_bytes())?;
        self.write(mailbox + VALUE, &value.to_le_bytes())?;
        self.write(mailbox, &self.mailbox.request.to_le_bytes())
    }
}
