//! Requests and answers: one after the other, each again where the line has changed it.

use std::fmt;
use std::io;
use std::sync::LazyLock;
use std::time::{Duration, Instant};

use whippen_compiler::firmware::{Fact, PROTOCOL};

use super::align::{self, ALIGN};
use super::frame::{decode, encode};
use super::status::BoardMemory;

/// Bytes both ways.
pub trait Link {
    /// Sends all of them.
    ///
    /// # Errors
    /// The line is gone.
    fn send(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// What has arrived; none where nothing does for so long.
    ///
    /// # Errors
    /// The line is gone.
    fn receive(&mut self, patience: Duration) -> io::Result<Vec<u8>>;

    /// The time by which answers are late, from any beginning: this machine's, where the board has
    /// no other.
    fn time(&self) -> Duration {
        static BEGIN: LazyLock<Instant> = LazyLock::new(Instant::now);
        BEGIN.elapsed()
    }
}

/// What is asked (docs/monitor.md).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
enum Request {
    Identify = 1,
    Read = 2,
    Set = 3,
    Get = 4,
    Capture = 5,
}

/// An answer has this bit beside its request's.
const ANSWER: u8 = 0x80;
/// Words of the longest answer, in the firmware.
const WORDS_MAX: usize = 4096;
/// Words of its longest frame.
const FRAME_WORDS: usize = 60;
/// Bytes that are sent at once, and the pause behind them.
const PART: usize = 16;
const PAUSE: Duration = Duration::from_millis(1);
/// How often a request is sent.
const TRIES: u32 = 3;
/// The parameters that are none: the program.
const PROGRAM: u32 = u32::MAX;

/// Why a board does not do what it is asked to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum MonitorError {
    /// The line is gone, in words.
    Line(String),
    /// Nobody answers.
    Silent,
    /// Something arrives, so many bytes, and none of it is an answer.
    Garbage(usize),
    /// It speaks another version of the protocol.
    Version(u32),
    /// It has another image: its number, and the one that was expected.
    OtherImage(u64, u64),
    /// It was started again meanwhile.
    Restarted,
    /// It does not do it, in words.
    Refused(String),
}

impl fmt::Display for MonitorError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            MonitorError::Line(why) => write!(f, "the line is gone: {why}"),
            MonitorError::Silent => f.write_str(
                "nobody answers: the image on the board must be one of `whippen build --monitor`, \
                 with the same --baud, and TX and RX must be crossed",
            ),
            MonitorError::Garbage(bytes) => write!(
                f,
                "{bytes} bytes arrive and none of them is an answer: is --baud that of the image, \
                 and the image one of `whippen build --monitor`?"
            ),
            MonitorError::Version(found) => write!(
                f,
                "the board speaks version {found} of the monitor's protocol, and this Whippen \
                 version {PROTOCOL}: build its image with this one"
            ),
            MonitorError::OtherImage(found, expected) => write!(
                f,
                "the board has another image ({found:016x}) than this program makes with these \
                 options ({expected:016x}): give the files and options of its build"
            ),
            MonitorError::Restarted => {
                f.write_str("the board has been started again meanwhile: what was asked is lost")
            }
            MonitorError::Refused(why) => f.write_str(why),
        }
    }
}

impl std::error::Error for MonitorError {}

impl From<io::Error> for MonitorError {
    fn from(error: io::Error) -> Self {
        MonitorError::Line(error.to_string())
    }
}

/// What a board tells of itself: a word for each [`Fact`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Facts(Vec<u32>);

impl Facts {
    /// A word.
    pub fn word(&self, fact: Fact) -> u32 {
        self.0.get(fact as usize).copied().unwrap_or(0)
    }

    /// The number by which the image is known.
    pub fn identity(&self) -> u64 {
        let [low, high] = [Fact::IdentityLow, Fact::IdentityHigh].map(|fact| self.word(fact));
        u64::from(high) << 32 | u64::from(low)
    }

    /// The instrument of its first program; the first 24 bytes of its name.
    pub fn name(&self) -> String {
        let words = self.0.iter().skip(Fact::Name as usize);
        let bytes: Vec<u8> = words.flat_map(|word| word.to_le_bytes()).collect();
        let bytes: Vec<u8> = bytes.into_iter().take_while(|byte| *byte != 0).collect();
        String::from_utf8_lossy(&bytes).into_owned()
    }

