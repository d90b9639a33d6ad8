//! The note by which an image says that it is not proven to be in time.
//!
//! ```text
//!   .note.whippen   words: bytes of the owner, bytes of the text, kind; owner; text
//! ```

use object::{Object, ObjectSection};

use super::File;

/// Whose note it is, ended by a zero.
const OWNER: &[u8] = b"Whippen\0";
/// It says what is not proven.
const UNPROVEN: u32 = 0x100;
/// Bytes of the three words.
const HEAD: usize = 12;

/// Why an image is not proven to be in time, if it says so.
pub fn unproven(file: &File<'_>) -> Option<String> {
    let section = file.section_by_name(".note.whippen")?;
    text(section.data().ok()?)
}

fn text(note: &[u8]) -> Option<String> {
    let word = |at: usize| {
        let bytes = note.get(4 * at..)?.first_chunk()?;
        Some(u32::from_le_bytes(*bytes))
    };
    let (owner, bytes) = (word(0)? as usize, word(1)? as usize);
    let behind = note.get(HEAD..)?;
    if behind.get(..owner)? != OWNER || word(2)? != UNPROVEN {
        return None;
    }
    let text = behind.get(owner.next_multiple_of(4)..)?.get(..bytes)?;
    Some(String::from_utf8_lossy(text).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_whole_notes_of_this_owner_say_something() {
        let words = [8_u32, 4, UNPROVEN].map(u32::to_le_bytes).concat();
        let note = [&words[..], OWNER, b"late"].concat();
        assert_eq!(text(&note).as_deref(), Some("late"));
        for end in 0..note.len() {
            assert_eq!(text(&note[..end]), None);
        }
        let other = [&words[..], b"Whipped\0", b"late"].concat();
        assert_eq!(text(&other), None);
        let lies = [u32::MAX, u32::MAX, UNPROVEN]
            .map(u32::to_le_bytes)
            .concat();
        assert_eq!(text(&[&lies[..], OWNER].concat()), None);
    }
}
