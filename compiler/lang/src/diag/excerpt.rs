//! Excerpts of long lines: what stands around the places that are pointed at.
//!
//! Places are counted in characters of a file. A line that is as long as a page is cut around the
//! places in it; `…` stands for what is left out.

/// Lines up to so many characters are shown whole.
const LINE_MAX: usize = 240;

/// So many characters are shown on either side of a place in a longer line.
const AROUND: usize = 80;

/// Words of a message up to so many characters are shown whole.
const WORD_MAX: usize = 120;

/// What stands for what is left out.
const CUT: char = '…';

/// A text with its long lines cut.
pub struct Excerpt {
    /// What is left of the text.
    pub text: String,
    /// Runs of characters that are kept: where they begin in the whole text and in this, and how
    /// many they are.
    kept: Vec<(usize, usize, usize)>,
}

impl Excerpt {
    /// A text in which these places are pointed at.
    pub fn of(text: &str, places: &[usize]) -> Excerpt {
        let mut excerpt = Excerpt {
            text: String::new(),
            kept: Vec::new(),
        };
        let (mut begin, mut shown) = (0, 0);
        for line in text.split_inclusive('\n') {
            let count = line.chars().count();
            let end = begin + count;
            let mut parts = vec![(begin, end)];
            if count > LINE_MAX {
                let inside = places.iter().filter(|at| (begin..end).contains(*at));
                let around =
                    inside.map(|at| (begin.max(at.saturating_sub(AROUND)), end.min(at + AROUND)));
                parts = joined(around.chain([(begin, begin + 1), (end - 1, end)]));
            }
            let mut characters = line.chars();
            let mut at = begin;
            for (from, to) in parts {
                if from > at {
                    excerpt.text.push(CUT);
                    characters.nth(from - at - 1);
                    shown += 1;
                }
                excerpt.kept.push((from, shown, to - from));
                excerpt.text.extend(characters.by_ref().take(to - from));
                shown += to - from;
                at = to;
            }
            begin = end;
        }
        excerpt
    }

    /// Where a place is in this text.
    pub fn place(&self, at: usize) -> usize {
        let number = self.kept.partition_point(|(from, ..)| *from <= at);
        let run = number.checked_sub(1).and_then(|last| self.kept.get(last));
        run.map_or(0, |(from, shown, count)| shown + (at - from).min(*count))
    }
}

/// Ranges in order, those that touch as one.
fn joined(ranges: impl Iterator<Item = (usize, usize)>) -> Vec<(usize, usize)> {
    let mut sorted: Vec<(usize, usize)> = ranges.collect();
    sorted.sort_unstable();
    let mut joined: Vec<(usize, usize)> = Vec::new();
    for (from, to) in sorted {
        match joined.last_mut() {
            Some(last) if from <= last.1 + 1 => last.1 = last.1.max(to),
            _ => joined.push((from, to)),
        }
    }
    joined
}

/// A message whose long words, such as a name of the program, are cut in their middle.
pub fn shortened(message: &str) -> String {
    let word = |word: &str| {
        let count = word.chars().count();
        if count <= WORD_MAX {
            return word.to_string();
        }
        let begin: String = word.chars().take(WORD_MAX / 2).collect();
        let end: String = word.chars().skip(count - WORD_MAX / 2).collect();
        format!("{begin}{CUT}{end}")
    };
    message.split_inclusive(' ').map(word).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_lines_stay() {
        let text = "one\ntwo\n";
        let excerpt = Excerpt::of(text, &[4]);
        assert_eq!((excerpt.text.as_str(), excerpt.place(5)), (text, 5));
    }

    #[test]
    fn long_lines_are_cut_around_places() {
        let text = format!("first\n{}é!{}\nlast", "a".repeat(5000), "b".repeat(5000));
        let at = 6 + 5000;
        let excerpt = Excerpt::of(&text, &[at, at + 1]);
        assert!(excerpt.text.chars().count() < 200, "{}", excerpt.text);
        assert_eq!(excerpt.text.chars().nth(excerpt.place(at)), Some('é'));
        assert_eq!(excerpt.text.chars().nth(excerpt.place(at + 1)), Some('!'));
        assert_eq!(excerpt.text.lines().count(), 3);
        let last = text.chars().count() - 4;
        assert_eq!(excerpt.text.chars().nth(excerpt.place(last)), Some('l'));
    }

    #[test]
    fn places_far_apart_are_both_shown() {
        let text = "x".repeat(100_000);
        let excerpt = Excerpt::of(&text, &[0, 99_999]);
        assert!(excerpt.text.chars().count() < 200);
        assert!(excerpt.place(0) < excerpt.place(99_999));
    }

    #[test]
    fn long_words_of_messages_are_cut() {
        let message = format!("there is no name `{}` here", "a".repeat(500));
        assert!(shortened(&message).chars().count() < 160);
        assert_eq!(shortened("a b  c"), "a b  c");
    }
}