    /// The version of Whippen that made it.
    pub fn version(&self) -> String {
        let [_, major, minor, patch] = self.word(Fact::Version).to_be_bytes();
        format!("{major}.{minor}.{patch}")
    }

    /// Ticks per second.
    pub fn rate_hz(&self) -> f64 {
        f64::from(self.word(Fact::RateTicks)) / f64::from(self.word(Fact::RateSeconds).max(1))
    }

    /// Cores that play.
    pub fn cores(&self) -> usize {
        self.word(Fact::Cores).min(2) as usize
    }
}

/// A board at the other end of a link.
pub struct Client<L> {
    link: L,
    /// How long an answer may take.
    patience: Duration,
    number: u8,
    /// Answers that did not come whole.
    lost: u32,
    /// What has arrived of a frame.
    begun: Vec<u8>,
}

impl<L: Link> Client<L> {
    /// Nothing is said yet.
    pub fn new(link: L, patience: Duration) -> Client<L> {
        Client {
            link,
            patience,
            number: 0,
            lost: 0,
            begun: Vec::new(),
        }
    }

    /// What is between.
    pub fn link(&mut self) -> &mut L {
        &mut self.link
    }

    /// What was between, once nothing is to be said any more.
    pub fn into_link(self) -> L {
        self.link
    }

    /// How many answers did not come whole so far, so that each was asked for again or, the third
    /// time, given up: the line, or the request on it, was changed or late.
    pub fn lost_answers(&self) -> u32 {
        self.lost
    }

    /// Those since were lost because nobody could answer.
    pub(super) fn set_lost_answers(&mut self, lost: u32) {
        self.lost = lost;
    }

    /// What the board is.
    ///
    /// # Errors
    /// It does not answer, or speaks another version.
    pub fn identify(&mut self) -> Result<Facts, MonitorError> {
        let words = self.ask(Request::Identify, &[], None)?;
        match words.first() {
            Some(&PROTOCOL) => Ok(Facts(words)),
            Some(&other) => Err(MonitorError::Version(other)),
            None => Err(MonitorError::Version(0)),
        }
    }

    /// Sets a live parameter to an integer.
    ///
    /// # Errors
    /// There is none of this number, the value is out of its range, or the board does not answer.
    pub fn set(&mut self, parameter: u32, value: i32) -> Result<(), MonitorError> {
        let asked = [parameter, value as u32];
        self.ask(Request::Set, &asked, Some(0)).map(drop)
    }

    /// The integer that plays of a live parameter.
    ///
    /// # Errors
    /// As [`Client::set`].
    pub fn get(&mut self, parameter: u32) -> Result<i32, MonitorError> {
        let words = self.ask(Request::Get, &[parameter], Some(1))?;
        Ok(words.first().map_or(0, |word| *word as i32))
    }

    /// Another program begins; one beyond the last is the one of that number less, anew.
    ///
    /// # Errors
    /// There is none, or the board does not answer.
    pub fn play(&mut self, program: u32) -> Result<(), MonitorError> {
        let asked = [PROGRAM, program];
        self.ask(Request::Set, &asked, Some(0)).map(drop)
    }

    /// Asks a knob to find its motor anew, which starts the board again. This is said once: who is
    /// asked again starts again.
    pub(super) fn set_and_start(&mut self) -> Result<(), MonitorError> {
        self.say(Request::Set, &[ALIGN, 1])?;
        match self.answer(Request::Set, Some(0), &mut 0)? {
            Some((outcome, _)) => Err(align::refused(outcome.into())),
            None => Ok(()),
        }
    }

    /// Sets and starts the capture of a core.
    ///
    /// # Errors
    /// The setting is out of range, or the board does not answer.
    pub fn capture(&mut self, core: u32, setting: &[u32]) -> Result<(), MonitorError> {
        let asked: Vec<u32> = [core].into_iter().chain(setting.iter().copied()).collect();
        self.ask(Request::Capture, &asked, Some(0)).map(drop)
    }

