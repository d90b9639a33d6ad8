//! `whippen run --hand`, `--force` and the budgets besides time, as the command gives them.

use serde_json::Value;

use crate::cli::{Shell, bundled};

#[test]
fn a_hand_leads_the_key_and_its_energies_are_told() {
    let shell = Shell::new();
    let spring = bundled("virtual-spring.whip");
    let (out, _) = shell.ends(
        0,
        &[
            "run",
            &spring,
            "--hand",
            "0.2kg,3N*s/m,2000N/m",
            "--out",
            "trace.csv",
        ],
    );
    let strokes: Vec<&str> = out
        .lines()
        .filter(|l| l.contains("the player put in"))
        .collect();
    assert!(strokes.len() >= 5 && out.contains("the key kept"), "{out}");
    let trace = std::fs::read_to_string(shell.path("trace.csv")).expect("written");
    let mut rows = trace.lines();
    let x = rows
        .next()
        .and_then(|t| t.split(',').position(|title| title == "x_m"))
        .expect("a column");
    let deepest = rows
        .filter_map(|row| row.split(',').nth(x)?.parse().ok())
        .fold(0.0, f64::max);
    // A spring of 100 N/m against a hand of 2000 N/m that wants 10 mm; a fast stroke overshoots
    // into the felt, beyond what is sensed.
    assert!((0.0093..=0.0105).contains(&deepest), "{deepest}");
}

#[test]
fn a_force_pushes_the_free_key_and_nobody_lets_it_go() {
    let push: String = (0..400)
        .map(|i| {
            format!(
                "{},{}\n",
                f64::from(i) / 1000.0,
                if i < 200 { 0.7 } else { 0.0 }
            )
        })
        .collect();
    let shell = Shell::new().with("push.csv", &format!("t_s,f_n\n{push}"));
    let spring = bundled("virtual-spring.whip");
    let (out, _) = shell.ends(
        0,
        &["run", &spring, "--force", "push.csv", "--out", "trace.csv"],
    );
    assert!(
        out.contains("push.csv, on a free key")
            && out.contains("the player put in")
            && out.contains("the key kept"),
        "{out}"
    );
    let (out, _) = shell.ends(
        0,
        &[
            "run",
            &spring,
            "--hand",
            "free",
            "--engine",
            "interp",
            "--seconds",
            "0.3",
        ],
    );
    assert!(out.contains("nobody holds the key"), "{out}");
}

#[test]
fn hands_that_are_none_and_devices_without_mechanics_are_refused() {
    let bare = "name = \"bare\"\n[sensor]\nbits = \"16 bit\"\nlow = \"-0.5 mm\"\nhigh = \"10.5 mm\"\ndelay = \"1 sample\"\n\
                [drive]\nbits = \"16 bit\"\nfull_scale = \"32 N\"\ndelay = \"1 sample\"\n";
    let motor = "[motor]\ntorque_constant = \"7 mN*m/A\"\nrated = \"0.5 A\"\npeak = \"2 A\"\npeak_time = \"100 ms\"\n";
    let shell = Shell::new()
        .with("bare.toml", bare)
        .with("driven.toml", &format!("{bare}{motor}"));
    let spring = bundled("virtual-spring.whip");
    for (hand, word) in [
        ("0.2kg", "mass, damping and stiffness"),
        ("0.2kg,3N*s/m,500N", "numbers of kg"),
        ("-1kg,3N*s/m,5N/m", "below zero"),
        ("0.2kgs,3N*s/m,5N/m", "not a unit"),
    ] {
        shell.refuses(2, &["run", &spring, &format!("--hand={hand}")], &[word]);
    }
    shell.refuses(
        2,
        &["run", &spring, "--hand", "free", "--device", "bare.toml"],
        &["[mechanics]"],
    );
    // Without a motor there is no image to write, but its cycles are those of any.
    shell.refuses(
        2,
        &[
            "build",
            &spring,
            "--device",
            "bare.toml",
            "--keys",
            "4",
            "-o",
            "bare.elf",
        ],
        &["[motor]"],
    );
    let budget = |device: &str| {
        shell
            .ends(0, &["budget", &spring, "--device", device, "--keys", "4"])
            .0
    };
    let (out, with) = (budget("bare.toml"), budget("driven.toml"));
    assert!(
        out.contains("motor: not judged, as the device `bare` has no `[motor]`"),
        "{out}"
    );
    let time = |text: &str| text.split("numbers").next().map(str::to_string);
    assert_eq!(time(&out), time(&with));
    let (out, _) = shell.ends(
        0,
        &["budget", &spring, "--device", "driven.toml", "--keys", "4"],
    );
    assert!(out.contains("stability: not judged"), "{out}");
}

