//! Texts of a board of one's own: each takes the place of the bundled text of its name, or of all
//! of a board's.

use std::collections::BTreeMap;
use std::fmt;

use whippen_arm::asm::Source;
use whippen_board::Board;

use super::Unsupported;
use super::boards::{bundled_texts, frame, shared, support_with};
use super::ports::Guards;

/// The text that takes the place of all of a board's outside of a tick.
pub(super) const BOARD: &str = "board.s";
/// The one that takes the place of the board's in a tick.
pub(super) const BOARD_TICK: &str = "board_tick.s";
/// Texts whose reads and writes of the other core's memory between ticks are counted by hand
/// ([`RUNNING`](super::RUNNING)).
const COUNTED: &[&str] = &[
    "idle.s",
    "mailbox.s",
    "midi.s",
    "midi_in.s",
    "monitor.s",
    "monitor_capture.s",
    "monitor_events.s",
    "latch.s",
    "alarm.s",
    "emptying.s",
    "tick.s",
    "v6m/tick.s",
];

/// Texts in place of bundled ones; by default none.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub struct OwnTexts {
    /// By the name of the bundled one.
    texts: BTreeMap<String, OwnText>,
}

/// One of them.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct OwnText {
    /// Its name in messages.
    pub path: String,
    /// The text.
    pub text: String,
}

/// There is no text of this name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnknownText {
    /// The path of what was given.
    pub path: String,
    /// What there is.
    pub known: Vec<String>,
}

impl fmt::Display for UnknownText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "`{}` takes the place of no text of the firmware: there are {}",
            self.path,
            self.known.join(", ")
        )
    }
}

impl std::error::Error for UnknownText {}

/// Every text that some image of a board has, once.
///
/// # Errors
/// The board has no firmware.
pub fn all_texts<'a>(board: &'a Board, own: &'a OwnTexts) -> Result<Vec<Source<'a>>, Unsupported> {
    let support = support_with(board, own)?;
    let mut all: Vec<Source> = Vec::new();
    for monitor in [false, true] {
        all.extend(shared(&support, board.stacks.len(), monitor));
        let frames = [Guards::Keys, Guards::Ports].map(|guards| frame(&support, guards, monitor));
        all.extend(frames.into_iter().flatten());
    }
    all.sort_by_key(|source| source.name);
    all.dedup_by_key(|source| source.name);
    Ok(all)
}

/// The name of a bundled text in a folder.
pub fn text_name(source: &Source) -> String {
    let name = source.name.strip_prefix("firmware/");
    name.unwrap_or(source.name).to_string()
}

impl OwnTexts {
    /// None.
    pub const NONE: &'static OwnTexts = &OwnTexts {
        texts: BTreeMap::new(),
    };

    /// Texts by their names in a folder.
    ///
    /// # Errors
    /// One has a name that none has.
    pub fn new(
        texts: impl IntoIterator<Item = (String, OwnText)>,
    ) -> Result<OwnTexts, UnknownText> {
        let texts: BTreeMap<String, OwnText> = texts.into_iter().collect();
        let bundled = bundled_texts().map(|source| text_name(&source));
        let own = [BOARD, BOARD_TICK].map(str::to_string);
        let known: Vec<String> = own.into_iter().chain(bundled).collect();
        match texts.iter().find(|(name, _)| !known.contains(name)) {
            Some((_, text)) => Err(UnknownText {
                path: text.path.clone(),
                known,
            }),
            None => Ok(OwnTexts { texts }),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.texts.is_empty()
    }

    /// The text of a name.
    pub(super) fn named(&self, name: &str) -> Option<Source<'_>> {
        let own = self.texts.get(name)?;
        Some(Source {
            name: &own.path,
            text: &own.text,
        })
    }

    /// What is assembled in place of a bundled text.
    pub(super) fn instead_of<'a>(&'a self, bundled: Source<'a>) -> Source<'a> {
        self.named(&text_name(&bundled)).unwrap_or(bundled)
    }

    /// The paths of those that no image has that is made of these sources.
    pub fn unused<'a>(&'a self, sources: &[Source]) -> Vec<&'a str> {
        let is_used = |own: &&OwnText| sources.iter().any(|source| source.name == own.path);
        let unused = self.texts.values().filter(|own| !is_used(own));
        unused.map(|own| own.path.as_str()).collect()
    }

    /// The paths of those of whose reads and writes of the other core's memory the bundled texts'
    /// number is charged.
    pub fn counted(&self) -> Vec<&str> {
        let is_bundled = |own: &OwnText| bundled_texts().any(|source| source.text == own.text);
        let own = COUNTED.iter().filter_map(|name| self.texts.get(*name));
        let own = own.filter(|own| !is_bundled(own));
        own.map(|own| own.path.as_str()).collect()
    }
}
