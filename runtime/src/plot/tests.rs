//! Whole figures, of a rough hammer: enough to have forces, flights, strikes and states.

use super::*;
use crate::gesture::default_gesture;
use crate::trace::{EventRow, Heading};

const RATE_HZ: u32 = 44_100;

/// A hammer on a spring under the key, thrown against a string. Not the instrument, only data that
/// looks like it.
fn hammer_trace(travel_m: Vec<f64>) -> Trace {
    let names = [
        "f",
        "contact",
        "weight",
        "friction",
        "escapement",
        "inertia",
        "phi",
        "motion",
    ];
    let units = ["n", "n", "n", "n", "n", "n", "rad", ""];
    let mut values = vec![Vec::with_capacity(travel_m.len()); names.len()];
    let (mut phi, mut rate, mut before, mut smooth, mut events) =
        (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64, Vec::new());
    for (tick, &x) in travel_m.iter().enumerate() {
        let dt = 1.0 / f64::from(RATE_HZ);
        smooth += 0.02 * ((x - before) / dt - smooth);
        before = x;
        let squeeze = 0.73 * x.min(0.006) - 0.0178 * phi;
        let push = if squeeze >= 0.0 {
            (8e3 * squeeze + 50.0 * (0.73 * smooth - 0.0178 * rate)).max(0.0)
        } else {
            0.0
        };
        rate += dt * (0.0178 * push - 0.01186) / 1.54e-4;
        phi += dt * rate;
        if phi >= 0.365 && rate > 0.0 {
            let args = vec![("speed_m_per_s".to_string(), rate * 0.137)];
            events.push(EventRow {
                t_s: tick as f64 * dt,
                key: 0,
                event: "note".into(),
                args,
            });
            rate *= -0.5;
        }
        if phi < 0.0 {
            (phi, rate) = (0.0, 0.0);
        }
        let bump = (0.2 * (1.0 - ((x - 0.0072) / 0.0012).abs())).max(0.0);
        let terms = [
            push * 0.73,
            -0.13,
            (30.0 * smooth).clamp(-0.13, 0.13),
            bump,
            0.0,
        ];
        let state = f64::from(u8::from(squeeze < -1e-4))
            + f64::from(u8::from(squeeze < -1e-4 && rate < 0.0));
        let row = [terms.iter().sum::<f64>()]
            .into_iter()
            .chain(terms)
            .chain([phi, state]);
        values
            .iter_mut()
            .zip(row)
            .for_each(|(column, v)| column.push(v));
    }
    let mut columns: Vec<Column> = names
        .iter()
        .zip(units)
        .zip(values)
        .map(|((name, unit), values)| Column {
            heading: Heading {
                name: (*name).into(),
                unit: unit.into(),
                ..Heading::default()
            },
            record: values.into(),
        })
        .collect();
    if let Some(motion) = columns.last_mut() {
        motion.heading.labels = ["touching", "flying up", "falling"]
            .map(String::from)
            .to_vec();
    }
    columns.push(Column {
        heading: Heading {
            name: "x".into(),
            unit: "m".into(),
            ..Heading::default()
        },
        record: travel_m.into(),
    });
    Trace {
        rate_hz: RATE_HZ.into(),
        start_s: 0.0,
        columns,
        events,
        ..Trace::default()
    }
}

fn roles() -> Roles {
    Roles {
        is_of_key: true,
        title: "Grand piano: the bundled gesture".into(),
        travel: "x_m".into(),
        forces: [
            "contact_n",
            "weight_n",
            "friction_n",
            "escapement_n",
            "inertia_n",
        ]
        .map(String::from)
        .to_vec(),
        total: "f_n".into(),
        coordinates: vec!["phi_rad".into()],
        machines: vec!["motion".into()],
        mark: "note".into(),
    }
}

fn bundled() -> Trace {
    hammer_trace(default_gesture().positions(RATE_HZ))
}

