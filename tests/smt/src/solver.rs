//! Solvers, each a program that is asked with a limit of time.

use std::fmt;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::query::Query;

/// What became of a claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// It holds for all numbers.
    Proven,
    /// There are numbers for which it does not hold.
    Refuted,
    /// No solver has ended in its time.
    Open,
    /// It was not put into a query.
    Unasked,
}

impl Verdict {
    /// In a word.
    pub const fn word(self) -> &'static str {
        match self {
            Verdict::Proven => "proven",
            Verdict::Refuted => "refuted",
            Verdict::Open => "open",
            Verdict::Unasked => "unasked",
        }
    }

    /// The verdict of a word.
    pub fn of_word(word: &str) -> Option<Verdict> {
        let all = [
            Verdict::Proven,
            Verdict::Refuted,
            Verdict::Open,
            Verdict::Unasked,
        ];
        all.into_iter().find(|verdict| verdict.word() == word)
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())
    }
}

/// What was answered.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Answer {
    /// The verdict.
    pub verdict: Verdict,
    /// The solver and its version, with a hyphen between; of an open one those that were asked.
    pub solver: String,
    /// How long it took.
    pub time: Duration,
    /// Of a refuted claim the numbers, as the solver prints them.
    pub numbers: String,
}

/// A program that solves.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Solver {
    name: String,
    program: PathBuf,
    arguments: Vec<String>,
}

/// Bitwuzla's package has no program: this is one.
const BITWUZLA: &str = "import sys, bitwuzla
if sys.argv[1] == '--version':
    print(bitwuzla.version()); sys.exit()
options = bitwuzla.Options()
options.set(bitwuzla.Option.PRODUCE_MODELS, True)
options.set(bitwuzla.Option.TIME_LIMIT_PER, 1000 * int(sys.argv[1]))
bitwuzla.Parser(bitwuzla.TermManager(), options).parse(sys.argv[2])
";

impl Solver {
    /// All solvers of the table of tools and judges; none, and the test counts as skipped, where
    /// one is absent.
    ///
    /// # Panics
    ///
    /// Where one is absent and required.
    pub fn all() -> Option<Vec<Solver>> {
        let python = whippen_need::python("bitwuzla")?;
        let script = ["-c", BITWUZLA].map(str::to_string).to_vec();
        let own = |name: &str, program, arguments| {
            let mut solver = Solver {
                name: name.to_string(),
                program,
                arguments,
            };
            solver.name = format!("{name}-{}", solver.version());
            solver
        };
        Some(vec![
            own("bitwuzla", python, script),
            own("z3", whippen_need::tool("z3")?, Vec::new()),
            own("cvc5", whippen_need::tool("cvc5")?, Vec::new()),
        ])
    }

    fn version(&self) -> String {
        let output = Command::new(&self.program)
            .args(&self.arguments)
            .arg("--version")
            .output();
        let output = output.map(|output| output.stdout).unwrap_or_default();
        let text = String::from_utf8_lossy(&output).to_string();
        let mut words = text.split_whitespace();
        let number = |word: &&str| word.starts_with(|first: char| first.is_ascii_digit());
        words.find(number).unwrap_or("unknown").to_string()
    }

    fn command(&self, seconds: u64, file: &Path) -> Command {
        let mut command = Command::new(&self.program);
        command.args(&self.arguments);
        if self.name.starts_with("z3") {
            command.arg(format!("-T:{seconds}"));
        } else if self.name.starts_with("cvc5") {
            command.args([format!("--tlimit={}", 1000 * seconds), "--lang=smt2".into()]);
        } else {
            command.arg(seconds.to_string());
        }
        command.arg(file);
        command
    }

    /// Asks once: whether there are numbers against the claim, and which; none where it does not
    /// end.
    fn decide(&self, query: &Query, seconds: u64) -> Option<(Verdict, String)> {
        let mut file = tempfile::NamedTempFile::new().expect("a file to ask with");
        let names = query.free().join(" ");
        let asked = match names.as_str() {
            "" => String::new(),
            names => format!("(get-value ({names}))\n"),
        };
        let text = format!("(set-option :produce-models true)\n{}{asked}", query.text);
        file.write_all(text.as_bytes()).expect("a file to write to");
        let output = self
            .command(seconds, file.path())
            .stdin(Stdio::null())
            .output()
            .expect("a solver that starts");
        let output = String::from_utf8_lossy(&output.stdout).to_string();
        let (first, rest) = output.split_once('\n').unwrap_or((&output, ""));
        match first.trim() {
            "unsat" => Some((Verdict::Proven, String::new())),
            "sat" => Some((Verdict::Refuted, rest.trim().to_string())),
            _ => None,
        }
    }
}

/// Asks one solver after the other, each for so many seconds at most, until one answers.
pub fn ask(solvers: &[Solver], query: &Query, seconds: u64) -> Answer {
    let is_of_words = query.text.starts_with("(set-logic QF_BV)");
    let able: Vec<&Solver> = solvers
        .iter()
        .filter(|solver| is_of_words || !solver.name.starts_with("bitwuzla"))
        .collect();
    let begun = Instant::now();
    for solver in &able {
        let begun = Instant::now();
        if let Some((verdict, numbers)) = solver.decide(query, seconds) {
            return Answer {
                verdict,
                solver: solver.name.clone(),
                time: begun.elapsed(),
                numbers,
            };
        }
    }
    let names: Vec<&str> = able.iter().map(|solver| solver.name.as_str()).collect();
    Answer {
        verdict: Verdict::Open,
        solver: names.join(","),
        time: begun.elapsed(),
        numbers: String::new(),
    }
}
