//! Closed loops of several ports, played and judged: each is that of an instrument with this port
//! alone.

use whippen_compiler::pipeline::Compiled;
use whippen_compiler::stability::{Hand, Stability, analyze};
use whippen_emulator::BoardKind;
use whippen_runtime::closed::{self, Closed, PortMover};
use whippen_runtime::device::{Device, Stands};
use whippen_runtime::engine::EngineKind;
use whippen_runtime::judged::judge;
use whippen_runtime::plant::Player;
use whippen_runtime::ringing;
use whippen_runtime::session::Recording;

use crate::cli::{Shell, bundled};
use crate::common;

/// A device with the ports `a` and `b`, each as the only one of `mikey`, but that `b` turns words
/// into less force and carries more.
fn pair() -> Device {
    let mikey = Device::mikey();
    let port = |name: &str| {
        let mut port = mikey.ports[0].clone();
        port.name = name.to_string();
        port.stands = Some(Stands {
            rated: 7.0,
            peak_s: 1.0,
        });
        port
    };
    let (a, mut b) = (port("a"), port("b"));
    b.drive.as_mut().expect("it is driven").full_scale = 24.0;
    b.mechanics.as_mut().expect("it moves").mass = 0.1;
    Device {
        name: "pair".to_string(),
        ports: vec![a, b],
        motor: None,
        passivity_j: None,
    }
}

/// A device with one of them alone.
fn alone(port: usize) -> Device {
    let mut device = Device::mikey();
    let mut own = pair().ports.remove(port);
    (own.name, own.stands) = (String::new(), None);
    device.ports = vec![own];
    device
}

const SENSE: &str = "length in -0.5 mm .. 10.5 mm over 1 ms";

fn on(device: &Device, text: &str) -> Compiled {
    let model = common::compiled("probe.whip", text, &[]).remove(0).model;
    whippen_compiler::pipeline::compile(model, device.scales(), true).expect("it lowers")
}

/// A hand that strikes; a spring is let go; somebody pushes.
fn movers() -> [PortMover; 2] {
    let strike = (0..4000).map(|tick| 8e-3 * f64::from(tick.min(900)) / 900.0);
    let hand = Hand {
        mass: 0.1,
        damping: 3.0,
        stiffness: 500.0,
    };
    let push = (0..4000).map(|tick| if tick < 1500 { 1.5 } else { 0.2 });
    [
        PortMover::Loop {
            player: Player::Hand {
                hand,
                target: strike.collect::<Vec<f64>>().into(),
            },
            start_m: 0.0,
        },
        PortMover::Loop {
            player: Player::Force(push.collect::<Vec<f64>>().into()),
            start_m: 1e-3,
        },
    ]
}

fn looped(
    compiled: &Compiled,
    device: &Device,
    kind: EngineKind,
    movers: Vec<PortMover>,
) -> Closed {
    let ports: Vec<usize> = (0..movers.len()).collect();
    let columns = closed::recorded(compiled, device, kind, &ports);
    let recording = Recording::everything(columns);
    let closed = closed::record(compiled, device, kind, (movers, 4000), recording, |_| ());
    closed.unwrap_or_else(|e| panic!("{}: {e}", kind))
}

/// What a column held at every tick.
fn column<'c>(closed: &'c Closed, title: &str) -> &'c [f64] {
    let columns = &closed.run.trace.columns;
    let found = columns.iter().find(|column| column.title() == title);
    let all = || columns.iter().map(|c| c.title()).collect::<Vec<_>>();
    found
        .unwrap_or_else(|| panic!("{title} in {:?}", all()))
        .values()
}

