//! The working cycle with the real command: a new program, its layout, completions, manual pages,
//! `--watch`.

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::Duration;

use crate::cli::Shell;

#[test]
fn a_new_program_is_right_and_laid_out() {
    let shell = Shell::new();
    let (said, _) = shell.ends(0, &["new", "clavi"]);
    assert!(
        said.contains("whippen run clavi.whip --plot clavi.png --watch"),
        "{said}"
    );
    let (checked, complaints) = shell.ends(0, &["check", "clavi.whip"]);
    assert_eq!((checked.as_str(), complaints.as_str()), ("clavi: ok\n", ""));
    shell.ends(0, &["fmt", "--check", "clavi.whip"]);
    let (run, _) = shell.ends(
        0,
        &[
            "run",
            "clavi.whip",
            "--plot",
            "clavi.svg",
            "--events",
            "events.csv",
        ],
    );
    assert!(
        run.contains("note") && shell.path("clavi.svg").exists(),
        "{run}"
    );
    let events = fs::read_to_string(shell.path("events.csv")).expect("written");
    assert!(
        ["note", "release", "bottom"]
            .iter()
            .all(|e| events.contains(e)),
        "{events}"
    );
    let text = fs::read_to_string(shell.path("clavi.whip")).expect("written");
    for shown in [
        "sense ",
        "param ",
        "live param ",
        "states ",
        "event ",
        "escapement(",
        "force ",
        "pulse ",
        "Try:",
    ] {
        assert!(text.contains(shown), "{shown}");
    }
    // What it proposes to add may be added.
    let line = text
        .lines()
        .find_map(|l| l.trim().strip_prefix("// force latch"))
        .expect("a proposal");
    let end = text.rfind('}').expect("a brace");
    fs::write(
        shell.path("more.whip"),
        format!("{}    force latch{line}\n}}\n", &text[..end]),
    )
    .expect("writable");
    shell.ends(0, &["check", "more.whip"]);
    shell.refuses(2, &["new", "clavi"], &["`clavi.whip` exists already"]);
    shell.refuses(
        2,
        &["new", "grand-piano"],
        &["letters", "try `whippen new grand_piano`"],
    );
    shell.refuses(2, &["new", "a/b.whip"], &["try `whippen new b`"]);
    shell.refuses(
        2,
        &["new", "let"],
        &["no keyword", "try `whippen new my_let`"],
    );
    shell.refuses(2, &["new", "2nd"], &["try `whippen new my_2nd`"]);
    shell.refuses(2, &["new", ""], &["cannot be the name"]);
}

const MESSY: &str = "instrument a{sense x:length in 0 mm..1 mm // c\nforce f=-x*2 N/m}";
const NEAT: &str = "instrument a {
    sense x: length in 0 mm .. 1 mm                       // c
    force f = -x * 2 N/m
}
";

#[test]
fn fmt_lays_out_in_place_or_says_what_it_would_do() {
    let shell = Shell::new()
        .with("a.whip", MESSY)
        .with("neat.whip", NEAT)
        .with("wrong.whip", "instrument {");
    let read = |name: &str| fs::read_to_string(shell.path(name)).expect("there");
    let (diff, _) = shell.ends(1, &["fmt", "--check", "a.whip", "neat.whip"]);
    assert!(
        diff.starts_with("--- a.whip\n") && diff.contains("\n+    force f = -x * 2 N/m\n"),
        "{diff}"
    );
    assert!(!diff.contains("neat.whip"), "{diff}");
    assert_eq!(read("a.whip"), MESSY);
    let (_, complaints) = shell.ends(1, &["fmt", "wrong.whip", "a.whip"]);
    assert!(
        complaints.contains("WH0106") && complaints.contains("wrong.whip"),
        "{complaints}"
    );
    assert_eq!(
        (read("wrong.whip").as_str(), read("a.whip").as_str()),
        ("instrument {", NEAT)
    );
    shell.ends(0, &["fmt", "--check", "a.whip", "neat.whip"]);
    shell.refuses(2, &["fmt", "nowhere.whip"], &["nowhere.whip"]);
    shell.refuses(2, &["fmt"], &["FILE"]);
    let stdin = |text: &str, args: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_whippen"));
        let mut child = command
            .args(args)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("starts");
        child
            .stdin
            .take()
            .expect("piped")
            .write_all(text.as_bytes())
            .expect("writable");
        let output = child.wait_with_output().expect("ends");
        (
            output.status.code(),
            String::from_utf8(output.stdout).expect("UTF-8"),
        )
    };
    assert_eq!(stdin(MESSY, &["fmt", "-"]), (Some(0), NEAT.to_string()));
    assert_eq!(
        stdin(NEAT, &["fmt", "--check", "-"]),
        (Some(0), String::new())
    );
    assert_eq!(
        stdin("instrument {", &["fmt", "-"]),
        (Some(1), String::new())
    );
}

