//! `whippen monitor` as it is called: against `whippen emulate --uart`, and against a double of
//! OpenOCD's text protocol.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

use crate::rig::{KEYS, Rig, kernel};
use whippen_compiler::image::executable;
use whippen_runtime::device::Device;
use whippen_runtime::monitor::openocd::OpenOcd;
use whippen_runtime::monitor::{BoardMemory, BoardWrite};

const PROGRAM: &str = "instruments/virtual-spring.whip";

/// Captures a key of four from where its program begins. Between the two requests the board plays
/// on, the longer the busier this computer is.
const FROM_THE_BEGINNING: [&str; 8] = [
    "--keys",
    "4",
    "--capture",
    "1",
    "--trigger",
    "begin",
    "--seconds",
    "150ms",
];

fn whippen(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_whippen"));
    command
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(arguments);
    command
}

fn ran(arguments: &[&str]) -> Output {
    whippen(arguments).output().expect("it runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn temporary(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

/// An emulated board whose serial port is open, and how it is named to the monitor.
struct Emulated {
    child: Child,
    at: [String; 2],
}

impl Emulated {
    fn start(image: &str, sense: &str, door: &str) -> Emulated {
        let arguments = [
            "emulate", image, "--board", "rp2350", "--keys", "4", "--sense", sense, "--uart", door,
        ];
        let mut child = whippen(&arguments)
            .stderr(Stdio::piped())
            .stdout(Stdio::null())
            .spawn()
            .expect("it starts");
        let mut told = String::new();
        let errors = child.stderr.take().expect("its stderr");
        BufReader::new(errors)
            .read_line(&mut told)
            .expect("it tells its port");
        let words: Vec<&str> = told.split_whitespace().collect();
        let at = [words[words.len() - 2], words[words.len() - 1]].map(str::to_string);
        Emulated { child, at }
    }

    /// What the monitor says to it; then the board has ended.
    fn monitor(self, more: &[&str]) -> Output {
        self.monitor_of(PROGRAM, more)
    }

    /// What the monitor of a program says to it; then the board has ended.
    fn monitor_of(mut self, program: &str, more: &[&str]) -> Output {
        let [option, at] = &self.at;
        let mut arguments = vec!["monitor", program, "--patience", "60s", option, at];
        arguments.extend(more);
        let output = ran(&arguments);
        assert!(
            self.child.wait().expect("it ends").success(),
            "the board has ended in order"
        );
        output
    }
}

/// Sensor words of four keys, of which one moves.
fn words() -> Vec<u8> {
    let device = Device::mikey();
    let place = |tick: usize, key: usize| match key {
        1 => 5e-3 - 4e-3 * (tick as f64 / 90.0).cos(),
        _ => 0.0,
    };
    let word = |tick: usize, key: usize| device.word_of_position(place(tick, key)).0;
    let all = (0..1131).flat_map(|tick| (0..4).map(move |key| (tick, key)));
    all.flat_map(|(tick, key)| word(tick, key).to_le_bytes())
        .collect()
}

#[test]
fn it_speaks_to_an_emulated_board() {
    let [image, sense, trace, page] = [
        "monitored.elf",
        "monitored.bin",
        "monitored.csv",
        "monitored.html",
    ]
    .map(|name| temporary(name).display().to_string());
    std::fs::write(&sense, words()).expect("it is written");
    let built = ran(&["build", PROGRAM, "--keys", "4", "--monitor", "-o", &image]);
    assert!(built.status.success(), "{}", text(&built.stderr));
    assert!(
        text(&built.stdout).contains("3000000 baud"),
        "{}",
        text(&built.stdout)
    );
    let said = Emulated::start(&image, &sense, "0").monitor(&["--keys", "4"]);
    let status = text(&said.stdout);
    assert!(said.status.success(), "{}", text(&said.stderr));
    assert!(
        status.contains("2 and 2 keys") && status.contains(" 0 missed"),
        "{status}"
    );
    // Over a pseudo-terminal, as over a serial port: a capture from the beginning on is jit's.
    let door = if cfg!(unix) { "pty" } else { "0" };
    let files = ["--out", &trace, "--report", &page];
    let more = [&FROM_THE_BEGINNING[..], &files].concat();
    let said = Emulated::start(&image, &sense, door).monitor(&more);
    let told = text(&said.stdout);
    assert!(said.status.success(), "{told}{}", text(&said.stderr));
    assert!(told.contains("; 0 of "), "{told}");
    let table = std::fs::read_to_string(&trace).expect("a trace");
    let titles = table.lines().next().expect("titles");
    assert!(
        titles.starts_with("t_s,drive_n,x_m") && titles.contains("measured_drive_n"),
        "{titles}"
    );
    assert!(table.lines().count() > 1500);
    assert!(
        std::fs::read_to_string(&page)
            .expect("a page")
            .contains("measured_drive")
    );
    // Another image than this program with these options.
    let said = Emulated::start(&image, &sense, "0").monitor(&["--keys", "6"]);
    assert_eq!(said.status.code(), Some(2));
    assert!(
        text(&said.stderr).contains("another image"),
        "{}",
        text(&said.stderr)
    );
}

/// A force of where the key was 35 ms ago, 20 ms of which the ramp hides.
const ECHO: &str = "
instrument echo {
    sense x: length in 0 mm .. 10 mm
    delay past: length in 0 mm .. 10 mm lasting 36 ms
    feed past = x
    force late = 80 N/m * past(35 ms)
}
";

#[test]
fn a_capture_from_the_beginning_has_empty_lines() {
    let [program, image, sense] =
        ["echo.whip", "echo.elf", "echo.bin"].map(|name| temporary(name).display().to_string());
    std::fs::write(&program, ECHO).expect("it is written");
    std::fs::write(&sense, words()).expect("it is written");
    let built = ran(&["build", &program, "--keys", "4", "--monitor", "-o", &image]);
    assert!(built.status.success(), "{}", text(&built.stderr));
    let said = Emulated::start(&image, &sense, "0").monitor_of(&program, &FROM_THE_BEGINNING);
    let told = text(&said.stdout);
    assert!(said.status.success(), "{told}{}", text(&said.stderr));
    assert!(told.contains("; 0 of "), "{told}");
}

/// Bytes both ways between who connects and a board, but for one of the first long frame of an
/// answer; the address to connect to.
fn losing_line(board: String) -> String {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).expect("a port");
    let at = format!("localhost:{}", listener.local_addr().expect("it").port());
    std::thread::spawn(move || {
        let (mut client, _) = listener.accept().expect("somebody");
        let mut board = TcpStream::connect(board).expect("the board");
        // A line waits for nothing, lest the board plays on between two requests.
        for end in [&client, &board] {
            end.set_nodelay(true).expect("a socket");
        }
        let mut asked = client.try_clone().expect("both ways");
        let mut to_board = board.try_clone().expect("both ways");
        std::thread::spawn(move || {
            // Either end may leave first.
            let _ = std::io::copy(&mut asked, &mut to_board);
            let _ = to_board.shutdown(std::net::Shutdown::Both);
        });
        let (mut frame, mut byte, mut is_lost) = (Vec::new(), [0], false);
        while board.read(&mut byte).is_ok_and(|count| count == 1) {
            frame.push(byte[0]);
            if byte[0] != 0 {
                continue;
            }
            if frame.len() > 240 && !is_lost {
                frame.remove(100);
                is_lost = true;
            }
            if client.write_all(&std::mem::take(&mut frame)).is_err() {
                return;
            }
        }
    });
    at
}

#[test]
fn a_line_that_loses_answers_is_told() {
    let [image, sense] =
        ["losing.elf", "losing.bin"].map(|name| temporary(name).display().to_string());
    std::fs::write(&sense, words()).expect("it is written");
    let built = ran(&["build", PROGRAM, "--keys", "4", "--monitor", "-o", &image]);
    assert!(built.status.success(), "{}", text(&built.stderr));
    for (more, told) in [
        (&[][..], "the line lost 1 answer, which was asked for again"),
        (&["--json"], "{\"kind\":\"line\",\"lost_answers\":1}"),
    ] {
        let mut board = Emulated::start(&image, &sense, "0");
        board.at[1] = losing_line(board.at[1].clone());
        let capture = "--keys 4 --capture 1 --trigger begin --seconds 300ms";
        let capture: Vec<&str> = capture.split(' ').collect();
        let said = board.monitor(&[&capture[..], more].concat());
        let stdout = text(&said.stdout);
        assert!(said.status.success(), "{stdout}{}", text(&said.stderr));
        assert!(stdout.lines().any(|line| line == told), "{stdout}");
    }
}

#[test]
fn a_line_that_does_not_work_is_told() {
    let nobody = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).expect("a port");
    let silent = format!("localhost:{}", nobody.local_addr().expect("it").port());
    let cases: [(&[&str], &str); 9] = [
        (&[], "required"),
        (&["--port", "/nowhere/tty"], "--port `/nowhere/tty`"),
        (&["--port", "Cargo.toml"], "is no serial port"),
        (&["--tcp", &silent, "--patience", "50ms"], "nobody answers"),
        (&["--tcp", &silent, "--capture", "7"], "there is no key 7"),
        (
            &["--tcp", &silent, "--capture", "1", "--trigger", "bang"],
            "--trigger bang",
        ),
        (&["--openocd", &silent], "--openocd wants the image"),
        (&["--probe"], "--probe wants the image"),
        (&["--tcp", &silent, "--align"], "it is for no knob"),
    ];
    for (more, why) in cases {
        let arguments = [&["monitor", PROGRAM, "--keys", "4"], more].concat();
        let said = ran(&arguments);
        assert_eq!(said.status.code(), Some(2), "{more:?}");
        assert!(
            text(&said.stderr).contains(why),
            "{more:?}: {}",
            text(&said.stderr)
        );
    }
    let no_monitor = ran(&[
        "build", PROGRAM, "--keys", "4", "--baud", "9600", "-o", "x.elf",
    ]);
    assert_eq!(no_monitor.status.code(), Some(2));
}