#[test]
fn each_loop_is_that_of_its_port_alone() {
    // In this order and in the other: numbers of senses and of drives differ.
    let both = format!(
        "instrument both {{ sense still: length in 0 mm .. 1 mm sense a: {SENSE} sense b: {SENSE} \
         force spring on b = 300 N/m * b force spring on a = 100 N/m * a + 2 N*s/m * a' }}"
    );
    let a =
        format!("instrument a {{ sense a: {SENSE} force spring = 100 N/m * a + 2 N*s/m * a' }}");
    let b = format!("instrument b {{ sense b: {SENSE} force spring = 300 N/m * b }}");
    let mut device = pair();
    let mut still = device.ports[0].clone();
    (still.name, still.drive, still.mechanics) = ("still".to_string(), None, None);
    device.ports.push(still);
    let (both, singles) = (on(&device, &both), [on(&alone(0), &a), on(&alone(1), &b)]);
    let [first, second] = movers();
    let together = vec![
        PortMover::Motion(vec![0.0].into()),
        first.clone(),
        second.clone(),
    ];
    let kinds = [
        EngineKind::Interp,
        EngineKind::Jit,
        EngineKind::Emulated(BoardKind::Rp2350.into()),
    ];
    let mut drives: Vec<Vec<f64>> = Vec::new();
    for kind in kinds {
        let columns = closed::recorded(&both, &device, kind, &[1, 2]);
        let recording = Recording::everything(columns);
        let movers = (together.clone(), 4000);
        let closed = closed::record(&both, &device, kind, movers, recording, |_| ());
        let closed = closed.unwrap_or_else(|e| panic!("{}: {e}", kind));
        let named: Vec<&str> = closed.loops.iter().map(|l| l.port.as_str()).collect();
        assert_eq!(named, ["a", "b"]);
        for (number, (name, mover)) in [("a", &first), ("b", &second)].into_iter().enumerate() {
            let single = looped(&singles[number], &alone(number), kind, vec![mover.clone()]);
            let words = column(&single, "drive_n");
            assert!(words.iter().any(|force| *force > 0.5), "{name} is pushed");
            assert_eq!(column(&closed, &format!("drive_{name}_n")), words);
            let observed = [
                "hand_target_m",
                "hand_force_n",
                "key_position_m",
                "key_speed_m_per_s",
                "coil_force_n",
                "stop_force_n",
                "energy_given_j",
                "energy_returned_j",
            ];
            for title in observed {
                let (own, alone) = (
                    column(&closed, &format!("{name}_{title}")),
                    column(&single, title),
                );
                let same = own
                    .iter()
                    .zip(alone)
                    .all(|(x, y)| x.to_bits() == y.to_bits());
                assert!(same, "{}: {name}_{title}", kind);
            }
            assert_eq!(closed.loops[number].strokes, single.loops[0].strokes);
            drives.push(words.to_vec());
        }
    }
    // The same words on every engine.
    assert!(drives.chunks(2).all(|pair| pair == &drives[..2]));
}

/// A hand at two ports of the bundled arm, nobody at a third; what is not driven, and ports without
/// a hand, follow the motion.
#[test]
fn hands_hold_the_arm_of_bundled_instruments() {
    let shell = Shell::new();
    let (violin, bank) = (bundled("bowed-violin.whip"), bundled("rubbed-bank.whip"));
    for (file, extra) in [
        (&violin, ["--hand", "y=0.2kg,3N*s/m,500N/m"]),
        (&bank, ["--hand", "z=free"]),
    ] {
        for engine in ["jit", "interp"] {
            let table = format!("{engine}.csv");
            let command = ["run", file, "--hand", "x=0.2kg,3N*s/m,2000N/m"];
            let how = ["--seconds", "0.3", "--engine", engine, "--out", &table];
            let (out, _) = shell.ends(0, &[&command[..], &extra, &how].concat());
            assert!(
                out.contains("a hand leads the key along the motion, at `x`"),
                "{out}"
            );
        }
        let [jit, interp] = ["jit.csv", "interp.csv"].map(|table| shell.lines(table));
        assert_eq!(jit, interp, "{file}");
        let titles: Vec<&str> = jit[0].split(',').collect();
        let at = |title: &str| titles.iter().position(|t| *t == title);
        let row = |title: &str| {
            let at = at(title).unwrap_or_else(|| panic!("{title} in {titles:?}"));
            let cells = jit[1..]
                .iter()
                .filter_map(move |row| row.split(',').nth(at));
            cells.filter_map(|cell| cell.parse::<f64>().ok())
        };
        let pairs = row("x_hand_target_m").zip(row("x_key_position_m"));
        let apart = pairs
            .map(|(wanted, is)| (wanted - is).abs())
            .fold(0.0, f64::max);
        // 3.3 N of the arm, and what a mass takes, against 2000 N/m.
        assert!(apart > 0.0 && apart < 5e-3, "{apart}");
        assert!(at("z_hand_force_n").is_some() == extra[1].starts_with('z'));
    }
}

