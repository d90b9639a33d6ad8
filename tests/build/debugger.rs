//! gdb stops at lines of the source and steps through them.

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};

use whippen_compiler::image::executable;
use whippen_runtime::board::bundled;

use crate::program::{TEXT, image};
use crate::tools::{Folder, WHIPPEN, text};

/// A session of gdb with the emulator; what gdb printed, or nothing where it is not installed.
pub fn session(folder: &Folder, image: &str, script: &[&str]) -> Option<String> {
    folder.output("gdb-multiarch", &["--version"])?;
    let mut emulator = Command::new(WHIPPEN)
        .args(["emulate", image, "--board", "rp2350", "--gdb", "0"])
        .current_dir(folder.path())
        .stderr(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .expect("starts");
    let mut told = BufReader::new(emulator.stderr.take().expect("piped"));
    let mut line = String::new();
    told.read_line(&mut line).expect("says where it listens");
    let port = line
        .trim()
        .rsplit_once(':')
        .unwrap_or_else(|| panic!("no port: {line}"))
        .1
        .to_string();
    let target = format!("target remote localhost:{port}");
    let mut args = vec![
        "--batch",
        "-nx",
        "-q",
        "-iex",
        "set auto-load off",
        "-ex",
        "set confirm off",
        "-ex",
        &target,
    ];
    script
        .iter()
        .for_each(|command| args.extend(["-ex", command]));
    args.push(image);
    let output = folder.output("gdb-multiarch", &args);
    let _ = emulator.kill();
    let _ = emulator.wait();
    let output = output?;
    Some(text(&output.stdout) + &text(&output.stderr))
}

#[test]
fn a_force_term_can_be_stopped_at_and_stepped_through() {
    let folder = Folder::new();
    folder.write(
        "out.elf",
        executable(&image(&bundled("rp2350").expect("bundled")), &[], None),
    );
    folder.write("probe.whip", TEXT);
    let script = [
        "break probe.whip:2",
        "break probe.whip:4",
        "continue",
        "step",
        "continue",
        "backtrace",
        "info line probe_tick",
        "kill",
    ];
    let Some(told) = session(&folder, "out.elf", &script) else {
        return;
    };
    for wanted in [
        "Breakpoint 1, probe_tick () at probe.whip:2",
        "force weight = 1 N",
        "force more = 2 N",
        "Breakpoint 2, probe_scale () at probe.whip:4",
        "force scaled = 3 N",
        "in probe_tick () at probe.whip:3",
        "Line 1 of \"probe.whip\"",
    ] {
        assert!(told.contains(wanted), "{wanted}: {told}");
    }
}

/// The grand piano as a whole image; the line of its friction.
fn piano(folder: &Folder) -> String {
    let program = concat!(env!("CARGO_MANIFEST_DIR"), "/instruments/grand-piano.whip");
    let source = std::fs::read_to_string(program).expect("it is there");
    folder.write("grand-piano.whip", &source);
    let args = [
        "build",
        "grand-piano.whip",
        "--keys",
        "4",
        "--unproven",
        "-o",
        "out.elf",
    ];
    folder.run(WHIPPEN, &args).expect("is built");
    let mut lines = source.lines();
    let line = lines.position(|line| line.trim().starts_with("force friction"));
    format!("break grand-piano.whip:{}", 1 + line.expect("has friction"))
}

/// Callers by name, from inside a key's tick at every instruction of some keys' ticks.
#[test]
fn backtraces_lead_from_every_instruction_to_the_idle_loop() {
    let folder = Folder::new();
    let stop = piano(&folder);
    folder.write(
        "walk.py",
        "
def names():
    frame, names = gdb.newest_frame(), []
    while frame:
        names.append('<handler>' if frame.type() == gdb.SIGTRAMP_FRAME else frame.name() or '?')
        frame = frame.older()
    return ' < '.join(names)
for step in range(260):
    gdb.execute('stepi', to_string=True)
    print('chain', names())
",
    );
    let script = [
        stop.as_str(),
        "continue",
        "backtrace",
        "source walk.py",
        "kill",
    ];
    let Some(told) = session(&folder, "out.elf", &script) else {
        return;
    };
    let chains: Vec<&str> = told
        .lines()
        .filter_map(|l| l.strip_prefix("chain "))
        .collect();
    assert_eq!(chains.len(), 260, "{told}");
    for chain in &chains {
        let ends = ["idle0", "idle1"].iter().any(|idle| chain.ends_with(idle));
        let inside = chain.contains(".mode.") || chain.contains("_tick <");
        let handler = ["tick_core0 < <handler> < ", "tick_core1 < <handler> < "];
        let taken = handler.iter().any(|handler| chain.contains(handler));
        assert!(
            ends && (taken || !inside) && !chain.contains('?'),
            "{chain}"
        );
    }
    let inside = chains
        .iter()
        .filter(|chain| chain.contains(".mode."))
        .count();
    assert!(inside > 60, "{inside}: {told}");
}

/// Names of the program have their values, in real units; what is nowhere is said to be so.
#[test]
fn names_of_the_program_have_their_values() {
    let folder = Folder::new();
    let stop = piano(&folder);
    // In every step of some keys' ticks, what a name shows is what the key's own record has.
    folder.write(
        "walk.py",
        "
state = gdb.parse_and_eval('core0_state')
first, size = int(state['keys'].address), state['keys'][0].type.sizeof
shown = wrong = gone = 0
key = None
for step in range(400):
    gdb.execute('stepi', to_string=True)
    frame = gdb.newest_frame()
    if not (frame.name() or '').startswith('core0.mode.'):
        key = None
        continue
    if frame.pc() == frame.block().start:
        key = (int(gdb.parse_and_eval('(unsigned)$r7')) - first) // size
    if key is None or frame.name() == 'core0.mode.0':
        continue
    for name in ['phi', 'phi_prime']:
        value = gdb.parse_and_eval(name)
        if value.is_optimized_out:
            gone += 1
            continue
        raw = gdb.parse_and_eval('core0_state.keys[%d].unless_mode_knows.%s' % (key, name))
        lsb, _, _, zero = raw.type.name.split(' ')
        shown += 1
        wrong += abs(float(value) - (float(zero) + int(raw) * float(lsb))) > 1e-9
print('shown', shown, 'wrong', wrong, 'gone', gone)
",
    );
    let script = [
        stop.as_str(),
        "continue",
        "print weight",
        "whatis weight",
        "print contact",
        "whatis contact",
        "print support == jack",
        "print push",
        "info locals",
        "print core0_state.live_weight",
        "print core0_state.keys[1].key",
        "print core0_state.keys[1].unless_mode_knows.check",
        "continue 40",
        "source walk.py",
        "kill",
    ];
    let Some(told) = session(&folder, "out.elf", &script) else {
        return;
    };
    for wanted in [
        "$1 = -0.12999999988824129",
        "type = N (2^-30)",
        "$2 = touching",
        "type = enum contact",
        "$3 = 1",
        "$4 = <optimized out>",
        "repetition = disengaged",
        "$5 = -0.12999999988824129",
        "$6 = 1",
        "$7 = free",
    ] {
        assert!(told.contains(wanted), "{wanted}: {told}");
    }
    let counts = told.lines().find_map(|line| line.strip_prefix("shown "));
    let counts = counts.unwrap_or_else(|| panic!("{told}"));
    let numbers: Vec<usize> = counts
        .split(' ')
        .filter_map(|word| word.parse().ok())
        .collect();
    assert!(numbers[0] > 60 && numbers[1] == 0, "{counts}");
}

/// Each port's value comes from its own word, and the listing has each sense's line.
#[test]
fn several_ports_have_variables_and_lines() {
    let folder = Folder::new();
    folder.write(
        "bead.whip",
        include_str!("../programs/two-axis-spring.whip"),
    );
    let build = [
        "build",
        "bead.whip",
        "-o",
        "bead.elf",
        "--listing",
        "bead.lst",
    ];
    folder.run(WHIPPEN, &build);
    let listing = std::fs::read_to_string(folder.path().join("bead.lst")).expect("is written");
    for line in ["sense x: length", "sense y: length", "force wall   on y"] {
        assert!(listing.contains(line), "{line}");
    }
    let script = [
        "break bead.whip:10",
        "continue",
        "print x",
        "print y",
        // The word of y, in both halves.
        "set {unsigned short}((char *)&words0 + 2) = 0xc000",
        "set {unsigned short}((char *)&words0 + 10) = 0xc000",
        "print x",
        "print y",
        "print k",
        "whatis y",
        "print core0_state.live_k",
        "kill",
    ];
    let Some(told) = session(&folder, "bead.elf", &script) else {
        return;
    };
    for wanted in [
        "$1 = -0.16",
        "$2 = -0.12",
        "$3 = -0.16",
        "$4 = 0.06",
        "$5 = 20",
        "type = m",
    ] {
        assert!(told.contains(wanted), "{wanted}: {told}");
    }
}