#[test]
#[cfg(not(feature = "probe"))]
fn a_whippen_without_debug_probes_says_how_to_have_them() {
    let image = temporary("unprobed.elf").display().to_string();
    let built = ran(&["build", PROGRAM, "--keys", "4", "-o", &image]);
    assert!(built.status.success(), "{}", text(&built.stderr));
    for probe in ["--probe", "--probe=2e8a:000c"] {
        let said = ran(&["monitor", &image, probe]);
        assert_eq!(said.status.code(), Some(2));
        let told = text(&said.stderr);
        assert!(
            told.contains("`cargo build --release --features probe`"),
            "{told}"
        );
    }
}

/// An address as OpenOCD is told it.
fn address(text: &str) -> u32 {
    u32::from_str_radix(text.trim_start_matches("0x"), 16).expect("an address")
}

/// Answers `read_memory` and `write_memory` as OpenOCD does, with the memory of an emulated board,
/// to which something happens before each command, of which it is told. It is a double: what
/// OpenOCD itself does was not tried.
fn serve(listener: &TcpListener, rig: &mut Rig, mut happens: impl FnMut(&mut Rig, &[&str])) {
    let (mut stream, _) = listener.accept().expect("somebody");
    let (mut command, mut byte) = (Vec::new(), [0]);
    while stream.read(&mut byte).is_ok_and(|count| count == 1) {
        if byte[0] != 0x1a {
            command.push(byte[0]);
            continue;
        }
        let asked = text(&std::mem::take(&mut command));
        let words: Vec<&str> = asked.split_whitespace().collect();
        happens(rig, &words);
        let mut answer = match words[..] {
            ["write_memory", at, "32", word] if address(at) >= 0x2000_0000 => {
                rig.set(address(at), address(word.trim_matches(['{', '}'])));
                String::new()
            }
            ["read_memory", at, "32", count] => {
                let at = address(at);
                let count: u32 = count.parse().expect("a count");
                let all = (0..count).map(|nth| format!("{:#x}", rig.word(at + 4 * nth)));
                all.collect::<Vec<_>>().join(" ")
            }
            _ => format!("invalid command name \"{asked}\""),
        };
        answer.push('\u{1a}');
        stream.write_all(answer.as_bytes()).expect("it is said");
    }
}