    /// Asks until an answer is whole: so many words, or, where that is not known, those of one
    /// frame.
    fn ask(
        &mut self,
        request: Request,
        words: &[u32],
        wanted: Option<usize>,
    ) -> Result<Vec<u32>, MonitorError> {
        let mut garbage = 0;
        for _ in 0..TRIES {
            self.say(request, words)?;
            match self.answer(request, wanted, &mut garbage)? {
                Some((0, words)) => return Ok(words),
                Some((outcome, _)) => return Err(refused(request, outcome)),
                None => self.lost = self.lost.wrapping_add(1),
            }
        }
        match garbage {
            0 => Err(MonitorError::Silent),
            bytes => Err(MonitorError::Garbage(bytes)),
        }
    }

    /// Sends a request.
    fn say(&mut self, request: Request, words: &[u32]) -> Result<(), MonitorError> {
        self.number = self.number.wrapping_add(1);
        let mut said = vec![request as u8, self.number, 0, 0];
        said.extend(words.iter().flat_map(|word| word.to_le_bytes()));
        self.begun.clear();
        self.send(&encode(&said))
    }

    /// Sends as fast as a board whose ticks leave little time takes it: its port holds 32 bytes.
    fn send(&mut self, bytes: &[u8]) -> Result<(), MonitorError> {
        for part in bytes.chunks(PART) {
            self.link.send(part)?;
            std::thread::sleep(PAUSE);
        }
        Ok(())
    }

    /// The outcome and the words of an answer; none where it does not come whole.
    fn answer(
        &mut self,
        request: Request,
        wanted: Option<usize>,
        garbage: &mut usize,
    ) -> Result<Option<(u8, Vec<u32>)>, MonitorError> {
        let (mut words, mut frames) = (Vec::new(), 0);
        let mut deadline = self.link.time() + self.patience;
        loop {
            let Some(frame) = self.frame(deadline)? else {
                return Ok(None);
            };
            let header = decode(&frame).filter(|said| said.len() >= 4 && said.len() % 4 == 0);
            let Some(said) = header else {
                *garbage += frame.len();
                continue;
            };
            if said[0] != request as u8 | ANSWER || said[1] != self.number {
                continue;
            }
            if said[3] != frames {
                return Ok(None);
            }
            let of_frame = said[4..].chunks_exact(4);
            words.extend(of_frame.map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])));
            let is_whole = wanted.is_none_or(|wanted| words.len() >= wanted);
            if is_whole || said[2] != 0 || said.len() < 4 + 4 * FRAME_WORDS {
                return Ok(Some((said[2], words)));
            }
            frames += 1;
            deadline = self.link.time() + self.patience;
        }
    }

    /// The next frame, without the zero behind it; none where it does not come in time.
    fn frame(&mut self, deadline: Duration) -> Result<Option<Vec<u8>>, MonitorError> {
        loop {
            if let Some(at) = self.begun.iter().position(|byte| *byte == 0) {
                let frame: Vec<u8> = self.begun.drain(..=at).take(at).collect();
                if !frame.is_empty() {
                    return Ok(Some(frame));
                }
                continue;
            }
            let left = deadline.saturating_sub(self.link.time());
            if left.is_zero() {
                return Ok(None);
            }
            let arrived = self.link.receive(left)?;
            self.begun.extend(arrived);
        }
    }
}

impl<L: Link> BoardMemory for Client<L> {
    fn read(&mut self, address: u32, words: usize) -> Result<Vec<u32>, MonitorError> {
        let mut all = Vec::with_capacity(words);
        while all.len() < words {
            let part = (words - all.len()).min(WORDS_MAX);
            let from = address.wrapping_add(4 * all.len() as u32);
            let read = self.ask(Request::Read, &[from, part as u32], Some(part))?;
            if read.len() != part {
                return Err(MonitorError::Refused("an answer is too short".into()));
            }
            all.extend(read);
        }
        Ok(all)
    }
}

/// What an outcome means.
fn refused(request: Request, outcome: u8) -> MonitorError {
    let why = match (request, outcome) {
        (Request::Set | Request::Get, 1) => "the board has no such parameter or program",
        (Request::Set, 2) => "the value is out of the parameter's range",
        (_, 2) => "the board refuses it: a number is out of range",
        (_, 4) => "the board does not know such a request",
        (_, 6) => "that is no memory that the board lets be read",
        _ => "the board refuses it, and its answer is unknown",
    };
    MonitorError::Refused(why.to_string())
}
