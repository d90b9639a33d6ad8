//! A knob that finds its motor anew because somebody asks: its chip starts again meanwhile, and
//! nobody answers.
//!
//! ```text
//!   ticks before --> parameter ALIGN = 1 --> reset, start --> fewer ticks, and they go on
//! ```

use std::time::{Duration, Instant};

use super::client::{Client, Link, MonitorError};
use super::status::{BoardMemory, BoardWrite, Status, read_status};

/// The parameter of the mailbox, and of the monitor's `set`.
pub(super) const ALIGN: u32 = 0xffff_fffd;
/// Between two looks.
const PAUSE: Duration = Duration::from_millis(20);
/// How often a mailbox is looked at, which is emptied between two ticks.
const LOOKS: usize = 50;

/// Asks over the monitor's line.
///
/// # Errors
/// The board is no knob that keeps its alignment, does not play again within `start`, or does not
/// answer.
pub fn align<L: Link>(
    client: &mut Client<L>,
    status: u32,
    start: Duration,
) -> Result<(), MonitorError> {
    let before = ticks(&read_status(client, status)?);
    let lost = client.lost_answers();
    client.set_and_start()?;
    plays_again(client, status, before, start)?;
    client.set_lost_answers(lost);
    Ok(())
}

/// Asks in the mailbox at an address.
///
/// # Errors
/// As [`align`].
pub fn align_by_mailbox(
    memory: &mut (impl BoardWrite + ?Sized),
    mailbox: u32,
    status: u32,
    start: Duration,
) -> Result<(), MonitorError> {
    let before = ticks(&read_status(memory, status)?);
    let words = memory.read(mailbox, 4)?;
    if words[0] != words[3] {
        let why = "the board's mailbox has a request that nobody has taken: does it play?";
        return Err(MonitorError::Refused(why.to_string()));
    }
    let request = words[0].wrapping_add(1);
    for (offset, word) in [(4, ALIGN), (8, 1), (0, request)] {
        memory.write(mailbox + offset, word)?;
    }
    for _ in 0..LOOKS {
        match memory.read(mailbox, 5).as_deref() {
            Ok([asked, _, _, done, outcome]) if (*asked, *done) == (request, request) => {
                return Err(refused(*outcome));
            }
            Ok([asked, ..]) if *asked == request => std::thread::sleep(PAUSE),
            // It starts again: its mailbox is empty, or cannot be read.
            _ => break,
        }
    }
    plays_again(memory, status, before, start)
}

/// What the firmware says where it does not do it.
pub(super) fn refused(outcome: u32) -> MonitorError {
    let why = match outcome {
        1 => "the image on the board keeps no alignment of a motor",
        _ => "the board refuses to find its motor anew, and its answer is unknown",
    };
    MonitorError::Refused(why.to_string())
}

fn ticks(status: &Status) -> u32 {
    status.cores.first().map_or(0, |core| core.ticks)
}

/// Waits until ticks go on that have begun anew.
fn plays_again(
    memory: &mut (impl BoardMemory + ?Sized),
    status: u32,
    before: u32,
    start: Duration,
) -> Result<(), MonitorError> {
    let deadline = Instant::now() + start;
    let mut last = None;
    loop {
        let look = read_status(memory, status);
        let now = look.as_ref().ok().map(ticks);
        // A number that is at least as large as before is that of the same start.
        let again = now.is_some_and(|now| now < before && last.is_some_and(|last| now > last));
        if again || Instant::now() >= deadline {
            return judged(look, before, again);
        }
        last = now;
        std::thread::sleep(PAUSE);
    }
}

/// What came of it, of a board that plays `again` or has had enough time to.
fn judged(
    look: Result<Status, MonitorError>,
    before: u32,
    again: bool,
) -> Result<(), MonitorError> {
    let why = match look {
        Err(error) => format!("the board was asked, and has not answered since: {error}"),
        Ok(status) => match (status.told_faults().join("; "), again) {
            (faults, true) if faults.is_empty() => return Ok(()),
            (faults, true) => format!("the board started again, and then: {faults}"),
            _ if ticks(&status) >= before => "the board did not start again".to_string(),
            _ => "the board started again, and does not play".to_string(),
        },
    };
    Err(MonitorError::Refused(why))
}