#[test]
fn the_status_is_read_through_a_double_of_openocd() {
    let mut rig = Rig::new(&kernel("virtual-spring.whip"), 0);
    let rest = Device::mikey().word_of_position(0.0).0;
    // Key 3 has a broken sensor.
    let row = || (0..KEYS).map(|key| if key == 3 { 0 } else { rest });
    rig.play((0..700).flat_map(|_| row()));
    let image = temporary("openocd.elf");
    std::fs::write(&image, executable(&rig.image, &[], None)).expect("it is written");
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).expect("a port");
    let at = format!("localhost:{}", listener.local_addr().expect("it").port());
    let image = image.display().to_string();
    let said = std::thread::scope(|scope| {
        let arguments = ["monitor", &image, "--openocd", &at, "--json"];
        let said = scope.spawn(move || ran(&arguments));
        serve(&listener, &mut rig, |_, _| {});
        said.join().expect("it runs")
    });
    assert!(said.status.success(), "{}", text(&said.stderr));
    let status: serde_json::Value = serde_json::from_slice(&said.stdout).expect("an object");
    assert_eq!(status["missed"], 0);
    assert_eq!(status["cores"][0]["faulty_key"], 3);
    assert_eq!(status["cores"][0]["gains"][3], 0.0);
    assert_eq!(status["cores"][1]["gains"][0], 1.0);
    assert_eq!(status["cores"][0]["ticks"], rig.block(0, 28));
}

