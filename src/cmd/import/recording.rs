//! A recording of force over travel as two branches: pressed, and let go.
//!
//! ```text
//!   x_um,force_gf,..               down to the deepest place, then up again
//!   x_mm,branch,force_N            `press` or `return` in each line
//!   x_mm,press_gf,return_gf        a column for each branch
//! ```
//!
//! Not here: what single points are worth (`glitches`), and how few of them are needed (`curve`).

use whippen_compiler::check::{TitledText, short};
use whippen_compiler::units::{Dim, Unit, split_title};

/// Fewest points of a branch.
const POINTS_MIN: usize = 10;
/// Travels (m) that a key has.
const TRAVEL_M: [f64; 2] = [0.2e-3, 50e-3];
/// Forces (N) that a key's largest is.
const FORCE_N: [f64; 2] = [0.02, 50.0];
/// A gap is wider than this many usual steps, and than this part of the travel.
const GAP_STEPS: f64 = 10.0;
const GAP_PART: f64 = 0.03;
/// The branch of the press may lie so far (N) below the other on the average.
const BELOW_N: f64 = 0.02;

/// A place (m) and the force there (N).
pub type Point = (f64, f64);

/// Both branches, each from the lowest place to the deepest.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    pub press: Vec<Point>,
    pub back: Vec<Point>,
    /// Where a switch closed on the way down, and opened on the way up (m).
    pub closes_m: Option<f64>,
    pub opens_m: Option<f64>,
    /// The unit in which forces are written.
    pub unit_of_force: String,
}

/// A line: its number, place, force, branch if it says one, and whether the switch was closed.
struct RecordedRow {
    line: usize,
    x: f64,
    force: f64,
    pressed: Option<bool>,
    closed: Option<bool>,
}

/// Which columns are what.
struct Columns {
    x: (usize, Unit),
    forces: Vec<(usize, Unit)>,
    branch: Option<usize>,
    closed: Option<usize>,
    titles: Vec<String>,
}

/// Reads a recording.
///
/// # Errors
/// What is wrong with it, in words.
pub fn read(text: &str) -> Result<Recording, String> {
    let text = TitledText::of(text).map_err(|why| format!("it {why}"))?;
    if !text.is_table() {
        return Err("it is no table: its first line has a single column".to_string());
    }
    let columns = Columns::find(&text)?;
    let mut rows = Vec::new();
    for (line, cells) in text.rows() {
        rows.extend(columns.rows(line, &cells)?);
    }
    let [press, back] = branches(&rows)?;
    let closes = press.iter().position(|row| row.closed == Some(true));
    let opens = back.iter().position(|row| row.closed == Some(true));
    let (closes_m, opens_m) = (closes.map(|at| press[at].x), opens.map(|at| back[at].x));
    let unit = columns.titles[columns.forces[0].0].rsplit('_').next();
    let recording = Recording {
        press: points(&press, "press")?,
        back: points(&back, "return")?,
        closes_m: closes_m.filter(|x| *x > 0.0),
        opens_m: opens_m.filter(|x| *x > 0.0),
        unit_of_force: unit.unwrap_or("N").to_string(),
    };
    recording.check()?;
    Ok(recording)
}

impl Columns {
    fn find(text: &TitledText) -> Result<Columns, String> {
        let titles = &text.titles;
        let with = |dim: Dim| {
            let all = titles.iter().enumerate();
            let units = all.filter_map(|(at, title)| Some((at, split_title(title).1?)));
            let found: Vec<(usize, Unit)> = units.filter(|(_, unit)| unit.dim == dim).collect();
            found
        };
        let shown = text.shown_titles();
        let one = |kind: &str, example: &str| {
            format!(
                "it needs one column of {kind} with its unit in the title, such as `{example}`; its titles are {shown}"
            )
        };
        let [x] = with(Dim::LENGTH)[..] else {
            return Err(one("travel", "x_mm"));
        };
        let mut forces = with(Dim::FORCE);
        if forces.len() == 2 {
            let titles = forces.iter().map(|(at, _)| branch_of(titles[*at]));
            match titles.collect::<Vec<_>>()[..] {
                [Some(true), Some(false)] => {}
                [Some(false), Some(true)] => forces.swap(0, 1),
                _ => {
                    return Err(format!(
                        "of two columns of force one title says `press` and one `return`, such as \
                         `press_gf` and `return_gf`; its titles are {shown}"
                    ));
                }
            }
        }
        if forces.is_empty() || forces.len() > 2 {
            return Err(one("force", "force_gf"));
        }
        let named = |names: &[&str]| titles.iter().position(|title| names.contains(title));
        Ok(Columns {
            x,
            branch: named(&["branch", "direction"]).filter(|_| forces.len() == 1),
            closed: named(&["actuated", "closed"]),
            forces,
            titles: titles.iter().map(ToString::to_string).collect(),
        })
    }