#[test]
fn panels_axes_and_legends_say_what_is_drawn() {
    let (trace, roles) = (bundled(), roles());
    let drawing = layout::draw(&Figure::of(&trace, &roles));
    let mut rows: Vec<(i64, i64, &str)> = Vec::new();
    for shape in &drawing.shapes {
        if let drawing::Shape::Text { at, text, .. } = shape {
            assert!(
                (0.0..drawing.width).contains(&at.0) && (0.0..drawing.height).contains(&at.1),
                "{text} at {at:?}"
            );
            rows.push((at.1 as i64, at.0 as i64, text));
        }
    }
    rows.sort_unstable();
    let text: Vec<String> = rows
        .chunk_by(|a, b| a.0 == b.0)
        .map(|r| r.iter().map(|t| t.2).collect::<Vec<_>>().join(" | "))
        .collect();
    insta::assert_snapshot!(text.join("\n"));
}

#[test]
fn both_outputs_are_whole_and_reproducible() {
    let (trace, roles) = (bundled(), roles());
    let figure = Figure::of(&trace, &roles);
    let (svg, png) = (figure.svg(), figure.png().unwrap());
    assert_eq!((&svg, &png), (&figure.svg(), &figure.png().unwrap()));
    assert!(
        svg.starts_with("<svg ")
            && svg.ends_with("</svg>\n")
            && !svg.contains("NaN")
            && !svg.contains("inf")
    );
    let picture = tiny_skia::Pixmap::decode_png(&png).unwrap();
    assert_eq!(picture.width(), 2000);
    for (name, colour) in [
        ("total", frame::BLACK),
        ("first term", frame::line_colour(0)),
        ("flying up", frame::band_colour(1)),
    ] {
        let [_, r, g, b] = colour.to_be_bytes();
        let count = picture
            .pixels()
            .iter()
            .filter(|p| (p.red(), p.green(), p.blue()) == (r, g, b))
            .count();
        assert!(count > 500, "{name}: {count} pixels");
    }
}

#[test]
fn odd_data_does_not_panic() {
    let roles = roles();
    let odd: [&[f64]; 7] = [
        &[],
        &[0.001],
        &[0.0, 0.0],
        &[0.002; 500],
        &[f64::NAN; 3],
        &[f64::INFINITY, 0.0],
        &[1e300, -1e300],
    ];
    for travel in odd {
        let trace = hammer_trace(travel.to_vec());
        let figure = Figure::of(&trace, &roles);
        assert!(
            figure.svg().ends_with("</svg>\n") && figure.png().is_some(),
            "{travel:?}"
        );
    }
    let mut ragged = hammer_trace(vec![0.001; 50]);
    ragged.columns[3].record = ragged.columns[3].values()[..7].to_vec().into();
    ragged.columns[7].record = vec![99.0, -1.0, f64::NAN].into();
    ragged.events.push(EventRow {
        t_s: -5.0,
        event: "note".into(),
        ..EventRow::default()
    });
    let figure = Figure::of(&ragged, &roles);
    assert!(figure.svg().ends_with("</svg>\n") && figure.png().is_some());
    let nothing = Figure::default();
    assert!(nothing.svg().ends_with("</svg>\n") && nothing.png().is_some());
}

#[test]
fn a_long_recording_is_as_small_as_a_short_one() {
    let roles = roles();
    let travel = default_gesture().positions(RATE_HZ);
    let (short, long) = (hammer_trace(travel.clone()), hammer_trace(travel.repeat(9)));
    let (short, long) = (
        Figure::of(&short, &roles).svg().len(),
        Figure::of(&long, &roles).svg().len(),
    );
    assert!(long < 3 * short, "{short} bytes for 4 s, {long} for 38 s");
}

#[test]
fn a_peak_of_one_tick_in_an_hour_is_drawn() {
    let mut record = Record::bounded().with_head();
    let ticks = 3600 * 1000;
    (0..ticks).for_each(|tick| record.push(if tick == 3_000_001 { 7.0 } else { 0.0 }));
    let series = || Series {
        name: "x",
        unit: "m",
        record: &record,
    };
    let figure = Figure {
        rate_hz: 1000.into(),
        start_s: 50.0,
        travel: Some(series()),
        total: Some(series()),
        ..Figure::default()
    };
    let lines = decimate::line(
        record.points(),
        |tick| tick as f64 / 5000.0,
        &axis::Axis::exact(0.0, 7.0, 100.0, 0.0),
    );
    assert!(lines[0].iter().any(|point| point.1 == 0.0), "{lines:?}");
    let svg = figure.svg();
    assert!(
        svg.len() < 20_000 && svg.contains("in the first 524.3 s") && svg.contains("3500"),
        "{svg}"
    );
}

