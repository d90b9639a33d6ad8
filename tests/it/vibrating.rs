//! Strings from outside: chosen points, what sticks and slips, their motion in pictures and pages.

use serde_json::Value;

use crate::cli::Shell;
use crate::report::browser;

/// A bowed string that reads itself at 12 % of its length.
fn bowed() -> String {
    let reads = "    let here  = u(38.4 mm)\n    let moves = u(38.4 mm)'\n    let rubs ";
    include_str!("../programs/bowed_string.whip").replace("    let rubs ", reads)
}

fn shell() -> Shell {
    Shell::new().with("bowed.whip", &bowed())
}

/// The columns of a table behind the time, as texts.
fn columns(shell: &Shell, file: &str) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(shell.path(file)).expect("is there");
    let mut lines = text.lines().map(|line| line.split(',').skip(1));
    let titles = lines.next().expect("titles");
    let mut columns: Vec<Vec<String>> = titles.map(|title| vec![title.to_string()]).collect();
    for line in lines {
        for (column, cell) in columns.iter_mut().zip(line) {
            column.push(cell.to_string());
        }
    }
    columns
}

const POINTS: &str = "line.u@12%,line.u'@12%,u@38.4mm,line@100%";

#[test]
fn a_point_is_what_the_program_reads_there() {
    let shell = shell();
    for engine in ["jit", "interp", "ideal"] {
        let run = format!(
            "run bowed.whip --seconds 0.1 --engine {engine} --out {engine}.csv --columns here,moves --points"
        );
        let args: Vec<&str> = run.split(' ').chain([POINTS]).collect();
        shell.ends(0, &args);
        let columns = columns(&shell, &format!("{engine}.csv"));
        let titles: Vec<&str> = columns.iter().map(|column| &*column[0]).collect();
        let points = [
            "line_u_at_12_percent_m",
            "line_u_dot_at_12_percent_m_per_s",
            "u_at_38_4mm_m",
            "line_at_100_percent_m",
        ];
        assert_eq!(titles[..2], ["here_m", "moves_m_per_s"]);
        assert_eq!(titles[2..], points);
        let number = |cell: &String| cell.parse::<f64>().expect("a number");
        let values = |at: usize| columns[at][1..].iter().map(number).collect::<Vec<f64>>();
        let furthest = values(2).iter().fold(0.0, |most: f64, u| most.max(u.abs()));
        assert!(furthest > 1e-5, "{furthest} m");
        for (own, point, most) in [(0, 2, 1e-7), (1, 3, 1e-5), (2, 4, 1e-12)] {
            for (tick, (own, point)) in values(own).iter().zip(values(point)).enumerate() {
                assert!((own - point).abs() < most, "{engine} {tick}: {own} {point}");
            }
        }
        assert!(values(5).iter().all(|end| *end == 0.0));
    }
    assert_eq!(columns(&shell, "jit.csv"), columns(&shell, "interp.csv"));
}

#[test]
fn a_board_has_the_same_points() {
    let shell = shell();
    for engine in ["interp", "emulated"] {
        let run =
            format!("run bowed.whip --seconds 0.02 --engine {engine} --out {engine}.csv --points");
        let args: Vec<&str> = run.split(' ').chain([POINTS]).collect();
        shell.ends(0, &args);
    }
    let points = |file: &str| {
        let mut all = columns(&shell, file);
        all.split_off(all.len() - 4)
    };
    let board = points("emulated.csv");
    assert_eq!(board, points("interp.csv"));
    assert!(board[0][1..].iter().any(|cell| cell.len() > 3), "it moves");
}

#[test]
fn a_point_that_is_not_there_is_told_with_those_that_are() {
    let shell = shell();
    for (point, told) in [
        ("line.u", "does not say where: a point is `line.u@12%`"),
        ("lin.u@3%", "did you mean `line.u`?"),
        ("x@3%", "there are `line.u`"),
        ("line.u@120%", "from 0 m to 0.32 m, which is 0% to 100%"),
        ("line.u@-1mm", "is not on the string"),
        ("line.u@nan%", "is not on the string"),
        ("line.u@2s", "write a length, such as `40 mm`"),
        ("line.u@", "write a length"),
    ] {
        let args = ["run", "bowed.whip", "--points", point];
        shell.refuses(2, &args, &["--points: ", told]);
    }
    let shell = shell.with("bank.whip", BANK).with("plain.whip", PLAIN);
    let both = ["run", "bank.whip", "--points", "u@12%"];
    shell.refuses(
        2,
        &both,
        &["`u` may be `all[0].line.u`, `all[1].line.u`; say which"],
    );
    let one = "run bank.whip --seconds 0.01 --out one.csv --points all[1].u@12%";
    shell.ends(0, &one.split(' ').collect::<Vec<_>>());
    let none = ["run", "plain.whip", "--points", "u@12%"];
    shell.refuses(2, &none, &["`plain` has no string"]);
}

const BANK: &str = "instrument bank {
    sense x: length in 0 mm .. 10 mm over 1 ms
    bank all over i in 0 .. 1 {
        string line along 0 m .. 0.32 m {
            position u in -8 mm .. 8 mm, rate in -40 m/s .. 40 m/s
            density  1.61 g/m
            load     60 N * d2(u) - 134 N*mm^2 * d4(u)
            load     3.2 g/m * (0.005 m^2/s * d2(u') - 1 s^-1 * u')
            force    5 N/m * x at 50 mm
            ends     pinned
        }
        let bridge = d1(u, 0 m)
    }
    force f = 1 N * sum(all.bridge)
}
";

const PLAIN: &str = "instrument plain {
    sense x: length in 0 mm .. 10 mm over 1 ms
    force f = 80 N/m * x
}
";

