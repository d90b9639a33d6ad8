//! Whole files: made up ones, and the recordings beside the repository.

use super::*;
use whippen_compiler::model::Moves;
use whippen_compiler::units::Dim;

const TICK_HZ: u32 = 44_100;

/// Loads a file of the given text; messages name it `key.csv`.
fn load_text(text: &str, options: &MotionOptions) -> Result<Motion, String> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("key.csv");
    std::fs::write(&path, text).unwrap();
    load(&path, options, TICK_HZ.into()).map_err(|e| {
        e.to_string()
            .replace(&path.display().to_string(), "key.csv")
    })
}

fn raw(rate_hz: f64, column: usize) -> MotionOptions {
    MotionOptions {
        layout: Layout::Raw {
            rate_hz,
            column,
            calibration: None,
        },
        ..MotionOptions::default()
    }
}

fn titled(rows: &str) -> Result<Motion, String> {
    load_text(rows, &MotionOptions::default())
}

#[test]
fn units_stand_in_the_titles() {
    let in_si = titled("t_s,x_m\n0,0\n0.5,0.005\n1,0.01\n").unwrap();
    let in_milli =
        titled("\u{feff}t_ms , x_mm , f_n\r\n0,0,1\r\n500,5,1\r\n1000,10,1\r\n").unwrap();
    assert_eq!(in_si, in_milli);
    assert_eq!(
        (
            in_si.samples_read,
            in_si.source_rate_hz,
            in_si.positions.ticks()
        ),
        (3, 2.0, 66_150)
    );
    assert!((in_si.positions.at(22_050) - 0.005).abs() < 1e-5);
    let renamed = titled("time_s,force_n,key_mm\n0,1,0\n0.5,1,5\n1,1,10\n").unwrap();
    assert_eq!(renamed, in_si);
}

#[test]
fn a_trace_of_a_gesture_is_read_back_bit_for_bit() {
    let positions = crate::gesture::default_gesture().positions(TICK_HZ);
    let x = crate::trace::Heading {
        name: "x".into(),
        unit: "m".into(),
        ..Default::default()
    };
    let headings = std::iter::once(&x);
    let form = crate::trace::Form::default();
    let mut table = crate::trace::TickTable::new(Vec::new(), headings, form).unwrap();
    for (tick, x) in positions.iter().enumerate() {
        let t_s = 3.0 + tick as f64 / f64::from(TICK_HZ);
        table.row(tick, t_s, &[*x]).unwrap();
    }
    let table = String::from_utf8(table.into_inner().unwrap()).unwrap();
    let motion = titled(&table).unwrap();
    assert_eq!(motion.start_s, 3.0);
    assert_eq!((motion.source_rate_hz, motion.notes.len()), (44_100.0, 0));
    assert!(motion.positions.to_vec() == positions);
}

/// The motion of the ports `x`, `tilt` and `press`.
fn of_ports(rows: &str) -> Result<PortMotion, String> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("arm.csv");
    std::fs::write(&path, rows).unwrap();
    let ports = [
        ("x", Dim::LENGTH, Moves::Slides),
        ("tilt", Dim::NUMBER, Moves::Turns),
        ("press", Dim::NUMBER, Moves::Not),
    ];
    load_ports(&path, &ports, None, TICK_HZ.into()).map_err(|e| {
        e.to_string()
            .replace(&path.display().to_string(), "arm.csv")
    })
}

#[test]
fn ports_are_found_by_their_names() {
    let motion =
        of_ports("press,t_ms,tilt_deg,w_m,x_mm\n0,0,0,1,0\n0.5,500,90,1,5\n1,1000,180,1,10\n");
    let motion = motion.unwrap();
    let ends: Vec<f64> = motion.places.iter().map(|p| p.at(usize::MAX)).collect();
    let near = |(end, wanted): (&f64, f64)| (end / wanted - 1.0).abs() < 2e-3;
    let wanted = [0.01, std::f64::consts::PI, 1.0];
    assert!(ends.iter().zip(wanted).all(near), "{ends:?}");
    assert_eq!((motion.samples_read, motion.source_rate_hz), (3, 2.0));
}

#[test]
fn ports_without_a_column_are_named() {
    let messages = [
        of_ports("t_s,x_mm,tilt_deg\n0,0,0\n1,1,1\n"),
        of_ports("t_s,x_n,tilt_mm,press\n0,0,0,0\n1,1,1,1\n"),
        of_ports("x_mm,tilt_deg,press\n0,0,0\n1,1,1\n"),
        of_ports("t_s,x_mm,tilt_deg,press\n0,0,0,0\n1,1,,1\n"),
    ];
    assert_eq!(
        messages.map(Result::unwrap_err),
        [
            "arm.csv, line 1: each port needs a column with its name and unit, and there is no column `press`; \
             the titles here are `t_s`, `x_mm`, `tilt_deg`",
            "arm.csv, line 1: each port needs a column with its name and unit, and there are no columns `x_m`, `tilt_rad`; \
             the titles here are `t_s`, `x_n`, `tilt_mm`, `press`",
            "arm.csv, line 1: a title must name a time with its unit, such as `t_s`; the titles here are `x_mm`, `tilt_deg`, `press`",
            "arm.csv, line 3, column 3: a number is missing",
        ]
    );
}

