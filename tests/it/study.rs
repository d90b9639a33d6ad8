//! Studies: a plan becomes a page, a session is taken in a browser and played again bit for bit,
//! results find an effect that is there and none that is not.

use std::path::Path;
use std::process::Command;

use whippen_compiler::Rng;
use whippen_runtime::study::{friedman, holm, signed_ranks};

use crate::cli::Shell;
use crate::playable::driven;

const PLAN: &str = "title = \"Plucking\"\npreferred = \"Which one?\"\ncomment = \"What else?\"\n\
    [[condition]]\nname = \"soft\"\nprogram = \"keytar\"\nset = { crunch = \"0.1\" }\nknobs = [\"volume\"]\n\
    [[condition]]\nname = \"loud\"\nprogram = \"keytar\"\nset = { crunch = \"0.8\" }\n\
    [[task]]\nname = \"marked\"\ntext = \"Pluck the marked string.\"\nlasts = \"20 s\"\nevent = \"pluck\"\nargument = \"member\"\nof = 6\nrepeats = 40\n\
    [[item]]\nname = \"fun\"\ntext = \"It was fun.\"\n[[item]]\nname = \"real\"\ntext = \"It was real.\"\n";

fn example(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/study");
    folder.join(name).display().to_string()
}

#[test]
fn a_plan_becomes_a_page_or_says_why_not() {
    let shell = Shell::new().with("plan.toml", PLAN);
    let (out, _) = shell.ends(0, &["study", "plan.toml", "-o", "study.html"]);
    assert!(out.contains("balanced for every 2 participants"), "{out}");
    let html = std::fs::read_to_string(shell.path("study.html")).expect("a page");
    assert!(html.contains("connect-src 'none'"));
    assert!(html.len() < 1_000_000, "{} bytes", html.len());
    shell.ends(0, &["study", "plan.toml", "-o", "again.html"]);
    let again = std::fs::read_to_string(shell.path("again.html")).expect("a page");
    assert_eq!(
        html.replace("study.html", ""),
        again.replace("again.html", "")
    );
    for (right, wrong, says) in [
        ("argument", "arguments", "did you mean `argument`"),
        ("\"keytar\"", "\"keytarr\"", "did you mean `keytar`"),
        ("[\"volume\"]", "[\"volum\"]", "did you mean `volume`"),
        ("\"pluck\"", "\"strum\"", "emits no `strum`"),
    ] {
        let shell = Shell::new().with("p.toml", &PLAN.replacen(right, wrong, 1));
        shell.refuses(2, &["study", "p.toml", "-o", "study.html"], &[says]);
    }
    shell.refuses(2, &["study", "plan.toml"], &["say what to make"]);
    let open = example("plucking.toml");
    shell.refuses(2, &["study", &open, "-o", "s.html"], &["is left open"]);
    let filled = std::fs::read_to_string(open).expect("a plan");
    let shell = shell.with(
        "filled.toml",
        &filled.replace("\"?\"", "\"as it should be\""),
    );
    let (out, _) = shell.ends(0, &["study", "filled.toml", "-o", "s.html"]);
    assert!(
        out.contains("4 conditions in the order of Williams's Latin square"),
        "{out}"
    );
    let three = example("rubbing.toml");
    let (out, _) = shell.ends(0, &["study", &three, "-o", "s.html"]);
    assert!(out.contains("balanced for every 6 participants"), "{out}");
}

#[test]
fn a_session_in_a_browser_is_played_again_bit_for_bit() {
    let Some(axe) = whippen_need::npm("axe-core/axe.min.js") else {
        return;
    };
    let axe = std::fs::read_to_string(axe).expect("a script");
    let shell = Shell::new().with("plan.toml", PLAN);
    shell.ends(0, &["study", "plan.toml", "-o", "page.html"]);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/it/study/take.js");
    let Some(told) = driven(&shell, &script, &axe) else {
        return;
    };
    // Participant 2 has the second row of the square.
    let seen = serde_json::json!(["loud", 2, [], "soft", 2]);
    assert_eq!(told["seen"], seen, "{told}");
    let table = told["table"].as_str().expect("a table");
    let shell = shell.with("session.csv", table);
    for row in [
        "2,1,loud,answer,fun,1,,",
        "2,2,soft,answer,real,4,,",
        "2,,,preferred,,loud,,",
    ] {
        assert!(table.contains(row), "{row}: {table}");
    }
    assert!(
        table.contains("2,,,comment,,\"it \"\"rang\"\", well\",,"),
        "{table}"
    );
    assert!(
        table.contains(",error,marked,") && table.contains(",hit,marked,"),
        "{table}"
    );
    let (out, _) = shell.ends(0, &["study", "plan.toml", "--replay", "session.csv"]);
    assert_eq!(out.matches("the same words").count(), 2, "{out}");
    // Another digest is found.
    let words = table.split(",words,marked,,,").nth(1).expect("digests");
    let first = &words[..8];
    let shell = shell.with("other.csv", &table.replacen(first, "00000000", 1));
    let (out, _) = shell.ends(1, &["study", "plan.toml", "--replay", "other.csv"]);
    assert!(out.contains("other words in second 0"), "{out}");
    // Live values are a part of a gesture: another value of the plan changes nothing.
    let shell = shell.with("other.toml", &PLAN.replace("0.8", "0.7"));
    shell.ends(0, &["study", "other.toml", "--replay", "session.csv"]);
}