#[test]
fn loops_that_cannot_be_closed_are_named() {
    let shell = Shell::new()
        .with("push.csv", "t_s,f_n\n0,1\n0.1,1\n")
        .with("way.csv", "t_s,x_mm\n0,1\n0.1,1\n");
    let violin = bundled("bowed-violin.whip");
    let hand = "x=0.2kg,3N*s/m,500N/m";
    for (args, words) in [
        (
            ["--hand", "tilt=free", "--seconds", "1"],
            "no force of `bowed_violin` acts on `tilt`",
        ),
        (
            ["--hand", "w=free", "--seconds", "1"],
            "but on `x`, `y`, `z`",
        ),
        (["--hand", hand, "--hand", "x=free"], "stands twice"),
        (
            ["--hand", hand, "--force", "x=push.csv"],
            "acts on a free key",
        ),
        (
            ["--hand", "x=0.2kg,3N*s/m", "--seconds", "1"],
            "mass, damping and stiffness",
        ),
    ] {
        shell.refuses(2, &[&["run", &violin][..], &args].concat(), &[words]);
    }
    let spring = bundled("virtual-spring.whip");
    let motion = ["run", &spring, "--force", "push.csv", "--motion", "way.csv"];
    shell.refuses(2, &motion, &["leave --motion away"]);
}

/// The analysis of each port is that of its spring alone, to the last bit.
#[test]
fn each_port_is_judged_as_its_spring_alone() {
    let both = format!(
        "instrument both {{ sense a: {SENSE} sense b: {SENSE} \
         force spring on b = 30 kN/m * b force spring on a = 100 N/m * a + 2 N*s/m * a' }}"
    );
    let a =
        format!("instrument a {{ sense a: {SENSE} force spring = 100 N/m * a + 2 N*s/m * a' }}");
    let b = format!("instrument b {{ sense b: {SENSE} force spring = 30 kN/m * b }}");
    let both = on(&pair(), &both).model;
    let ports = judge(&both, &pair(), None);
    let names: Vec<&str> = ports.iter().map(|port| port.port.as_str()).collect();
    assert_eq!(names, ["a", "b"]);
    for (number, (port, text)) in ports.iter().zip([a, b]).enumerate() {
        let device = alone(number);
        let model = on(&device, &text).model;
        let key = device.port().key(model.rate_hz).expect("mechanics");
        let single = analyze(&model, &key).expect("bounded");
        let found = port.found.as_ref().expect("judged");
        assert_eq!(found.largest, single.largest);
        assert_eq!(found.force_per_word, single.force_per_word);
        let of = |found: &Stability| -> Vec<_> {
            let modes = found.modes.iter();
            modes
                .map(|m| (m.gains, m.worst, m.damping_needed))
                .collect()
        };
        assert_eq!(of(found), of(&single));
    }
    let said = ports.iter().flat_map(ringing::warnings_of);
    let said: Vec<String> = said.map(|d| d.message).collect();
    assert!(
        said.len() == 1 && said[0].contains("makes the port `b` ring"),
        "{said:?}"
    );
}