#[test]
fn completions_and_manual_pages_name_the_commands() {
    let shell = Shell::new();
    for name in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let (script, _) = shell.ends(0, &["completions", name]);
        assert!(
            ["check", "fmt", "watch", "motion"]
                .iter()
                .all(|w| script.contains(w)),
            "{name}"
        );
    }
    shell.refuses(2, &["completions", "tcsh"], &["bash", "zsh"]);
    let (page, _) = shell.ends(0, &["man", "run"]);
    assert!(
        page.contains(".TH whippen-run 1") && page.contains("\\-\\-motion"),
        "{page}"
    );
    assert!(shell.ends(0, &["man"]).0.contains("whippen\\-run(1)"));
    shell.refuses(2, &["man", "dance"], &["run"]);
    shell.ends(0, &["man", "--dir", "pages/man1"]);
    assert!(
        shell.path("pages/man1/whippen.1").exists()
            && shell.path("pages/man1/whippen-fmt.1").exists()
    );
}

#[test]
fn bash_completes_a_command() {
    let Some(bash) = whippen_need::tool("bash") else {
        return;
    };
    let script = "source <(\"$0\" completions bash); COMP_WORDS=(whippen ch); COMP_CWORD=1; \
                  _whippen whippen ch whippen; echo \"${COMPREPLY[@]}\"";
    let output = Command::new(bash)
        .args(["-c", script, env!("CARGO_BIN_EXE_whippen")])
        .output()
        .expect("bash");
    assert_eq!(String::from_utf8_lossy(&output.stdout).trim(), "check");
}

/// A command that watches.
struct Watching {
    child: Child,
    lines: Receiver<String>,
}

impl Watching {
    fn start(shell: &Shell, args: &[&str]) -> Watching {
        let mut command = Command::new(env!("CARGO_BIN_EXE_whippen"));
        command
            .args(args)
            .current_dir(shell.path(""))
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        let mut child = command.spawn().expect("starts");
        let stderr = BufReader::new(child.stderr.take().expect("piped"));
        let (sender, lines) = channel();
        thread::spawn(move || {
            stderr
                .lines()
                .map_while(Result::ok)
                .try_for_each(|line| sender.send(line))
        });
        Watching { child, lines }
    }

    /// Waits for the end of a run and gives what was said up to there.
    fn done(&self) -> String {
        let mut said = String::new();
        loop {
            let line = self
                .lines
                .recv_timeout(Duration::from_secs(60))
                .expect("the end of a run");
            said += &line;
            said.push('\n');
            if line.contains("done in") {
                return said;
            }
        }
    }

    /// Nothing runs for a while.
    fn quiet(&self) {
        let line = self.lines.recv_timeout(Duration::from_millis(400));
        assert!(
            line.as_ref().is_ok_and(String::is_empty) || line.is_err(),
            "{line:?}"
        );
        let line = self.lines.recv_timeout(Duration::from_millis(400));
        assert!(line.is_err(), "{line:?}");
    }
}

impl Drop for Watching {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn watch_runs_again_after_every_save() {
    let spring = |k: &str| {
        format!("instrument a {{ sense x: length in 0 mm .. 10 mm over 1 ms force f = {k} * x }}\n")
    };
    let motion = "t_s,x_mm\n0,0\n0.1,5\n0.2,0\n";
    let shell = Shell::new()
        .with("a.whip", &spring("50 N/m"))
        .with("key.csv", motion);
    let watching = Watching::start(
        &shell,
        &[
            "run", "a.whip", "--motion", "key.csv", "--plot", "a.svg", "--watch",
        ],
    );
    let said = watching.done();
    assert!(
        said.contains("watching a.whip, key.csv (Ctrl-C ends)"),
        "{said}"
    );
    let plot = || fs::read_to_string(shell.path("a.svg")).expect("plotted");
    let first = plot();
    // A mistake is shown, and waited for; the plot stays.
    fs::write(shell.path("a.whip"), spring("50 N/s")).expect("writable");
    assert!(watching.done().contains("WH03"));
    assert_eq!(plot(), first);
    // Saved as many editors do: another file, renamed.
    fs::write(shell.path(".a.whip.new"), spring("80 N/m")).expect("writable");
    fs::rename(shell.path(".a.whip.new"), shell.path("a.whip")).expect("renamed");
    assert!(!watching.done().contains("WH03"));
    let second = plot();
    assert_ne!(second, first);
    // The motion is watched too; other files are not, the plot among them.
    fs::write(shell.path("key.csv"), motion.replace('5', "8")).expect("writable");
    watching.done();
    assert_ne!(plot(), second);
    fs::write(shell.path("other.whip"), spring("1 N/m")).expect("writable");
    watching.quiet();
    // A file that is gone is told and waited for.
    fs::remove_file(shell.path("a.whip")).expect("removed");
    assert!(watching.done().contains("cannot read `a.whip`"));
    fs::write(shell.path("a.whip"), spring("50 N/m")).expect("writable");
    watching.done();
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_a_watch_in_peace() {
    let shell = Shell::new().with(
        "a.whip",
        "instrument a { sense x: length in 0 mm .. 1 mm force f = x }",
    );
    let mut watching = Watching::start(&shell, &["check", "a.whip", "--watch"]);
    assert!(watching.done().contains("WH03"));
    let id = watching.child.id().to_string();
    assert!(
        Command::new("kill")
            .args(["-INT", &id])
            .status()
            .expect("kill")
            .success()
    );
    assert_eq!(watching.child.wait().expect("ends").code(), Some(0));
    // What is wrong on the command line is no reason to wait.
    shell.refuses(
        2,
        &["check", "nowhere.whip", "--watch"],
        &["cannot read `nowhere.whip`"],
    );
}
