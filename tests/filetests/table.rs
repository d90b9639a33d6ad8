//! `table NAME=1,2 OTHER=3,4 ..`: one key, fed with every combination of values, the last name's
//! fastest; what comes of each is a row. A name that stands twice has the values of both.

/// Runs a kernel on all combinations.
pub fn table(text: &str, words: &[&str]) -> Result<String, String> {
    let mut feeds: Vec<(&str, Vec<&str>)> = Vec::new();
    for word in words {
        let (name, values) = word
            .split_once('=')
            .ok_or_else(|| format!("what is `{word}`?"))?;
        let values = values.split(',');
        match feeds.iter_mut().find(|(known, _)| *known == name) {
            Some((_, known)) => known.extend(values),
            None => feeds.push((name, values.collect())),
        }
    }
    let combined = combinations(&feeds);
    let combined: Vec<&str> = combined.iter().map(String::as_str).collect();
    Ok(aligned(&super::run::rows(text, &combined)?))
}

/// The same feeds, tick by tick.
fn combinations(feeds: &[(&str, Vec<&str>)]) -> Vec<String> {
    let count: usize = feeds.iter().map(|(_, values)| values.len()).product();
    let mut inner = count;
    let mut all = Vec::new();
    for (name, values) in feeds {
        inner /= values.len();
        let ticks = (0..count).map(|tick| values[tick / inner % values.len()]);
        all.push(format!("{name}={}", ticks.collect::<Vec<_>>().join(",")));
    }
    all
}

/// Columns as wide as their widest cell, a bar between what goes in and what comes out.
fn aligned(rows: &[[Vec<String>; 2]]) -> String {
    let width = |side: usize, column: usize| {
        let cells = rows.iter().map(|row| row[side][column].len());
        cells.max().unwrap_or_default()
    };
    let cells = |row: &[Vec<String>; 2], side: usize| {
        let padded = row[side].iter().enumerate();
        let padded = padded.map(|(column, cell)| format!("{cell:>0$}", width(side, column)));
        padded.collect::<Vec<_>>().join("  ")
    };
    let lines = rows
        .iter()
        .map(|row| format!("{} | {}", cells(row, 0), cells(row, 1)));
    lines.collect::<Vec<_>>().join("\n")
}

#[test]
fn the_last_name_is_the_fastest() {
    let feeds = [("a", vec!["1", "2"]), ("b", vec!["3", "4", "5"])];
    assert_eq!(combinations(&feeds), ["a=1,1,1,2,2,2", "b=3,4,5,3,4,5"]);
}