/// A board that is started again between two looks at its status: its ticks begin anew, which is
/// told, and the watch ends.
#[test]
fn a_board_that_is_started_again_ends_a_watch() {
    let kernel = kernel("virtual-spring.whip");
    let rest = Device::mikey().word_of_position(0.0).0;
    let started = |ticks: usize| {
        let mut rig = Rig::new(&kernel, 0);
        rig.play(vec![rest; ticks * KEYS]);
        rig
    };
    let mut rig = started(600);
    let image = temporary("restarted.elf");
    std::fs::write(&image, executable(&rig.image, &[], None)).expect("it is written");
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).expect("a port");
    let at = format!("localhost:{}", listener.local_addr().expect("it").port());
    let image = image.display().to_string();
    let status = rig.symbol("status");
    let mut ticks = Vec::new();
    let said = std::thread::scope(|scope| {
        let arguments = ["monitor", &image, "--openocd", &at, "--watch", "1ms"];
        let said = scope.spawn(move || ran(&arguments));
        serve(&listener, &mut rig, |rig, words| {
            // Each look begins with the table of the status.
            if words.get(1).map(|at| address(at)) != Some(status) {
                return;
            }
            match ticks.len() {
                2 => *rig = started(300),
                _ => drop(rig.play(vec![rest; 10 * KEYS])),
            }
            ticks.push(rig.block(0, 28));
            assert!(ticks.len() < 20, "the watch goes on: {ticks:?}");
        });
        said.join().expect("it runs")
    });
    println!("ticks at each look: {ticks:?}");
    assert!(ticks[1] > ticks[0] && ticks[2] < ticks[1], "{ticks:?}");
    let told = text(&said.stderr);
    assert_eq!(said.status.code(), Some(1), "{told}");
    assert!(told.contains("has been started again"), "{told}");
    assert_eq!(ticks.len(), 3);
}

/// A word that is written through the double is there; what it refuses is told in its words.
#[test]
fn words_are_written_through_a_double_of_openocd() {
    let mut rig = Rig::new(&kernel("grand-piano.whip"), 0);
    rig.play(vec![20_000; 200 * KEYS]);
    let mailbox = rig.symbol("mailbox");
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).expect("a port");
    let at = listener.local_addr().expect("it");
    let refused = std::thread::scope(|scope| {
        let client = scope.spawn(move || {
            let mut board = OpenOcd::new(TcpStream::connect(at).expect("it listens"));
            // The first live value is to be 7: its number, the value, then the request.
            for (at, word) in [(4, 0), (8, 7), (0, 1)] {
                board.write(mailbox + at, word).expect("it is written");
            }
            assert_eq!(board.read(mailbox, 3), Ok(vec![1, 0, 7]));
            board.write(0x1000_0000, 1)
        });
        serve(&listener, &mut rig, |_, _| {});
        client.join().expect("it runs")
    });
    let told = refused.expect_err("flash cannot be written").to_string();
    assert!(told.contains("OpenOCD says: invalid command"), "{told}");
    rig.play(vec![20_000; 8 * KEYS]);
    let done = [12, 16].map(|at| rig.word(mailbox + at));
    assert_eq!(done, [1, 0]);
    let live = rig.layout(0, 0).live_param(0).expect("a place");
    let values = ["core0_state", "core1_state"].map(|name| rig.word(rig.symbol(name) + live));
    assert_eq!(values, [7, 7]);
}
