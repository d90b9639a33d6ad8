//! Files of a command line: none is lost, and nothing half written is left.
#![cfg(unix)]

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read};
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use crate::cli::Shell;

const CLICK: &str = "instrument click {
    sense x: length in -0.5 mm .. 10.5 mm over 0.7 ms
    event bottom when x > 8 mm { emit note(speed: x') }
    force spring = 300 N/m * x
}
";

/// A folder with inputs of every kind, and links to them.
fn shell() -> Shell {
    let shell = Shell::new()
        .with("click.whip", CLICK)
        .with("key.csv", "t_s,x_mm\n0,0\n0.1,5\n0.2,0\n")
        .with("force.csv", "t_s,f_n\n0,0\n0.1,1\n0.2,0\n")
        .with("table.csv", "0,0\n1,10\n")
        .with("song.mid", "not read")
        .with("own.toml", "not read")
        .with("image.elf", "not read")
        .with("words.bin", "not read");
    std::fs::create_dir(shell.path("folder")).expect("writable");
    for (input, link) in [
        ("click.whip", "soft.html"),
        ("key.csv", "soft.csv"),
        ("own.toml", "soft.h"),
        ("click.whip", "soft.s"),
        ("words.bin", "soft.json"),
    ] {
        symlink(input, shell.path(link)).expect("writable");
    }
    for (input, link) in [
        ("click.whip", "hard.html"),
        ("key.csv", "hard.csv"),
        ("song.mid", "hard.svg"),
        ("click.whip", "hard.elf"),
    ] {
        std::fs::hard_link(shell.path(input), shell.path(link)).expect("writable");
    }
    shell
}

/// Every file of a folder, with its contents.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = std::fs::read_dir(folder).expect("readable");
    let paths = entries.map(|e| e.expect("an entry").path());
    let files = paths.filter(|path| path.is_file());
    let read = files.filter_map(|path| {
        let name = path.file_name()?.display().to_string();
        // One that is being written may have gone.
        Some((name, std::fs::read(&path).ok()?))
    });
    read.collect()
}

const LOST: &str = "would overwrite";
const BOTH: &str = "would both be written to";

/// Command lines, and why they are refused.
const REFUSED: &[(&str, &str)] = &[
    ("run click.whip --report click.whip", "ends in `.html`"),
    ("run click.whip --report soft.html", LOST),
    ("run click.whip --report hard.html", LOST),
    ("run click.whip --motion key.csv --out key.csv", LOST),
    (
        "run click.whip --motion key.csv --out folder/../key.csv",
        LOST,
    ),
    ("run click.whip --motion key.csv --events soft.csv", LOST),
    ("run click.whip --motion soft.csv --events hard.csv", LOST),
    ("run click.whip --force force.csv --out force.csv", LOST),
    (
        "run click.whip --motion key.csv --rate 9 --calibration table.csv --out table.csv",
        LOST,
    ),
    ("run click.whip --midi song.mid --plot hard.svg", LOST),
    ("run click.whip --out t.csv --events t.csv", BOTH),
    ("run click.whip --out t.csv --events ./t.csv", BOTH),
    ("run click.whip --plot a.svg --plot a.svg", BOTH),
    ("build click.whip -o hard.elf", LOST),
    ("build click.whip --device own.toml -o soft.c", LOST),
    ("build click.whip --board own.toml -o soft.o", LOST),
    (
        "build click.whip -o a.elf --map click.whip",
        "ends in `.map`",
    ),
    (
        "build click.whip -o a.elf --listing key.csv",
        "ends in `.lst`",
    ),
    (
        "build click.whip -o a.elf --map a.txt --listing a.txt",
        BOTH,
    ),
    ("budget click.whip --path soft.s", LOST),
    ("budget click.whip --path a.txt", "ends in `.s`"),
    ("budget click.whip --report soft.html", LOST),
    (
        "budget click.whip --motion key.csv --report key.csv",
        "ends in `.html`",
    ),
    ("emulate image.elf --trace image.elf", LOST),
    (
        "emulate image.elf --write a=@words.bin --profile soft.json",
        LOST,
    ),
    (
        "emulate image.elf --sense words.bin --drive words.bin",
        LOST,
    ),
    ("emulate image.elf --input key.csv --trace soft.csv", LOST),
    ("emulate image.elf --trace a --drive a", BOTH),
    ("emulate image.elf --profile a.txt", "ends in `.json`"),
];

#[test]
fn no_output_overwrites_an_input_or_another_output() {
    let shell = shell();
    let before = contents(&shell.path("."));
    for (line, says) in REFUSED {
        let args: Vec<&str> = line.split(' ').collect();
        shell.refuses(2, &args, &[says]);
        assert_eq!(contents(&shell.path(".")), before, "{line}");
    }
}