#[test]
fn uneven_times_are_noted() {
    let rows: String = (0..400)
        .map(|i| {
            format!(
                "{},{}\n",
                f64::from(i) + if i % 3 == 1 { 0.2 } else { 0.0 },
                i
            )
        })
        .collect();
    let motion = titled(&format!("t_ms,x_um\n{rows}")).unwrap();
    let note = "the times are uneven (the longest step is 1.200 ms, most are 1.000 ms): interpolated at 1000.000 Hz";
    assert_eq!(motion.notes, [note]);
}

#[test]
fn bare_columns_stops_and_lowpass() {
    for text in [
        "9 1\n9 2\n9 3\n9 3\n\n\n",
        "9,1\n9, 2\n9\t,3\n9,3",
        "9\t1\r\n9  2\r\n 9 3\r\n9 3\r\n",
    ] {
        let stops = Some(Stops {
            rest_m: 1.0,
            full_m: 3.0,
            dip_m: 0.010,
        });
        let motion = load_text(
            text,
            &MotionOptions {
                stops,
                ..raw(44_100.0, 2)
            },
        )
        .unwrap();
        assert_eq!(motion.positions.to_vec(), [0.0, 0.005, 0.010, 0.010]);
        assert_eq!(motion.positions.greatest(), Some(0.010));
    }
    let options = MotionOptions {
        lowpass_hz: Some(50.0),
        ..raw(1000.0, 1)
    };
    let noisy: String = (0..1000)
        .map(|i| format!("{}\n", if i % 2 == 0 { 0.004 } else { 0.006 }))
        .collect();
    let motion = load_text(&noisy, &options).unwrap();
    let positions = motion.positions.to_vec();
    let middle = &positions[10_000..34_000];
    assert!(
        middle.iter().all(|x| (x - 0.005).abs() < 1e-9),
        "what alternates at half the rate is gone"
    );
}

#[test]
fn mistakes_are_named_with_their_place() {
    let of_raw = |text: &str, options: &MotionOptions| load_text(text, options).unwrap_err();
    let same = Some(Stops {
        rest_m: 0.001,
        full_m: 0.001,
        dip_m: 0.010,
    });
    let messages = [
        titled("").unwrap_err(),
        titled("t_s,x_m\n").unwrap_err(),
        titled("t_s,x_m\n0,0\n").unwrap_err(),
        titled("0,0\n1,1\n").unwrap_err(),
        titled("t,x\n0,0\n1,1\n").unwrap_err(),
        titled("t_s,left_mm,right_mm\n0,0,0\n1,1,1\n").unwrap_err(),
        titled("t_s,x_m\n0,0\n1,abc\n").unwrap_err(),
        titled("t_s,x_m\n0,0\n1,NaN\n").unwrap_err(),
        titled("t_s,x_m\n0,0\n1,\n").unwrap_err(),
        titled("t_s,x_m\n0,0\n1e999,1\n").unwrap_err(),
        titled("t_s,x_m\n0,0\n1,1\n1,2\n").unwrap_err(),
        titled("t_s,x_m\n0,0\n1\n").unwrap_err(),
        titled("t_s,x_m\n0,0\n1e-9,0\n2e-9,0\n1e9,0\n").unwrap_err(),
        titled("t_s,x_m\n0,0\n1e9,0\n").unwrap_err(),
        of_raw("", &raw(2000.0, 1)),
        of_raw("1 2\n3\n", &raw(2000.0, 2)),
        of_raw("1 2\n\n3 4\n", &raw(2000.0, 2)),
        of_raw("1 2\n3 inf\n", &raw(2000.0, 2)),
        of_raw("1,\n", &raw(2000.0, 2)),
        of_raw("1\n", &raw(2000.0, 0)),
        of_raw("1\n", &raw(0.0, 1)),
        of_raw("1\n", &raw(f64::NAN, 1)),
        of_raw("1\n", &raw(1e12, 1)),
        of_raw("1\n2\n", &raw(1e-9, 1)),
        of_raw(
            "1\n",
            &MotionOptions {
                lowpass_hz: Some(1000.0),
                ..raw(2000.0, 1)
            },
        ),
        of_raw(
            "1\n",
            &MotionOptions {
                stops: same,
                ..raw(2000.0, 1)
            },
        ),
    ];
    insta::assert_snapshot!(messages.join("\n"));
}