    fn rows(&self, line: usize, cells: &[&str]) -> Result<Vec<RecordedRow>, String> {
        let number = |(column, unit): (usize, Unit)| {
            let text = cells.get(column).copied().unwrap_or("");
            match text.parse::<f64>() {
                Ok(number) if number.is_finite() => Ok(unit.to_si(number)),
                _ => Err(format!(
                    "line {line}: `{}` is no number",
                    short(text).trim_matches('`')
                )),
            }
        };
        let pressed = match self.branch.map(|at| cells.get(at).copied().unwrap_or("")) {
            None => None,
            Some(word) => Some(branch_of(word).ok_or_else(|| {
                format!(
                    "line {line}: {} is neither `press` nor `return`",
                    short(word)
                )
            })?),
        };
        let closed = self.closed.and_then(|at| match cells.get(at).copied() {
            Some("1") => Some(true),
            Some("0") => Some(false),
            _ => None,
        });
        let x = number(self.x)?;
        let two = self.forces.len() == 2;
        let row = |(at, force): (usize, &(usize, Unit))| {
            let force = number(*force)?;
            let pressed = if two { Some(at == 0) } else { pressed };
            Ok(RecordedRow {
                line,
                x,
                force,
                pressed,
                closed,
            })
        };
        self.forces.iter().enumerate().map(row).collect()
    }
}

/// Which branch a word is about: of the press, or of the return.
fn branch_of(word: &str) -> Option<bool> {
    let word = word.to_ascii_lowercase();
    let has = |words: &[&str]| words.iter().any(|own| word.contains(own));
    match (
        has(&["press", "down"]),
        has(&["return", "release", "back", "up"]),
    ) {
        (true, false) => Some(true),
        (false, true) => Some(false),
        _ => None,
    }
}

/// The rows of the press and of the return.
fn branches(rows: &[RecordedRow]) -> Result<[Vec<&RecordedRow>; 2], String> {
    if rows.iter().any(|row| row.pressed.is_some()) {
        let of = |pressed| {
            rows.iter()
                .filter(move |row| row.pressed == Some(pressed))
                .collect()
        };
        return Ok([of(true), of(false)]);
    }
    let deepest = (0..rows.len()).reduce(|a, b| if rows[b].x > rows[a].x { b } else { a });
    let deepest = deepest.ok_or("it has titles and no numbers")?;
    let (press, back) = rows.split_at(deepest + 1);
    if press.len() < POINTS_MIN && back.len() >= POINTS_MIN {
        return Err(
            "it begins where the key is down: the press must stand before the return".to_string(),
        );
    }
    Ok([press.iter().collect(), back.iter().collect()])
}