#[test]
fn results_are_told_and_drawn() {
    let shell = Shell::new();
    let (plan, sessions) = (example("rubbing.toml"), example("synthetic-figure-11.csv"));
    let words = ["study", &plan, "--results", &sessions, "-o", "results.html"];
    let (out, _) = shell.ends(0, &words);
    assert!(out.contains("enjoyment: 12 people"), "{out}");
    let html = std::fs::read_to_string(shell.path("results.html")).expect("a page");
    assert_eq!(html.matches("<svg").count(), 7);
    assert!(
        html.contains("Synthetic: these numbers are invented"),
        "marked"
    );
    let broken = Shell::new().with("s.csv", "a,b\n1,2\n");
    let words = ["study", &plan, "--results", "s.csv", "-o", "r.html"];
    broken.refuses(2, &words, &["begins with participant,order"]);
}

/// Ratings from 1 to 7 of so many people under four conditions; the last is so much better.
fn ratings(random: &mut Rng, people: usize, better: u64) -> Vec<Vec<f64>> {
    let mut one = |condition: usize| {
        let own = 1 + random.below(3) + random.below(3);
        (own + if condition == 3 { better } else { 0 }).min(7) as f64
    };
    (0..people)
        .map(|_| (0..4).map(&mut one).collect())
        .collect()
}

/// How often of so many studies the test says that conditions differ (p < 0.05).
fn found(studies: u64, better: u64) -> usize {
    let differs = |seed: &u64| {
        let mut random = Rng::new(1000 + seed);
        let rows = ratings(&mut random, 12, better);
        friedman(&rows, 999).is_some_and(|test| test.p < 0.05)
    };
    (0..studies).filter(differs).count()
}

#[test]
fn an_effect_is_found_and_none_where_there_is_none() {
    // Of 200 studies without an effect 5 % are expected, with one of two points nearly all.
    let [none, two] = [found(200, 0), found(200, 2)];
    assert!(none <= 18, "{none} of 200 without an effect");
    assert!(two >= 190, "{two} of 200 with one");
    eprintln!("{none} of 200 without an effect, {two} of 200 with one of two points");
}

const JUDGE: &str = "
import json, sys
import numpy as np
from scipy import stats
told = []
for rows in json.load(sys.stdin):
    a = np.array(rows)
    friedman = stats.friedmanchisquare(*a.T).statistic
    d = a[:, 0] - a[:, 3]
    d = d[d != 0]
    ranks = stats.rankdata(abs(d))
    def smaller(s, axis=-1):
        return abs(np.sum(s, axis=axis))
    exact = stats.permutation_test((np.sign(d) * ranks,), smaller, permutation_type='samples', n_resamples=np.inf, alternative='greater', vectorized=True)
    shuffled = stats.permutation_test(tuple(a.T), lambda *x: stats.friedmanchisquare(*x).statistic, permutation_type='samples', n_resamples=1500, alternative='greater', vectorized=False, rng=1)
    told.append([float(friedman), float(exact.pvalue), float(shuffled.pvalue)])
print(json.dumps(told))
";

#[test]
fn scipy_says_the_same() {
    let Some(python) = whippen_need::python("scipy") else {
        return;
    };
    let mut random = Rng::new(5);
    let all: Vec<_> = [0, 1, 2]
        .map(|better| ratings(&mut random, 9, better))
        .into();
    let shell = Shell::new().with("judge.py", JUDGE);
    let input = serde_json::to_string(&all).expect("JSON");
    let shell = shell.with("rows.json", &input);
    let rows = std::fs::File::open(shell.path("rows.json")).expect("is there");
    let ran = Command::new(python)
        .arg(shell.path("judge.py"))
        .stdin(rows)
        .output()
        .expect("python starts");
    let told: Vec<[f64; 3]> = serde_json::from_slice(&ran.stdout)
        .unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&ran.stderr)));
    for (rows, [statistic, exact, shuffled]) in all.iter().zip(told) {
        let own = friedman(rows, 20_000).expect("enough people");
        assert!(
            (own.statistic - statistic).abs() < 1e-9,
            "{own:?} {statistic}"
        );
        // Both are drawn: three standard deviations of the coarser one.
        let sigma = (shuffled * (1.0 - shuffled) / 1500.0).sqrt();
        assert!(
            (own.p - shuffled).abs() < 3.5 * sigma + 0.002,
            "{own:?} {shuffled}"
        );
        let column = |at: usize| rows.iter().map(|row| row[at]).collect::<Vec<f64>>();
        let pair = signed_ranks(&column(0), &column(3)).expect("pairs that differ");
        assert!((pair.p - exact).abs() < 1e-9, "{pair:?} {exact}");
    }
    assert_eq!(holm(&[0.01, 0.04, 0.03]), [0.03, 0.06, 0.06]);
}
