//! What was measured on a real keyboard: a table with a row for each key, and how far a program's
//! keys are from it.
//!
//! A column takes part whose title begins with the name of a [`Definition`] and ends in a unit of
//! its kind: `down_weight_g`, `up_weight_n`, `key_dip_mm`. Titles may say more in between.

use std::path::Path;

use super::{DEFINITIONS, Definition, GRAM_FORCE_N, Measured};
use crate::files::{FileError, InputKind, read_text};

/// The MIDI number of the lowest key of a piano, which tables call key 1.
const LOWEST_NOTE: u8 = 21;

/// Units of columns: how a title ends, the unit as definitions have it, and its size.
const UNITS: [(&str, &str, f64); 6] = [
    ("_gf", "n", GRAM_FORCE_N),
    ("_g", "n", GRAM_FORCE_N),
    ("_n", "n", 1.0),
    ("_mm", "m", 1e-3),
    ("_m", "m", 1.0),
    ("_hz", "hz", 1.0),
];

/// A column of a table.
#[derive(Debug, Clone, PartialEq)]
struct RecordedColumn {
    title: String,
    what: Definition,
    /// Notes (MIDI numbers) and values (SI).
    values: Vec<(u8, f64)>,
}

/// A table of measured keys.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedKeys {
    columns: Vec<RecordedColumn>,
    /// Titles of columns that are nothing that is measured here.
    pub unused: Vec<String>,
}

/// How far keys are from a column of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Compared {
    /// The title of the column.
    pub title: String,
    /// What it is.
    pub what: Definition,
    /// Notes, and what was recorded and measured there (SI).
    pub pairs: Vec<(u8, f64, f64)>,
}

impl Compared {
    fn mean(&self, of: impl Fn(&(u8, f64, f64)) -> f64) -> f64 {
        self.pairs.iter().map(of).sum::<f64>() / self.pairs.len() as f64
    }

    /// The mean of what was recorded (SI).
    pub fn recorded(&self) -> f64 {
        self.mean(|pair| pair.1)
    }

    /// How much more was measured than recorded, in the mean (SI).
    pub fn difference(&self) -> f64 {
        self.mean(|pair| pair.2 - pair.1)
    }

    /// The root of the mean square of the differences (SI).
    pub fn rms(&self) -> f64 {
        let square = |pair: &(u8, f64, f64)| (pair.2 - pair.1) * (pair.2 - pair.1);
        self.mean(square).sqrt()
    }

    /// The note with the greatest difference, and that difference (SI).
    pub fn worst(&self) -> (u8, f64) {
        let differences = self.pairs.iter().map(|pair| (pair.0, pair.2 - pair.1));
        let worst = differences.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()).then(b.0.cmp(&a.0)));
        worst.unwrap_or((LOWEST_NOTE, 0.0))
    }
}

impl RecordedKeys {
    /// Reads a table.
    ///
    /// # Errors
    /// The file cannot be read, has no column `key` or none that is measured, or holds what is no
    /// number.
    pub fn load(path: &Path) -> Result<RecordedKeys, FileError> {
        let text = read_text(path, InputKind::CALIBRATION)?;
        RecordedKeys::parse(&text).map_err(|why| FileError::new(path, why))
    }

    fn parse(text: &str) -> Result<RecordedKeys, String> {
        let mut reader = csv::ReaderBuilder::new()
            .comment(Some(b'#'))
            .trim(csv::Trim::All)
            .from_reader(text.as_bytes());
        let titles = reader.headers().map_err(|e| e.to_string())?.clone();
        let key = titles.iter().position(|title| title == "key");
        let key = key.ok_or("there is no column `key`; key 1 is the lowest of a piano, A0")?;
        let mut columns: Vec<(usize, f64, RecordedColumn)> = Vec::new();
        let mut unused = Vec::new();
        for (at, title) in titles.iter().enumerate().filter(|(at, _)| *at != key) {
            match meaning(title) {
                Some((what, size)) => {
                    let (title, values) = (title.to_string(), Vec::new());
                    columns.push((
                        at,
                        size,
                        RecordedColumn {
                            title,
                            what,
                            values,
                        },
                    ));
                }
                None => unused.push(title.to_string()),
            }
        }
        if columns.is_empty() {
            return Err(
                "no column is anything that is measured; titles are such as `down_weight_g`, `up_weight_g`, `key_dip_mm`"
                    .to_string(),
            );
        }
        for (number, row) in reader.records().enumerate() {
            let row = row.map_err(|e| e.to_string())?;
            read_row(&row, key, &mut columns)
                .map_err(|why| format!("row {}: {why}", number + 1))?;
        }
        let columns = columns.into_iter().map(|column| column.2).collect();
        Ok(RecordedKeys { columns, unused })
    }

