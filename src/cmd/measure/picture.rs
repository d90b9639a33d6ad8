//! The picture of what was measured, and the page.

use whippen_runtime::device::Device;
use whippen_runtime::measure::{Branch, DEFINITIONS, GRAM_FORCE_N, sweep_motion};
use whippen_runtime::plot::{Curve, Map};
use whippen_runtime::report::{Cell, Made, Page, Row, Section, Table};
use whippen_runtime::session::{self, Keep, Recording};

use super::compare::compared;
use super::table::{name, rows};
use super::{Key, Measurement};
use crate::cmd::command;
use crate::cmd::run::stopped;
use crate::exit::Failure;

/// The weights that are drawn along the keys.
const WEIGHTS: [&str; 4] = [
    "down_weight",
    "balance_weight",
    "up_weight",
    "friction_weight",
];

/// Force over travel of one key, or weights along the keys.
pub fn map(all: &Measurement) -> Map {
    match &all.keys[..] {
        [one] => of_key(one, all),
        _ => along_keys(all),
    }
}

fn of_key(key: &Key, all: &Measurement) -> Map {
    let curve = |name: &str, branch: &Branch| Curve {
        name: name.to_string(),
        points: branch
            .points
            .iter()
            .map(|p| (1e3 * p.0, p.1 / GRAM_FORCE_N))
            .collect(),
        dots: false,
    };
    let touch = &key.measured.touch;
    let mut curves = vec![curve("press", &touch.press), curve("return", &touch.back)];
    if let Some(let_off) = touch.let_off() {
        curves.push(Curve {
            name: "let-off".to_string(),
            points: vec![(1e3 * let_off.travel_m, let_off.force_n / GRAM_FORCE_N)],
            dots: true,
        });
    }
    let speed = 1e3 * all.protocol.speed_m_per_s;
    Map {
        title: format!(
            "{}: pressed and let up at {speed} mm/s",
            key.compiled.model.name.replace('_', " ")
        ),
        abscissa: "key travel (mm)".to_string(),
        ordinate: "force (gf)".to_string(),
        starts: (0.0, lowest(&curves)),
        ends: (1e3 * all.protocol.dip_m, highest(&curves)),
        curves,
    }
}

fn along_keys(all: &Measurement) -> Map {
    let place = |note: u8| f64::from(note) - 20.0;
    let measured = WEIGHTS.iter().map(|weight| Curve {
        name: weight.replace('_', " "),
        points: all
            .keys
            .iter()
            .filter_map(|key| {
                let value = key.measured.value(weight)?;
                Some((place(key.note?), value / GRAM_FORCE_N))
            })
            .collect(),
        dots: false,
    });
    let recorded = compared(all).into_iter().filter(|c| c.what.unit == "n");
    let recorded = recorded.map(|c| Curve {
        name: c.title.trim_end_matches("_g").replace('_', " "),
        points: (c.pairs.iter())
            .map(|pair| (place(pair.0), pair.1 / GRAM_FORCE_N))
            .collect(),
        dots: true,
    });
    let curves: Vec<Curve> = measured.chain(recorded).collect();
    let keys = || all.keys.iter().filter_map(|key| key.note).map(place);
    Map {
        title: format!(
            "{}: weights along the keys",
            all.keys[0].compiled.model.name.replace('_', " ")
        ),
        abscissa: "key (1 is A0)".to_string(),
        ordinate: "weight (gf)".to_string(),
        starts: (keys().fold(88.0, f64::min), lowest(&curves)),
        ends: (keys().fold(1.0, f64::max), highest(&curves)),
        curves,
    }
}

fn values(curves: &[Curve]) -> impl Iterator<Item = f64> {
    curves.iter().flat_map(|c| &c.points).map(|p| p.1)
}

/// The lower end of the axis, 0 at the most.
fn lowest(curves: &[Curve]) -> f64 {
    1.05 * values(curves).fold(0.0, f64::min)
}

/// The upper end of the axis.
fn highest(curves: &[Curve]) -> f64 {
    1.05 * values(curves).fold(1.0, f64::max)
}

/// The page: the numbers of each key, and the slow press of the first to explore.
pub fn page(
    all: &Measurement,
    device: &Device,
    sources: &[(String, String)],
    settings: &[(String, String)],
) -> Result<Page, Failure> {
    let compiled = &all.keys[0].compiled;
    let engine = all.protocol.engine;
    let (place, seconds) = sweep_motion(all.protocol.dip_m, all.protocol.speed_m_per_s);
    let rate_hz = f64::from(compiled.model.rate_hz);
    let columns = session::recorded(compiled, device, engine, &[]);
    let recording = Recording::new(columns, Keep::Bounded);
    let move_to = |tick: usize, places: &mut [f64]| places.fill(place(tick as f64 / rate_hz));
    let motion = ((seconds * rate_hz).ceil() as usize, move_to);
    let run = session::record(compiled, device, engine, motion, recording, |_| {});
    let run = run.map_err(|why| stopped(engine, why))?;
    let made = Made {
        engine,
        motion: &[format!(
            "pressed {:.2} mm and let up at {} mm/s",
            1e3 * all.protocol.dip_m,
            1e3 * all.protocol.speed_m_per_s
        )],
        device,
        settings,
        sources,
    };
    let mut section = Section::of_run(compiled, &run, &made);
    let title = format!("{}, measured", section.title);
    section.tables.insert(0, numbers(all));
    Ok(Page {
        title,
        command: command::typed(),
        overview: None,
        sections: vec![section],
    })
}

fn numbers(all: &Measurement) -> Table {
    let row = |cells: Vec<Cell>| Row {
        cells,
        ..Row::default()
    };
    if let [one] = &all.keys[..] {
        let cells = rows(&one.measured).into_iter().map(|r| {
            let value = r.value.trim_start().to_string();
            row([r.name, value, r.expected].map(Cell::text).to_vec())
        });
        return Table {
            title: "Measured".into(),
            note: "Beside what technicians expect of a grand piano.".into(),
            heads: ["", "measured", "expected of a grand"]
                .map(String::from)
                .to_vec(),
            rows: cells.collect(),
        };
    }
    let cells = |key: &Key| {
        let numbers = DEFINITIONS
            .iter()
            .map(|d| match key.measured.value(d.name) {
                Some(value) => Cell::number(value, super::table::number(d.unit, value)),
                None => Cell::text("none"),
            });
        let name = Cell::text(key.name().unwrap_or_default());
        row(std::iter::once(name).chain(numbers).collect())
    };
    let heads = DEFINITIONS
        .iter()
        .map(|d| format!("{} ({})", name(d), super::table::unit(d.unit)));
    Table {
        title: "Measured".into(),
        note: String::new(),
        heads: std::iter::once("key".to_string()).chain(heads).collect(),
        rows: all.keys.iter().map(cells).collect(),
    }
}
