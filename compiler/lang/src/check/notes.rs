//! Note names: a letter `A` to `G`, `#` or `s` for a sharp or `b` for a flat, and the octave `0` to
//! `9` (`A0`, `C#4`, `Bb3`). `C4` is MIDI note 60.

/// Semitones above C of the letters A to G.
const SEMITONES: [u8; 7] = [9, 11, 0, 2, 4, 5, 7];

/// The MIDI number of a note name.
pub fn midi_number(name: &str) -> Option<u8> {
    let (letter, rest) = name.split_at_checked(1)?;
    let letter = letter
        .bytes()
        .next()
        .filter(|l| (b'A'..=b'G').contains(l))?;
    let (accidental, octave) = match rest.strip_prefix(['#', 's']) {
        Some(octave) => (1, octave),
        None => rest
            .strip_prefix('b')
            .map_or((0, rest), |octave| (-1, octave)),
    };
    let octave = octave
        .parse::<i32>()
        .ok()
        .filter(|o| octave.len() == 1 && (0..=9).contains(o))?;
    let number = 12 * (octave + 1) + i32::from(SEMITONES[usize::from(letter - b'A')]) + accidental;
    u8::try_from(number).ok().filter(|n| *n <= 127)
}

/// The name of a MIDI number, black keys as sharps (`C#4`); above 127 there are none, and 127 is
/// meant.
pub fn note_name(number: u8) -> String {
    const NAMES: [&str; 12] = [
        "C", "C#", "D", "D#", "E", "F", "F#", "G", "G#", "A", "A#", "B",
    ];
    let number = number.min(127);
    format!(
        "{}{}",
        NAMES[usize::from(number % 12)],
        i32::from(number / 12) - 1
    )
}

#[cfg(test)]
mod tests {
    use super::{midi_number, note_name};

    #[test]
    fn names() {
        let names = ["A0", "C4", "C#4", "Cs4", "Db4", "Cb4", "A4", "C8", "G9"];
        let numbers = names.map(|n| midi_number(n).unwrap_or(255));
        assert_eq!(numbers, [21, 60, 61, 61, 61, 59, 69, 108, 127]);
        for wrong in ["", "H3", "c4", "C", "C10", "Cx4", "A9", "C##4", "é4", "C٣"] {
            assert_eq!(midi_number(wrong), None, "{wrong}");
        }
    }
    #[test]
    fn numbers_have_names() {
        assert_eq!(
            [21, 60, 61, 108, 127, 200].map(note_name),
            ["A0", "C4", "C#4", "C8", "G9", "G9"]
        );
        assert!((12..=127).all(|number| midi_number(&note_name(number)) == Some(number)));
    }
}