#[test]
fn laying_out_keeps_links_and_permissions() {
    let shell = Shell::new();
    let (real, link) = (shell.path("folder/real.whip"), shell.path("link.whip"));
    std::fs::create_dir(shell.path("folder")).expect("writable");
    std::fs::write(&real, CLICK.replace("    ", " ")).expect("writable");
    std::fs::set_permissions(&real, PermissionsExt::from_mode(0o750)).expect("set");
    symlink("folder/real.whip", &link).expect("writable");
    shell.ends(0, &["fmt", "link.whip"]);
    assert_eq!(std::fs::read_to_string(&real).expect("readable"), CLICK);
    assert!(link.symlink_metadata().expect("there").is_symlink());
    let mode = || real.metadata().expect("there").permissions().mode() & 0o777;
    assert_eq!(mode(), 0o750);
    // A file that may not be written is not replaced either.
    let unlaid = CLICK.replace("    ", "  ");
    std::fs::write(&real, &unlaid).expect("writable");
    std::fs::set_permissions(&real, PermissionsExt::from_mode(0o440)).expect("set");
    shell.refuses(2, &["fmt", "link.whip"], &["it is read-only"]);
    assert_eq!(std::fs::read_to_string(&real).expect("readable"), unlaid);
    assert_eq!(mode(), 0o440);
}

#[test]
fn one_keyboard_is_played_and_its_board_is_there() {
    let keyboard = |name: &str, board: &str| {
        format!("keyboard {name} {{ board {board} rate 44100 Hz keys A0 .. C1 programs click }}\n")
    };
    let shell = Shell::new()
        .with("click.whip", CLICK)
        .with("one.whip", &keyboard("one", "rp2350"))
        .with("two.whip", &keyboard("two", "rp2040"))
        .with("odd.whip", &keyboard("odd", "rp2530"));
    for command in ["run", "budget", "dump"] {
        let args = [command, "click.whip", "one.whip", "two.whip"];
        shell.refuses(2, &args, &["several keyboards, `one` and `two`"]);
    }
    shell.refuses(
        1,
        &["check", "click.whip", "odd.whip"],
        &["[WH0618]", "no board `rp2530`", "did you mean `rp2350`"],
    );
    // One range of rates, and one sentence about it.
    let rule = "a rate is from 1 to 1000000 Hz";
    let budget = ["budget", "click.whip", "--rate", "1000001"];
    shell.refuses(2, &budget, &[rule]);
    let emulate = ["emulate", "click.elf", "--board", "rp2350", "--rate", "0"];
    shell.refuses(2, &emulate, &[rule]);
    let fast = keyboard("fast", "rp2350").replace("44100", "1000001");
    let shell = shell.with("fast.whip", &fast);
    shell.refuses(
        1,
        &["check", "click.whip", "fast.whip"],
        &["[WH0606]", rule],
    );
}

/// How long a command may take to begin a file, and to end.
const PATIENCE: Duration = Duration::from_secs(60);

/// Starts a command and waits until it writes a file of this name's ending.
fn begun(shell: &Shell, command: &str) -> Child {
    begun_by(
        shell,
        Command::new(env!("CARGO_BIN_EXE_whippen")).args(command.split(' ')),
    )
}

/// The same, by a command line of its own.
fn begun_by(shell: &Shell, command: &mut Command) -> Child {
    let before = contents(&shell.path(".")).len();
    let running = command
        .current_dir(shell.path("."))
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("starts");
    let begun = Instant::now();
    while contents(&shell.path(".")).len() == before {
        assert!(begun.elapsed() < PATIENCE, "it writes nothing");
        std::thread::sleep(Duration::from_millis(5));
    }
    running
}

fn send(signal: &str, to: &Child) {
    let id = to.id().to_string();
    let sent = Command::new("kill").args([signal, &id]).status();
    assert!(sent.expect("kill").success());
}

/// Interrupts what runs; it says what it keeps, and ends with the exit code for that.
fn interrupted(running: Child, keeps: &str) -> Output {
    send("-INT", &running);
    let ended = running.wait_with_output().expect("ends");
    let told = String::from_utf8_lossy(&ended.stderr);
    assert_eq!(ended.status.code(), Some(130), "{told}");
    assert!(told.contains(keeps), "{told}");
    ended
}

#[test]
fn an_interrupted_run_keeps_what_was_played() {
    let text = CLICK.replace("force spring", "sound out = 20 m^-1 * x force spring");
    let shell = Shell::new().with("click.whip", &text);
    let endless = "run click.whip --seconds 20000 --out heard.wav --out ticks.csv --every 1000 --events events.csv";
    let running = begun(&shell, endless);
    std::thread::sleep(Duration::from_millis(300));
    interrupted(running, "of 20000.00 s were played, and are kept");
    let heard = std::fs::read(shell.path("heard.wav")).expect("is there");
    let word = |at: usize| u32::from_le_bytes(heard[at..at + 4].try_into().expect("4 bytes"));
    let data = heard
        .windows(4)
        .position(|name| name == b"data")
        .expect("has samples")
        + 4;
    assert_eq!(
        word(4) as usize,
        heard.len() - 8,
        "as long as its head says"
    );
    assert_eq!(word(data) as usize, heard.len() - data - 4);
    let samples = word(data) as usize / 3;
    assert!(samples > 0);
    let ticks = std::fs::read_to_string(shell.path("ticks.csv")).expect("is there");
    assert!(ticks.ends_with('\n'));
    assert_eq!(ticks.lines().count() - 1, samples.div_ceil(1000));
    assert!(shell.path("events.csv").exists());
}

