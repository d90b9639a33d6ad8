//! What `build` and `budget` say of the validation of an image's code.

use serde_json::Value;

use crate::cli::{Shell, bundled};

/// A program with a quotient by what is negative, which is not followed, beside what is.
const PROGRAM: &str = "/// A spring whose force is a quotient.
instrument quotient {
    sense x: length in 1 mm .. 11 mm over 0.7 ms
    states half {
        up   -> down when x > 5 mm
        down -> up   when x < 4 mm
    }
    force push = if half is down then 10 N * (1 mm / (x - 12 mm)) else 100 N/m * x
}
";

/// The lines about validation.
fn lines(out: &str) -> String {
    let own = out.lines().filter(|line| line.starts_with("validated"));
    own.collect::<Vec<_>>().join("\n")
}

fn budget(shell: &Shell, file: &str, more: &[&str]) -> Value {
    let all = [&["budget", file, "--keys", "2", "--json"], more].concat();
    let (out, _) = shell.ends(0, &all);
    serde_json::from_str(&out).unwrap_or_else(|error| panic!("{error}: {out}"))
}

#[test]
fn build_says_of_how_many_modes_its_code_does_what_they_say() {
    let shell = Shell::new().with("quotient.whip", PROGRAM);
    let hammond = bundled("hammond.whip");
    let mut told = Vec::new();
    for (file, board) in [
        (&hammond[..], "rp2350"),
        (&hammond[..], "stm32f4"),
        (&hammond[..], "rp2040"),
        ("quotient.whip", "rp2350"),
    ] {
        let args = [
            "build",
            file,
            "--board",
            board,
            "--keys",
            "2",
            "--validate",
            "-o",
            "a.elf",
        ];
        let (out, _) = shell.ends(0, &args);
        told.push(format!("{board}: {}", lines(&out)));
    }
    insta::assert_snapshot!(told.join("\n"));
    let of_object = ["build", "quotient.whip", "--validate", "-o", "a.o"];
    shell.refuses(2, &of_object, &["--validate is for a whole image"]);
}

#[test]
fn budget_names_the_modes_that_are_not_validated() {
    let shell = Shell::new().with("quotient.whip", PROGRAM);
    let found = budget(&shell, "quotient.whip", &["--validate"]);
    let validation = &found["validation"];
    assert_eq!(validation["modes"], 4, "two of each core");
    assert_eq!(validation["validated"], 2);
    assert_eq!(validation["routines"], 4);
    assert_eq!(validation["validated_routines"], 4);
    let not = validation["not_validated"].as_array().expect("a list");
    let told: Vec<String> = not
        .iter()
        .map(|one| {
            assert!(one["why"].as_str().is_some_and(|why| !why.is_empty()));
            format!("{}: {}, {}", one["symbol"], one["mode"], one["reason"])
        })
        .collect();
    insta::assert_snapshot!(told.join("\n"));
    let args = ["budget", "quotient.whip", "--keys", "2", "--validate"];
    let (out, _) = shell.ends(0, &args);
    assert_eq!(
        lines(&out),
        "validated: 2 of 4 modes, 4 of 4 routines; not validated: 2 (divisions 2)"
    );
}

/// It takes time, so it is asked for.
#[test]
fn neither_validates_where_it_is_not_asked_to() {
    let shell = Shell::new();
    let hammond = bundled("hammond.whip");
    let (out, _) = shell.ends(0, &["build", &hammond, "--keys", "2", "-o", "a.elf"]);
    assert_eq!(lines(&out), "");
    assert_eq!(budget(&shell, &hammond, &[])["validation"], Value::Null);
    let (out, _) = shell.ends(0, &["budget", &hammond, "--keys", "2"]);
    assert_eq!(lines(&out), "");
    let found = budget(&shell, &hammond, &["--validate"]);
    assert_eq!(found["validation"]["not_validated"], Value::Array(vec![]));
}