/// A branch by rising places; of readings at one place the mean.
fn points(rows: &[&RecordedRow], name: &str) -> Result<Vec<Point>, String> {
    if rows.len() < POINTS_MIN {
        return Err(format!(
            "its {name} has {} points, and at least {POINTS_MIN} are needed; a recording goes all the way down and up again",
            rows.len()
        ));
    }
    let falls = rows[0].x > rows[rows.len() - 1].x;
    let mut ordered: Vec<&&RecordedRow> = rows.iter().collect();
    if falls {
        ordered.reverse();
    }
    for two in ordered.windows(2) {
        if two[1].x < two[0].x {
            let line = two[0].line.max(two[1].line);
            return Err(format!("line {line}: the {name} turns round in the middle"));
        }
    }
    let mut points: Vec<(f64, f64, f64)> = Vec::new();
    for row in ordered {
        match points.last_mut() {
            Some(last) if last.0 == row.x => (last.1, last.2) = (last.1 + row.force, last.2 + 1.0),
            _ => points.push((row.x, row.force, 1.0)),
        }
    }
    Ok(points
        .into_iter()
        .map(|(x, sum, count)| (x, sum / count))
        .collect())
}

impl Recording {
    /// From where to where both branches go (m).
    pub fn travel_m(&self) -> [f64; 2] {
        let ends = |branch: &[Point]| [branch[0].0, branch[branch.len() - 1].0];
        let ([a, b], [c, d]) = (ends(&self.press), ends(&self.back));
        [a.max(c), b.min(d)]
    }

    fn check(&self) -> Result<(), String> {
        let [low, high] = self.travel_m();
        let travel = high - low;
        if !(TRAVEL_M[0]..=TRAVEL_M[1]).contains(&travel) {
            return Err(format!(
                "a travel of {} mm is no key's; look at its unit",
                rounded(1e3 * travel)
            ));
        }
        let largest = self.press.iter().map(|point| point.1).fold(0.0, f64::max);
        if !(FORCE_N[0]..=FORCE_N[1]).contains(&usual_largest(&self.press)) {
            return Err(format!(
                "a force of {} N is no key's; look at its unit",
                rounded(largest)
            ));
        }
        for (branch, name) in [(&self.press, "press"), (&self.back, "return")] {
            gap(branch, travel).map_or(Ok(()), |[from, to]| {
                Err(format!(
                    "its {name} has a gap from {} mm to {} mm",
                    rounded(1e3 * from),
                    rounded(1e3 * to)
                ))
            })?;
        }
        let below = -self.mean_gap_n();
        if below > BELOW_N {
            return Err(format!(
                "its press lies below its return, by {} gf on the average: the branches are swapped",
                rounded(below / GRAM_N)
            ));
        }
        Ok(())
    }

    /// How far the press lies above the return (N), without the last tenth of the travel, in which
    /// a rig turns round.
    pub fn mean_gap_n(&self) -> f64 {
        let [low, high] = self.travel_m();
        let places = (0..200).map(|n| low + (high - low) * 0.9 * f64::from(n) / 200.0);
        let gaps = places.map(|x| at(&self.press, x) - at(&self.back, x));
        gaps.sum::<f64>() / 200.0
    }
}

/// The weight of a gram (N).
pub const GRAM_N: f64 = 9.80665e-3;

/// The force of a branch at a place, linear between its points.
pub fn at(branch: &[Point], x: f64) -> f64 {
    let behind = branch
        .partition_point(|point| point.0 <= x)
        .clamp(1, branch.len() - 1);
    let ((from, low), (to, high)) = (branch[behind - 1], branch[behind]);
    low + (high - low) * ((x - from) / (to - from)).clamp(0.0, 1.0)
}

/// The largest force but for the largest hundredth, which may be wrong readings.
fn usual_largest(branch: &[Point]) -> f64 {
    let mut forces: Vec<f64> = branch.iter().map(|point| point.1).collect();
    forces.sort_by(f64::total_cmp);
    forces[(forces.len() - 1) * 99 / 100]
}

fn gap(branch: &[Point], travel: f64) -> Option<[f64; 2]> {
    let mut steps: Vec<f64> = branch.windows(2).map(|two| two[1].0 - two[0].0).collect();
    steps.sort_by(f64::total_cmp);
    let widest = (GAP_STEPS * steps[steps.len() / 2]).max(GAP_PART * travel);
    let wide = branch.windows(2).find(|two| two[1].0 - two[0].0 > widest);
    wide.map(|two| [two[0].0, two[1].0])
}

/// A number with three digits behind the point at most.
pub fn rounded(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}
