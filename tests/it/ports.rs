//! Instruments with several ports on the command line: motions, traces, code for other projects,
//! and what is refused.

use super::cli::Shell;
use super::common::PROGRAMS;

/// The text of one of the programs.
fn program(name: &str) -> &'static str {
    let found = PROGRAMS.iter().find(|(other, _)| *other == name);
    found.expect("a program of that name").1
}

/// A folder with the spring in two directions, and a hand that holds it still.
fn bead() -> Shell {
    Shell::new()
        .with("bead.whip", program("two-axis-spring.whip"))
        .with(
            "still.csv",
            "t_s,y_mm,x_mm\n0,-50,20\n0.1,-50,20\n0.2,-50,20\n",
        )
        .with("half.csv", "t_s,x_mm\n0,20\n0.1,20\n")
}

/// The value of a column in the last row of a table.
fn last(shell: &Shell, table: &str, column: &str) -> f64 {
    let lines = shell.lines(table);
    let at = lines[0].split(',').position(|title| title == column);
    let at = at.unwrap_or_else(|| panic!("no {column} in {}", lines[0]));
    let row = lines.last().expect("rows");
    row.split(',')
        .nth(at)
        .expect("a cell")
        .parse()
        .expect("a number")
}

#[test]
fn each_port_has_its_place_and_its_force() {
    let shell = bead();
    for engine in ["jit", "interp", "ideal"] {
        let command = [
            "run",
            "bead.whip",
            "--motion",
            "still.csv",
            "--engine",
            engine,
        ];
        shell.ends(0, &[&command[..], &["--out", "t.csv"]].concat());
        // 20 N/m in both directions, 2 N/m from x to y, 100 N/m below -40 mm; the arm tells 0.055
        // mm.
        for (column, force_n) in [("drive_x_n", 0.4), ("drive_y_n", -1.0 + 0.04 - 1.0)] {
            let found = last(&shell, "t.csv", column);
            assert!((found - force_n).abs() < 0.01, "{engine}: {column} {found}");
        }
        assert!((last(&shell, "t.csv", "wall_y_n") + 1.0).abs() < 0.01);
    }
}

#[test]
fn a_sensor_that_is_read_less_often_holds() {
    let shell = bead();
    shell.ends(
        0,
        &[
            "run",
            "bead.whip",
            "--seconds",
            "0.5",
            "--columns",
            "x",
            "--out",
            "t.csv",
        ],
    );
    let lines = shell.lines("t.csv");
    let values: Vec<&str> = lines[1..]
        .iter()
        .filter_map(|l| l.split(',').nth(1))
        .collect();
    let changes = values.windows(2).filter(|pair| pair[0] != pair[1]).count();
    // A thousand times a second for half of one, and steps of 0.055 mm: not in 22 050 ticks.
    assert!((200..=500).contains(&changes), "{changes}");
}

#[test]
fn what_needs_one_port_is_refused() {
    let shell = bead();
    let run = |more: &[&'static str]| [&["run", "bead.whip"], more].concat();
    shell.refuses(
        2,
        &run(&["--motion", "half.csv"]),
        &[
            "half.csv, line 1",
            "there is no column `y_m`; the titles here are `t_s`, `x_mm`",
        ],
    );
    shell.refuses(
        2,
        &run(&["--travel", "4mm"]),
        &["--travel is for a key", "`x`, `y`"],
    );
    let hand = "0.2kg,3N*s/m,500N/m";
    shell.refuses(
        2,
        &run(&["--hand", hand]),
        &["act on `x`, `y`; name one, such as --hand x=.."],
    );
    shell.refuses(
        2,
        &run(&["--device", "mikey"]),
        &["the device `mikey` has one port"],
    );
    let twice = ["build", "bead.whip", "--keys", "2", "-o", "x.elf"];
    shell.refuses(2, &twice, &["played once, not on 2 keys"]);
}

#[test]
fn a_whole_image_protects_every_motor() {
    let shell = bead().with("dial.whip", program("dial-and-lever.whip"));
    shell.ends(0, &["build", "bead.whip", "-o", "x.elf"]);
    shell.refuses(
        2,
        &["build", "dial.whip", "-o", "x.elf"],
        &["the motor of its port `dial`", "[port.dial.motor]"],
    );
    // Its time is the same with any motor.
    shell.ends(0, &["budget", "dial.whip"]);
}

#[test]
fn code_for_other_projects_has_every_word() {
    let shell = bead();
    for file in ["bead.c", "bead.o"] {
        shell.ends(0, &["build", "bead.whip", "-o", file]);
        let header = shell.lines("bead.h").join("\n");
        for word in [
            "TWO_AXIS_SPRING_KEYS 1",
            "TWO_AXIS_SPRING_INPUT_X 0",
            "TWO_AXIS_SPRING_INPUT_Y 1",
            "TWO_AXIS_SPRING_OUTPUT_DRIVE_X 0",
            "TWO_AXIS_SPRING_OUTPUT_DRIVE_Y 1",
        ] {
            assert!(header.contains(word), "{file}: {word} in\n{header}");
        }
    }
}
