//! What the tables of a run hold: chosen columns, titles, digits, times.

use crate::cli::{Shell, bundled};

/// The rows of a table: titles and cells.
fn table(shell: &Shell, name: &str) -> (Vec<String>, Vec<Vec<String>>) {
    let text = std::fs::read_to_string(shell.path(name)).expect("written");
    let cells = |line: &str| line.split(',').map(str::to_string).collect::<Vec<_>>();
    let mut rows = text.lines().map(cells);
    (rows.next().expect("titles"), rows.collect())
}

#[test]
fn columns_are_chosen_by_title_or_name() {
    let (shell, grand) = (Shell::new(), bundled("grand-piano.whip"));
    let titles = |columns: &[&str]| {
        let run = [
            "run",
            &grand,
            "--seconds",
            "0.1",
            "--out",
            "t.csv",
            "--every",
            "100",
        ];
        shell.ends(0, &[&run[..], columns].concat());
        table(&shell, "t.csv").0
    };
    let chosen = titles(&["--columns", "jack.out,x',phi_dot,support,x_m,contact"]);
    let expected = [
        "t_s",
        "jack_out",
        "x_dot_m_per_s",
        "phi_dot_rad_per_s",
        "support",
        "x_m",
        "contact_n",
        "contact",
    ];
    assert_eq!(chosen, expected);
    let all = titles(&[]);
    assert_eq!(titles(&["--columns", "all"]), all);
    assert!(
        expected
            .iter()
            .all(|title| all.contains(&title.to_string()))
    );
    // Every `let` is there, and every title is a name in Python and MATLAB.
    assert!(
        ["lift_m", "reach"]
            .iter()
            .all(|t| all.contains(&t.to_string())),
        "{all:?}"
    );
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
    for title in &all {
        assert!(title.starts_with(|c: char| c.is_ascii_alphabetic()) && title.chars().all(plain));
    }
    let unknown = ["run", &grand, "--out", "u.csv", "--columns", "x,y"];
    shell.refuses(
        2,
        &unknown,
        &["there is no column `y`; there are drive_n, x_m, "],
    );
}

#[test]
fn pictures_and_pages_draw_what_was_chosen() {
    let (shell, grand) = (Shell::new(), bundled("grand-piano.whip"));
    let run = ["run", &grand, "--plot", "p.svg", "--report", "r.html"];
    let text = |name: &str| std::fs::read_to_string(shell.path(name)).expect("written");
    shell.ends(0, &run);
    assert!(!text("p.svg").contains("x'") && text("p.svg").contains(">contact<"));
    shell.ends(
        0,
        &[&run[..], &["--columns", "x,x',lift,jack.out"]].concat(),
    );
    let (figure, page) = (text("p.svg"), text("r.html"));
    for name in ["x'", "lift", "jack.out"] {
        assert!(
            figure.contains(name) && page.contains(&format!("\"name\":\"{name}\"")),
            "{name}"
        );
    }
    assert!(!figure.contains(">contact<"));
}

#[test]
fn numbers_have_the_digits_that_mean_something() {
    let (shell, grand) = (Shell::new(), bundled("grand-piano.whip"));
    let run = [
        "run",
        &grand,
        "--out",
        "t.csv",
        "--columns",
        "x,force,drive",
    ];
    shell.ends(0, &run);
    let (_, short) = table(&shell, "t.csv");
    shell.ends(0, &[&run[..], &["--exact"]].concat());
    let (_, exact) = table(&shell, "t.csv");
    assert_eq!(short.len(), exact.len());
    // Word 0 is -0.5 mm and 0 N; 11 mm and 64 N have 65 535 and 65 536 steps.
    for (short, exact) in short.iter().zip(&exact) {
        for (cell, zero, step) in [(1, -0.5e-3, 11e-3 / 65_535.0), (3, 0.0, 64.0 / 65_536.0)] {
            let word =
                |text: &str| ((text.parse::<f64>().expect("a number") - zero) / step).round();
            assert_eq!(
                word(&short[cell]),
                word(&exact[cell]),
                "{short:?} {exact:?}"
            );
        }
        let longest = [11, 10, 13, 7];
        assert!(
            short
                .iter()
                .zip(longest)
                .all(|(cell, most)| cell.len() <= most),
            "{short:?}"
        );
    }
    assert!(exact.iter().any(|row| row[1].len() > 15));
}

#[test]
fn a_recording_keeps_its_own_times() {
    let motion = "t_s,x_mm\n100,0\n100.2,5\n100.4,10\n100.6,0\n100.8,0\n";
    let shell = Shell::new().with("key.csv", motion);
    let spring = bundled("virtual-spring.whip");
    let run = [
        "run", &spring, "--motion", "key.csv", "--out", "t.csv", "--plot", "p.svg",
    ];
    shell.ends(0, &run);
    let (_, rows) = table(&shell, "t.csv");
    assert_eq!(
        (rows[0][0].as_str(), rows[44_100 / 2][0].as_str()),
        ("100", "100.5")
    );
    let figure = std::fs::read_to_string(shell.path("p.svg")).expect("written");
    assert!(figure.contains(">100.4<"), "{figure}");
}