/// As under `nohup`, which leaves a run to play when its terminal is closed.
#[test]
fn where_a_hangup_is_ignored_an_interrupt_still_keeps_what_was_played() {
    let shell = Shell::new().with("click.whip", CLICK);
    let endless = "run click.whip --seconds 20000 --out ticks.csv --every 1000";
    let mut shielded = Command::new("sh");
    shielded
        .args(["-c", "trap '' HUP; exec \"$0\" \"$@\""])
        .arg(env!("CARGO_BIN_EXE_whippen"))
        .args(endless.split(' '));
    let mut running = begun_by(&shell, &mut shielded);
    send("-HUP", &running);
    std::thread::sleep(Duration::from_millis(300));
    assert!(running.try_wait().expect("is there").is_none(), "it ended");
    interrupted(running, "of 20000.00 s were played, and are kept");
    assert!(shell.path("ticks.csv").exists());
}

/// A note at the beginning and one after an hour, as a MIDI file.
fn an_hour() -> Vec<u8> {
    let mut body = vec![0, 0x90, 60, 80, 0x83, 0x60, 0x80, 60, 64];
    // 3600 s of 960 ticks each, in four groups of seven bits.
    body.extend([0x81, 0xd2, 0xf8, 0, 0x90, 60, 80]);
    body.extend([0x83, 0x60, 0x80, 60, 64, 0, 0xff, 0x2f, 0]);
    let length = (body.len() as u32).to_be_bytes();
    [b"MThd\0\0\0\x06\0\0\0\x01\x01\xe0MTrk", &length[..], &body].concat()
}

#[test]
fn an_interrupted_performance_keeps_what_was_played() {
    let shell = Shell::new().with("click.whip", CLICK);
    std::fs::write(shell.path("hour.mid"), an_hour()).expect("is written");
    let hour =
        "run click.whip --midi hour.mid --engine interp --events events.csv --report hour.html";
    let mut running = Command::new(env!("CARGO_BIN_EXE_whippen"))
        .args(hour.split(' '))
        .current_dir(shell.path("."))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("starts");
    // It tells of the performance before it plays.
    let mut first = [0; 5];
    let told = running.stdout.as_mut().expect("is piped");
    told.read_exact(&mut first).expect("tells");
    std::thread::sleep(Duration::from_millis(500));
    let ended = interrupted(running, "s were played, and are kept");
    let said = String::from_utf8_lossy(&ended.stdout);
    assert!(
        !said.contains("2 notes: 2"),
        "the second note was not played: {said}"
    );
    assert!(shell.path("events.csv").exists() && shell.path("hour.html").exists());
}

#[test]
fn interrupted_experiments_keep_those_that_were_played() {
    let experiment = |title: &str, seconds: &str| {
        format!(
            "title = \"{title}\"\nprogram = \"click.whip\"\n[player]\n\
             motion = [\"to 5 mm in 100 ms\", \"wait {seconds} s\"]\n[plot]\ntravel = \"x\"\n\
             [[assert]]\ngreatest = \"x\"\nis = \"5 mm\"\nwithin = \"0.001 mm\"\n"
        )
    };
    let shell = Shell::new()
        .with("click.whip", CLICK)
        .with("short.toml", &experiment("The short one", "0.1"))
        .with("long.toml", &experiment("The long one", "59"));
    let args = "experiment short.toml long.toml --json --report gallery.html";
    let mut running = Command::new(env!("CARGO_BIN_EXE_whippen"))
        .args(args.split(' '))
        .current_dir(shell.path("."))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("starts");
    let mut lines = BufReader::new(running.stdout.take().expect("stdout")).lines();
    let first = lines.next().expect("a line").expect("UTF-8");
    assert!(first.contains("\"short\""), "{first}");
    interrupted(running, "1 of 2 experiments were played, and are kept");
    let gallery = std::fs::read_to_string(shell.path("gallery.html")).expect("is there");
    assert!(gallery.contains("The short one") && !gallery.contains("The long one"));
}

#[test]
fn an_interrupt_leaves_nothing_half_written() {
    let shell = Shell::new().with("click.whip", CLICK);
    let build = ["build", "click.whip", "--keys", "2", "-o", "click.elf"];
    shell.ends(0, &build);
    let endless = "emulate click.elf --board rp2350 --keys 2 --max-cycles 1e15 --trace trace.txt";
    for signal in ["-INT", "-TERM"] {
        let before = contents(&shell.path("."));
        let mut running = begun(&shell, endless);
        send(signal, &running);
        assert_eq!(running.wait().expect("ends").code(), Some(130), "{signal}");
        assert_eq!(contents(&shell.path(".")), before, "{signal}");
    }
}