#[test]
fn the_budget_has_numbers_stability_and_motor() {
    let shell = Shell::new();
    let json = |file: &str| -> Value {
        let (out, _) = shell.ends(0, &["budget", &bundled(file), "--keys", "4", "--json"]);
        serde_json::from_str(&out).unwrap_or_else(|e| panic!("{e}: {out}"))
    };
    let organ = json("hammond.whip");
    assert_eq!(organ["stability"]["verdict"], "stable");
    assert_eq!(organ["numbers"]["overflow_free"], true);
    assert_eq!(organ["motor"]["within_rating"], true);
    // 75 N/m * 10.5 mm + 0.4 N; with all the weight taken away 75 N/m * -0.5 mm + 0.4 N - 0.5 N.
    let force = |end: usize| organ["motor"]["static"][end].as_f64().expect("a number");
    assert!(
        (force(1) - 1.1875).abs() < 1e-6 && (force(0) + 0.1375).abs() < 1e-6,
        "{}",
        organ["motor"]
    );
    assert!(
        organ["motor"]["slices"]
            .as_array()
            .is_some_and(|s| s.len() > 500)
    );
    let baker = json("baker.whip");
    assert_eq!(
        (
            &baker["stability"]["verdict"],
            &baker["warnings"][0]["code"]
        ),
        (&"rings".into(), &"WH0702".into())
    );
    let (out, err) = shell.ends(0, &["budget", &bundled("baker.whip"), "--keys", "4"]);
    assert!(
        out.contains("stability: IT RINGS")
            && err.contains("WH0702")
            && err.contains("is stable with every hand")
    );
}

#[test]
fn the_page_of_a_budget_has_every_part_and_asks_no_network() {
    let shell = Shell::new();
    shell.ends(
        0,
        &[
            "budget",
            &bundled("hammond.whip"),
            "--keys",
            "4",
            "--report",
            "budget.html",
        ],
    );
    let page = std::fs::read_to_string(shell.path("budget.html")).expect("written");
    for part in [
        "core 0: 2 keys",
        "contacts",
        "nobody holds the key",
        "current over time",
        "No overflow",
        "<circle",
    ] {
        assert!(page.contains(part), "{part}");
    }
    assert!(!page.contains("http://") && !page.contains("https://") && !page.contains("NaN"));
    assert_eq!(page.matches("<svg").count(), page.matches("</svg>").count());
}

#[test]
fn a_closed_loop_records_player_key_stops_and_energies() {
    let shell = Shell::new();
    let spring = bundled("virtual-spring.whip");
    let run = [
        "run",
        &spring,
        "--hand",
        "0.2kg,3N*s/m,2000N/m",
        "--out",
        "t.csv",
    ];
    let columns = "x,hand_target,hand_force,key_position,key_speed,coil_force,stop_force,\
                   energy_given,energy_returned";
    shell.ends(0, &[&run[..], &["--columns", columns]].concat());
    let trace = std::fs::read_to_string(shell.path("t.csv")).expect("written");
    let mut lines = trace.lines();
    assert_eq!(
        lines.next(),
        Some(
            "t_s,x_m,hand_target_m,hand_force_n,key_position_m,key_speed_m_per_s,coil_force_n,\
             stop_force_n,energy_given_j,energy_returned_j"
        )
    );
    let rows: Vec<Vec<f64>> = lines
        .map(|line| {
            line.split(',')
                .map(|cell| cell.parse().expect("a number"))
                .collect()
        })
        .collect();
    let most = |column: usize| rows.iter().map(|row| row[column]).fold(0.0, f64::max);
    // The sensor is late by a tick, has steps of 0.17 um and ends half a millimetre from the stops.
    let sensed = |w: &[Vec<f64>]| {
        let where_it_was = w[0][4].clamp(-0.5e-3, 10.5e-3);
        (w[1][1] - where_it_was).abs() < 0.2e-6
    };
    assert!(rows.windows(2).all(sensed));
    assert!((most(2) - 0.010).abs() < 1e-6 && most(3) > 0.5 && most(6) > 0.5);
    // A fast stroke goes into the felt at 10 mm, and only there it pushes back.
    assert!(most(7) > 1.0 && rows.iter().all(|row| row[7] <= 0.0 || row[4] > 9.9e-3));
    for w in rows.windows(2) {
        let moved = w[1][4] - w[0][4];
        assert!(
            (moved - 0.5 * (w[0][5] + w[1][5]) / 44_100.0).abs() < 1e-7,
            "{w:?}"
        );
        assert!(
            w[1][8] >= w[0][8] && w[1][9] >= w[0][9],
            "energies only grow: {w:?}"
        );
    }
    let last = &rows[rows.len() - 1];
    assert!(last[8] > last[9] && last[9] > 0.0, "{last:?}");
}