#[test]
fn figures_are_saved_by_the_end_of_their_names() {
    let dir = tempfile::tempdir().unwrap();
    let names = ["a<b".to_string(), "c".to_string()];
    let record = vec![0.0, 1.0].into();
    let machine = Machine {
        name: "m & n",
        states: &names,
        record: &record,
    };
    let figure = Figure {
        title: "t".into(),
        rate_hz: 10.into(),
        machines: vec![machine],
        ..Figure::default()
    };
    let (svg, png) = (dir.path().join("f.svg"), dir.path().join("f.png"));
    save(&figure, &svg).unwrap();
    save(&figure, &png).unwrap();
    let text = std::fs::read_to_string(&svg).unwrap();
    assert!(
        text.contains("m &amp; n") && text.contains("a&lt;b"),
        "{text}"
    );
    assert_eq!(std::fs::read(&png).unwrap()[1..4], *b"PNG");
    let error = save(&figure, &dir.path().join("f.pdf")).unwrap_err();
    assert_eq!(error.message, "a figure's name ends in `.svg` or `.png`");
    save(&figure, &dir.path().join("F.SVG")).unwrap();
}

#[test]
fn what_a_sound_is_made_of_stands_by_frequency_and_level() {
    for (amplitude, levels) in [
        (0.5, ["0 dB", "\u{2212}20 dB", "\u{2212}80 dB"]),
        (0.0, ["\u{2212}60 dB", "\u{2212}80 dB", "\u{2212}140 dB"]),
    ] {
        let mut spectrogram = crate::spectrogram::Spectrogram::new("out", RATE_HZ.into());
        for tick in 0..RATE_HZ {
            let turns = 440.0 * f64::from(tick) / f64::from(RATE_HZ);
            spectrogram.push(amplitude * libm::sin(std::f64::consts::TAU * turns));
        }
        spectrogram.finish();
        let trace = Trace {
            rate_hz: RATE_HZ.into(),
            columns: vec![Column {
                heading: Heading {
                    name: "x".into(),
                    unit: "m".into(),
                    labels: Vec::new(),
                    step: None,
                },
                record: vec![0.0; RATE_HZ as usize].into(),
            }],
            spectrograms: vec![spectrogram],
            ..Trace::default()
        };
        let drawing = layout::draw(&Figure::of(&trace, &Roles::default()));
        let texts: Vec<&str> = drawing
            .shapes
            .iter()
            .filter_map(|shape| match shape {
                drawing::Shape::Text { text, .. } => Some(text.as_str()),
                _ => None,
            })
            .collect();
        for text in ["out: spectrum (Hz)", "50", "440", "1000", "20000"] {
            assert_eq!(texts.contains(&text), text != "440", "{text}: {texts:?}");
        }
        assert!(
            levels.iter().all(|level| texts.contains(level)),
            "{texts:?}"
        );
        let image = drawing.shapes.iter().find_map(|shape| match shape {
            drawing::Shape::Image {
                pixels, columns, ..
            } => Some((pixels, *columns)),
            _ => None,
        });
        let (pixels, columns) = image.expect("a picture");
        // Row by row from the top: the darkest of the middle column is the sine's band.
        let column = pixels.iter().skip(columns / 2).step_by(columns);
        let darkness = |pixel: &u32| {
            3 * 255
                - pixel
                    .to_be_bytes()
                    .iter()
                    .map(|b| u32::from(*b))
                    .sum::<u32>()
        };
        let dark: Vec<u32> = column.map(darkness).collect();
        let most = dark.iter().max().copied();
        let row = dark
            .iter()
            .position(|d| Some(*d) == most)
            .map(|row| dark.len() - 1 - row);
        match amplitude {
            // 48 semitones above the lowest A.
            0.5 => assert_eq!(row, Some(48)),
            _ => assert_eq!(most, Some(0)),
        }
    }
}