/// What the only friction of a run did, as its line of JSON tells.
fn friction(shell: &Shell, args: &str) -> Value {
    let (out, _) = shell.ends(0, &args.split(' ').collect::<Vec<_>>());
    let run: Value = serde_json::from_str(&out).expect("JSON");
    run["frictions"][0].clone()
}

#[test]
fn a_bowed_string_slips_once_a_period() {
    let shell = shell();
    for engine in ["jit", "ideal"] {
        let run = format!("run bowed.whip --seconds 3 --json --engine {engine}");
        let bow = friction(&shell, &run);
        assert_eq!(bow["friction"], "bow");
        let settled = |name: &str| bow["second_half"][name].as_f64().expect("a number");
        assert!((settled("slips_per_period") - 1.0).abs() < 0.02, "{bow}");
        assert!((settled("stick_share") - 0.85).abs() < 0.03, "{bow}");
        assert!((settled("rubbed_s") - 1.5).abs() < 0.01, "{bow}");
    }
    let lifted = friction(&shell, "run bowed.whip --seconds 1 --json --set press=0N");
    assert_eq!(lifted["whole"]["rubbed_s"], 0.0, "{lifted}");
    assert!(
        lifted["whole"]["stick_share"].is_null() && lifted["whole"]["slips_per_period"].is_null()
    );
    // Pressed harder than Schelleng says, it lets go at no rate of its own.
    let raucous = friction(
        &shell,
        "run bowed.whip --seconds 2 --json --set press=1N --set speed=0.02m/s",
    );
    let slips = raucous["second_half"]["slips_per_period"]
        .as_f64()
        .expect("a number");
    assert!(slips < 0.9, "{raucous}");
}

#[test]
fn columns_tell_when_it_sticks() {
    let shell = shell();
    let run = "run bowed.whip --seconds 2 --out out.csv --every 7 --columns bow.sticking,bow.stick_share,bow.slips_per_period";
    let (out, _) = shell.ends(0, &run.split(' ').collect::<Vec<_>>());
    assert!(out.contains("bow rubs for 2.00 s: sticks "), "{out}");
    let columns = columns(&shell, "out.csv");
    let titles: Vec<&str> = columns.iter().map(|column| &*column[0]).collect();
    assert_eq!(
        titles,
        ["bow_sticking", "bow_stick_share", "bow_slips_per_period"]
    );
    let late = columns[0].len() - 6000..;
    let sticks = columns[0][late.clone()]
        .iter()
        .filter(|cell| *cell == "sticks")
        .count();
    assert!((4800..5400).contains(&sticks), "{sticks} of 6000");
    for slips in &columns[2][late] {
        let slips: f64 = slips.parse().expect("a number");
        assert!((slips - 1.0).abs() < 0.06, "{slips}");
    }
}

/// The data of the strings on a page.
fn strings(shell: &Shell, file: &str) -> (usize, Value) {
    let page = std::fs::read_to_string(shell.path(file)).expect("is there");
    let begin = "id=\"strings-bowed-string\">";
    let at = page.find(begin).expect("strings") + begin.len();
    let end = at + page[at..].find("</script>").expect("ends");
    (
        page.len(),
        serde_json::from_str(&page[at..end]).expect("JSON"),
    )
}

#[test]
fn a_page_shows_a_string_in_slow_motion_and_stays_small() {
    let shell = shell();
    let mut bytes = Vec::new();
    for seconds in ["2", "40"] {
        let run = format!(
            "run bowed.whip --seconds {seconds} --report page.html --plot picture.svg --columns x"
        );
        shell.ends(0, &run.split(' ').collect::<Vec<_>>());
        let (size, strings) = strings(&shell, "page.html");
        bytes.push(size);
        let line = &strings["strings"][0];
        assert_eq!(
            (&line["name"], &line["friction"]),
            (&"line".into(), &"bow".into())
        );
        let windows = line["windows"].as_array().expect("windows");
        assert_eq!(windows.len(), 16);
        let picture = std::fs::read_to_string(shell.path("picture.svg")).expect("is there");
        assert!(picture.contains("line (mm), moving, from ") && picture.contains("bow sticks"));
    }
    let page = std::fs::read_to_string(shell.path("page.html")).expect("is there");
    let played = browser::play(
        &page,
        "const at = () => document.querySelector('.player .at').textContent;
         const [play, step] = document.querySelectorAll('.player button');
         const part = document.querySelector('.player input[type=range]');
         const first = at();
         step.click();
         const next = at();
         part.value = 9;
         part.dispatchEvent(new Event('input'));
         play.click();
         const does = document.querySelector('.vibration output').textContent;
         done({ first, next, ninth: at(), does, play: play.textContent });",
    );
    if let Some(played) = played {
        assert_eq!(played["errors"], serde_json::json!([]), "{played}");
        assert_ne!(played["first"], played["next"], "{played}");
        assert!(
            played["ninth"]
                .as_str()
                .expect("a time")
                .starts_with("23.74"),
            "{played}"
        );
        assert_eq!(played["play"], "pause", "{played}");
        assert!(
            played["does"].as_str().expect("words").starts_with("bow s"),
            "{played}"
        );
    }
    // A run twenty times as long is no larger page but for what else is drawn.
    assert!(
        bytes[1] < bytes[0] + 200_000 && bytes[0] < 1_000_000,
        "{bytes:?}"
    );
    let still = "run bowed.whip --seconds 1 --report still.html --set press=0N";
    shell.ends(0, &still.split(' ').collect::<Vec<_>>());
    let page = std::fs::read_to_string(shell.path("still.html")).expect("is there");
    assert!(
        !page.contains("id=\"strings-"),
        "what does not move is not shown"
    );
}