    /// Sets keys beside the table. A key without a note stands for each key of the table.
    pub fn compare(&self, keys: &[(Option<u8>, &Measured)]) -> Vec<Compared> {
        let one = |column: &RecordedColumn| {
            let measured = |note: u8| {
                let own = |key: &&(Option<u8>, &Measured)| key.0.is_none_or(|own| own == note);
                keys.iter().find(own)?.1.value(column.what.name)
            };
            let pair = |value: &(u8, f64)| Some((value.0, value.1, measured(value.0)?));
            Compared {
                title: column.title.clone(),
                what: column.what,
                pairs: column.values.iter().filter_map(pair).collect(),
            }
        };
        let all = self.columns.iter().map(one);
        all.filter(|compared| !compared.pairs.is_empty()).collect()
    }
}

/// What a title means, and the size of its unit.
fn meaning(title: &str) -> Option<(Definition, f64)> {
    let (_, unit, size) = UNITS.iter().find(|unit| title.ends_with(unit.0))?;
    let is_meant = |d: &&Definition| title.starts_with(d.name) && d.unit == *unit;
    DEFINITIONS.iter().find(is_meant).map(|d| (*d, *size))
}

fn read_row(
    row: &csv::StringRecord,
    key: usize,
    columns: &mut [(usize, f64, RecordedColumn)],
) -> Result<(), String> {
    let text = row.get(key).unwrap_or_default();
    let number = text.parse::<u8>().ok().filter(|key| (1..=88).contains(key));
    let number = number.ok_or_else(|| format!("`{text}` is no key from 1 (A0) to 88 (C8)"))?;
    for (at, size, column) in columns {
        let text = row.get(*at).unwrap_or_default();
        if text.is_empty() {
            continue;
        }
        let value = text.parse::<f64>().ok().filter(|value| value.is_finite());
        let value = value.ok_or_else(|| format!("`{text}` in `{}` is no number", column.title))?;
        column
            .values
            .push((LOWEST_NOTE + number - 1, value * *size));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const TABLE: &str = "\
key,down_weight_no_spring_g,up_weight_n,front_weight_g
1,50,0.20,7
40,60,,7
";

    #[test]
    fn keys_stand_beside_what_was_recorded() {
        let table = RecordedKeys::parse(TABLE).expect("a table");
        assert_eq!(table.unused, ["front_weight_g"]);
        let mut key = Measured::default();
        key.set("down_weight", Some(55.0 * GRAM_FORCE_N));
        key.set("up_weight", Some(0.25));
        let found = table.compare(&[(None, &key)]);
        let [down, up] = &found[..] else {
            panic!("{found:?}")
        };
        let grams = |n: f64| (n / GRAM_FORCE_N * 1e6).round() / 1e6;
        assert_eq!(down.title, "down_weight_no_spring_g");
        assert_eq!(
            [down.recorded(), down.difference(), down.rms()].map(grams),
            [55.0, 0.0, 5.0]
        );
        assert_eq!((down.worst().0, grams(down.worst().1)), (21, 5.0));
        assert_eq!((up.pairs.len(), up.pairs[0].0), (1, 21));
        // A key with a note is set beside its own.
        let found = table.compare(&[(Some(60), &key)]);
        assert_eq!(
            (found.len(), found[0].pairs.len(), found[0].pairs[0].0),
            (1, 1, 60)
        );
    }

    #[test]
    fn mistakes_in_a_table_are_told() {
        for (text, why) in [
            ("down_weight_g\n50\n", "no column `key`"),
            ("key,front_weight_g\n1,7\n", "such as `down_weight_g`"),
            ("key,down_weight_mm\n1,7\n", "such as `down_weight_g`"),
            ("key,down_weight_g\n0,7\n", "row 1: `0` is no key"),
            ("key,down_weight_g\n1,7\n2,nan\n", "row 2: `nan`"),
            ("", "no column `key`"),
        ] {
            let found = RecordedKeys::parse(text).unwrap_err();
            assert!(found.contains(why), "{text}: {found}");
        }
    }
}
