//! A sweep as text, as a table, as a picture.

use std::path::Path;

use whippen_runtime::files::FileError;
use whippen_runtime::plot::{Curve, HeatMap, Map};

use super::{Args, Done};

/// So many points are shown on a terminal.
const SHOWN_MAX: usize = 100;

fn titles(args: &Args) -> Vec<String> {
    let overs = args.overs.iter().map(|over| over.title());
    let wanted = args.wanted.iter().map(|wanted| wanted.title());
    overs.chain(wanted).collect()
}

fn cells(done: &Done, written: impl Fn(f64) -> String) -> Vec<String> {
    let point = done.point.iter().copied().map(Some);
    let all = point.chain(done.values.iter().copied());
    all.map(|value| value.map_or(String::new(), &written))
        .collect()
}

/// The table with all digits; what is not there is blank.
pub fn csv(args: &Args, all: &[Done]) -> String {
    let mut out = titles(args).join(",") + "\n";
    for done in all {
        out += &(cells(done, |value| value.to_string()).join(",") + "\n");
    }
    out
}

/// The table for people.
pub fn text(args: &Args, all: &[Done]) -> String {
    let titles = titles(args);
    let shown = all.iter().take(SHOWN_MAX);
    let rows = shown.map(|done| {
        let cells = cells(done, short);
        let none = |cell: String| {
            if cell.is_empty() {
                "none".to_string()
            } else {
                cell
            }
        };
        cells.into_iter().map(none).collect::<Vec<_>>()
    });
    let rows: Vec<Vec<String>> = std::iter::once(titles).chain(rows).collect();
    let width = |column: usize| rows.iter().map(|row| row[column].len()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..rows[0].len()).map(width).collect();
    let mut out = String::new();
    for row in &rows {
        let cells = row.iter().zip(&widths);
        let cells: Vec<String> = cells
            .map(|(cell, width)| format!("{cell:>width$}"))
            .collect();
        out += &format!("  {}\n", cells.join("  "));
    }
    if all.len() > SHOWN_MAX {
        out += &format!(
            "  and {} more points; --out FILE.csv has all\n",
            all.len() - SHOWN_MAX
        );
    }
    out
}

/// Four digits that count.
fn short(value: f64) -> String {
    if value == 0.0 {
        return "0".to_string();
    }
    let power = value.abs().log10().floor() as i32;
    if !(-4..9).contains(&power) {
        return format!("{value:.3e}");
    }
    let decimals = (3 - power).max(0) as usize;
    let text = format!("{value:.decimals$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_string()
    } else {
        text
    }
}

/// The first number that is measured, over one parameter or two.
pub fn save_picture(args: &Args, all: &[Done], path: &Path) -> Result<(), FileError> {
    let value = args.wanted[0].title();
    let first = |done: &Done| done.values[0];
    let [over, upwards] = match &args.overs[..] {
        [one] => {
            return curve(args, all, &value)
                .save(path)
                .map(|()| one)
                .map(|_| ());
        }
        [one, two, ..] => [one, two],
        [] => return Ok(()),
    };
    let grid = args.sobol.is_none().then_some(());
    let map = HeatMap {
        title: title(args, &value),
        abscissa: over.axis(),
        ordinate: upwards.axis(),
        value,
        grid: grid.and(over.count.zip(upwards.count)),
        points: all
            .iter()
            .map(|done| (done.point[0], done.point[1], first(done)))
            .collect(),
        lines: lines(args, all),
    };
    map.save(path)
}

/// The values of the program over the first parameter: those at the least second one.
fn lines(args: &Args, all: &[Done]) -> Vec<Curve> {
    let of = |(index, name): (usize, &String)| {
        let mut all: Vec<&Done> = all.iter().collect();
        let key = |done: &Done| (done.point[0], done.point[1]);
        all.sort_by(|a, b| {
            let (a, b) = (key(a), key(b));
            a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
        });
        all.dedup_by(|next, first| next.point[0] == first.point[0]);
        let point = |done: &Done| Some((done.point[0], done.lines.get(index).copied().flatten()?));
        Curve {
            name: name.clone(),
            points: all.into_iter().filter_map(point).collect(),
            dots: false,
        }
    };
    args.lines.iter().enumerate().map(of).collect()
}

fn title(args: &Args, value: &str) -> String {
    let names: Vec<&str> = args.overs.iter().map(|over| over.name.as_str()).collect();
    format!("{value} over {}", names.join(" and "))
}

fn curve(args: &Args, all: &[Done], value: &str) -> Map {
    let mut points: Vec<(f64, f64)> = all
        .iter()
        .filter_map(|done| Some((done.point[0], done.values[0]?)))
        .collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let low = points.iter().map(|p| p.1).fold(0.0, f64::min);
    let high = points.iter().map(|p| p.1).fold(0.0, f64::max);
    let over = &args.overs[0];
    Map {
        title: title(args, value),
        abscissa: over.axis(),
        ordinate: value.to_string(),
        starts: (over.ends.0, 1.05 * low),
        ends: (over.ends.1, 1.05 * high),
        curves: vec![Curve {
            name: value.to_string(),
            points,
            dots: args.sobol.is_some(),
        }],
    }
}
