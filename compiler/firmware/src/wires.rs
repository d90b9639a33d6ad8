//! Words that one part leaves and others take, copied in instructions that all cores have.
//!
//! A word is loaded once, and stored to all who take it:
//!
//! ```text
//!   R0 -> what is left     R1 to R4 -> what up to four others take     R5 to R7   words
//! ```

use std::collections::BTreeMap;
use std::fmt::Write;

/// Bytes that the offset of a load of all cores reaches.
const REACH: u32 = 124;
/// Registers that point to who takes words.
const TAKERS: usize = 4;
/// Registers of words that are loaded before the first is stored.
const LOADED: [&str; 3] = ["r5", "r6", "r7"];

/// A word that is left, and who takes it: names of states, offsets there.
pub(super) type Wire<'a> = (u32, Vec<(&'a str, u32)>);

/// The copies, as assembly, of words in the state of that name. Keeps no register but R8 and up.
pub(super) fn as_assembly(from: &str, mut wires: Vec<Wire>) -> String {
    wires.sort();
    let mut text = String::new();
    while let Some(row) = row(&mut wires) {
        row.write(from, &mut text);
    }
    text
}

/// Copies between the same places.
#[derive(Default)]
struct Row<'a> {
    /// Where words are left.
    from: u32,
    /// Where each of those who take them has them.
    to: BTreeMap<&'a str, u32>,
    /// Offsets from there.
    words: Vec<(u32, Vec<(usize, u32)>)>,
}

/// Takes out what one row can copy.
fn row<'a>(wires: &mut Vec<Wire<'a>>) -> Option<Row<'a>> {
    let mut row = Row {
        from: wires.first()?.0,
        ..Row::default()
    };
    let mut all = Vec::new();
    for (left, taken) in wires
        .iter_mut()
        .filter(|(left, _)| left - row.from <= REACH)
    {
        let mut own = Vec::new();
        taken.retain(|&(name, at)| {
            if row.to.len() < TAKERS {
                row.to.entry(name).or_insert(at);
            }
            let known = row.to.get(name);
            let offset = known.and_then(|first| at.checked_sub(*first));
            let reached = offset.filter(|offset| *offset <= REACH);
            own.extend(reached.map(|offset| (name, offset)));
            reached.is_none()
        });
        all.push((*left - row.from, own));
    }
    wires.retain(|(_, taken)| !taken.is_empty());
    let number = |name: &str| row.to.keys().position(|known| *known == name);
    let numbered = |own: Vec<(&str, u32)>| {
        let own = own.into_iter();
        own.filter_map(|(name, offset)| Some((number(name)?, offset)))
            .collect()
    };
    let words = all.into_iter().filter(|(_, own)| !own.is_empty());
    row.words = words.map(|(left, own)| (left, numbered(own))).collect();
    Some(row)
}

impl Row<'_> {
    fn write(&self, from: &str, text: &mut String) {
        let _ = writeln!(text, "        ldr     r0, ={from}_state + {}", self.from);
        for (at, (name, offset)) in (1..).zip(&self.to) {
            let _ = writeln!(text, "        ldr     r{at}, ={name}_state + {offset}");
        }
        for words in self.words.chunks(LOADED.len()) {
            for (word, (left, _)) in LOADED.iter().zip(words) {
                let _ = writeln!(text, "        ldr     {word}, [r0, #{left}]");
            }
            for (word, (_, taken)) in LOADED.iter().zip(words) {
                for (to, offset) in taken {
                    let _ = writeln!(text, "        str     {word}, [r{}, #{offset}]", to + 1);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the copies do: from which word to which, in order.
    fn copied(text: &str) -> Vec<(String, u32, String, u32)> {
        let mut bases: BTreeMap<&str, (&str, u32)> = BTreeMap::new();
        let mut words = BTreeMap::new();
        let mut all = Vec::new();
        for line in text.lines() {
            let parts: Vec<&str> = line.split([' ', ',', '[', ']', '#', '=']).collect();
            let parts: Vec<&str> = parts.into_iter().filter(|part| !part.is_empty()).collect();
            let number = |text: &str| text.parse::<u32>().expect("a number");
            match parts[..] {
                ["ldr", register, name, "+", offset] => {
                    bases.insert(register, (name, number(offset)));
                }
                ["ldr", word, base, offset] => {
                    let (name, first) = bases[base];
                    words.insert(word, (name, first + number(offset)));
                }
                ["str", word, base, offset] => {
                    let ((from, left), (to, first)) = (words[word], bases[base]);
                    assert!(number(offset) <= REACH);
                    all.push((from.into(), left, to.into(), first + number(offset)));
                }
                _ => panic!("{line}"),
            }
        }
        all.sort();
        all
    }

    #[test]
    fn every_word_goes_to_all_who_take_it() {
        let names = ["a", "b", "c", "d", "e", "f"];
        let wires: Vec<Wire> = (0..40_u32)
            .map(|word| {
                let takes = |at: &usize| !(word as usize + at).is_multiple_of(3) || word < 4;
                let takers = (0..names.len()).filter(takes);
                let at = |taker: usize| (names[taker], 200 - 4 * word + 400 * (word % 2));
                (16 * word, takers.map(at).collect())
            })
            .collect();
        let mut expected: Vec<_> = wires
            .iter()
            .flat_map(|(left, taken)| {
                let taken = taken.iter();
                taken.map(|(to, at)| ("own_state".to_string(), *left, format!("{to}_state"), *at))
            })
            .collect();
        expected.sort();
        assert_eq!(copied(&as_assembly("own", wires)), expected);
    }

    #[test]
    fn a_word_is_loaded_once() {
        let taken = vec![("a", 12), ("b", 40), ("c", 8), ("d", 0)];
        let wires: Vec<Wire> = (0..7).map(|word| (4 * word, taken.clone())).collect();
        let wires: Vec<Wire> = wires
            .into_iter()
            .map(|(left, taken)| {
                (
                    left,
                    taken.iter().map(|(to, at)| (*to, at + left)).collect(),
                )
            })
            .collect();
        let text = as_assembly("own", wires);
        assert_eq!(text.matches("ldr").count(), 5 + 7);
        assert_eq!(text.matches("str").count(), 28);
    }
}
