//! The standard library's escapement and plectrum against the paper's words (Oboe & De Poli 2006,
//! figs. 4, 5 and 8).

use whippen_compiler::pipeline::Compiled;
use whippen_runtime::device::Device;
use whippen_runtime::engine::EngineKind;

use crate::common;
use crate::player::Player;

/// Fixed point may be off by so much (N).
const TOLERANCE_N: f64 = 1e-4;

/// Where the force begins (theta_1), is highest (theta_2) and is gone (theta_3), and how high it
/// is.
const START_M: f64 = 6.0e-3;
const PEAK_M: f64 = 7.6e-3;
const END_M: f64 = 8.4e-3;
const HEIGHT_N: f64 = 0.2;

const ENGINES: [EngineKind; 2] = [EngineKind::Jit, EngineKind::Interp];

fn bump() -> Compiled {
    let text = "instrument bump {
        sense x: length in -0.5 mm .. 10.5 mm
        let jack = escapement(x, start: 6.0 mm, peak: 7.6 mm, end: 8.4 mm, height: 0.20 N)
        force escapement = jack.resistance
    }";
    common::compiled("bump.whip", text, &[]).remove(0)
}

/// Figures 4 and 5 as the paper tells them: where on the trajectory the key is.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Trajectory {
    /// On the rising slope, the peak not passed on this stroke.
    Rising,
    /// Past the peak and going down.
    Falling,
    /// Turned back past the peak: the force that is held and where the key turned (theta_M).
    Turned { force_n: f64, at_m: f64 },
    /// Through: silent until the key is back.
    Through,
}

struct Paper {
    on: Trajectory,
    last_m: f64,
}

impl Paper {
    fn new() -> Paper {
        Paper {
            on: Trajectory::Rising,
            last_m: 0.0,
        }
    }

    fn rising_n(x_m: f64) -> f64 {
        HEIGHT_N * (x_m - START_M) / (PEAK_M - START_M)
    }

    fn falling_n(x_m: f64) -> f64 {
        HEIGHT_N * (END_M - x_m) / (END_M - PEAK_M)
    }

    fn force_n(&mut self, x_m: f64) -> f64 {
        self.on = self.next(x_m);
        self.last_m = x_m;
        match self.on {
            _ if x_m <= START_M => 0.0,
            Trajectory::Rising => Paper::rising_n(x_m),
            Trajectory::Falling => Paper::falling_n(x_m),
            // Kept constant down to theta_m, where the rising slope has the same force; below, with
            // the slope.
            Trajectory::Turned { force_n, .. } if Paper::rising_n(x_m) >= force_n => force_n,
            Trajectory::Turned { .. } => Paper::rising_n(x_m),
            Trajectory::Through => 0.0,
        }
    }

    fn next(&self, x_m: f64) -> Trajectory {
        match self.on {
            _ if x_m <= START_M => Trajectory::Rising,
            Trajectory::Through => Trajectory::Through,
            _ if x_m >= END_M => Trajectory::Through,
            Trajectory::Rising if x_m > PEAK_M => Trajectory::Falling,
            Trajectory::Rising => Trajectory::Rising,
            Trajectory::Falling if x_m < self.last_m => Trajectory::Turned {
                force_n: Paper::falling_n(self.last_m),
                at_m: self.last_m,
            },
            Trajectory::Falling => Trajectory::Falling,
            // The paper leaves open what a key that went below theta_m meets on its way down again;
            // here the memory stays.
            Trajectory::Turned { at_m, .. } if x_m >= at_m => Trajectory::Falling,
            turned => turned,
        }
    }
}

/// Moves a key from turning point to turning point (m), `step_m` a tick, and tells every tick to
/// `each`.
fn moved(from_m: f64, turns: &[(f64, f64)], mut each: impl FnMut(f64)) {
    let mut x_m = from_m;
    for &(to_m, step_m) in turns {
        let ticks = ((to_m - x_m).abs() / step_m).ceil().max(1.0);
        let from_m = x_m;
        (1..=ticks as u32)
            .for_each(|tick| each(from_m + (to_m - from_m) * f64::from(tick) / ticks));
        x_m = to_m;
    }
}

/// The instrument beside the paper's automaton, which hears the same quantized position.
struct Beside<'c> {
    player: Player<'c>,
    device: Device,
    paper: Paper,
    force: usize,
    out: usize,
    ticks: usize,
    worst_n: f64,
}

impl<'c> Beside<'c> {
    fn new(compiled: &'c Compiled, kind: EngineKind) -> Beside<'c> {
        let player = Player::new(compiled, kind);
        let (force, out) = (player.index("escapement"), player.index("jack.out"));
        Beside {
            player,
            device: Device::mikey(),
            paper: Paper::new(),
            force,
            out,
            ticks: 0,
            worst_n: 0.0,
        }
    }

    fn tick(&mut self, x_m: f64) -> f64 {
        let word = self.device.word_of_position(x_m).0;
        let was_through = self.paper.on == Trajectory::Through;
        let expected_n = self.paper.force_n(self.device.position_of_word(word));
        self.player.tick_word(word);
        let force_n = self.player.value_at(self.force);
        let off_n = (force_n - expected_n).abs();
        assert!(
            off_n <= TOLERANCE_N,
            "tick {}: {force_n} N at {x_m} m, {:?}: {expected_n} N",
            self.ticks,
            self.paper.on
        );
        // The jack tells the state the tick began with.
        assert_eq!(
            self.player.value_at(self.out) == 1.0,
            was_through,
            "tick {}: jack.out at {x_m} m",
            self.ticks
        );
        self.ticks += 1;
        self.worst_n = self.worst_n.max(off_n);
        force_n
    }
}

/// A stroke by turning points: position (mm) and the force there (mN), worked out by hand from
/// figs. 4 and 5.
type Stroke = &'static [(f64, f64)];

/// Rises 125 mN/mm from 6.0 mm to 200 mN at 7.6 mm, falls 250 mN/mm to nothing at 8.4 mm.
const STROKES: &[(&str, Stroke)] = &[
    (
        "full stroke (fig. 4)",
        &[
            (5.9, 0.0),
            (6.4, 50.0),
            (6.8, 100.0),
            (7.6, 200.0),
            (8.0, 100.0),
            (8.4, 0.0),
            (9.9, 0.0),
            (8.0, 0.0),
            (7.6, 0.0),
        ],
    ),
    (
        "turned before the peak",
        &[
            (7.2, 150.0),
            (6.8, 100.0),
            (6.4, 50.0),
            (7.2, 150.0),
            (7.6, 200.0),
            (8.0, 100.0),
        ],
    ),
    (
        "turned at the peak",
        &[(7.6, 200.0), (7.2, 150.0), (7.6, 200.0), (8.0, 100.0)],
    ),
    (
        "turned past the peak (fig. 5)",
        &[
            (8.0, 100.0),
            (7.6, 100.0),
            (7.0, 100.0),
            (6.8, 100.0),
            (6.4, 50.0),
            (6.0, 0.0),
        ],
    ),
    (
        "turned again before theta_m",
        &[
            (8.0, 100.0),
            (7.2, 100.0),
            (7.8, 100.0),
            (8.0, 100.0),
            (8.2, 50.0),
            (7.0, 50.0),
            (6.4, 50.0),
            (6.2, 25.0),
        ],
    ),
    (
        "turned again and again",
        &[
            (7.8, 150.0),
            (7.4, 150.0),
            (7.7, 150.0),
            (7.3, 150.0),
            (7.8, 150.0),
            (8.0, 100.0),
            (7.8, 100.0),
            (8.1, 75.0),
        ],
    ),
    (
        "turned again below theta_m",
        &[
            (8.0, 100.0),
            (6.4, 50.0),
            (6.8, 100.0),
            (7.6, 100.0),
            (8.0, 100.0),
            (8.2, 50.0),
        ],
    ),
    (
        "turned at the very end",
        &[
            (8.36, 10.0),
            (7.0, 10.0),
            (6.08, 10.0),
            (6.04, 5.0),
            (7.0, 10.0),
            (8.38, 5.0),
        ],
    ),
    (
        "silent until it is back",
        &[
            (8.5, 0.0),
            (6.2, 0.0),
            (7.6, 0.0),
            (6.01, 0.0),
            (8.3, 0.0),
            (5.99, 0.0),
            (6.8, 100.0),
        ],
    ),
    (
        "back to the start without going through",
        &[(8.0, 100.0), (5.99, 0.0), (7.6, 200.0), (8.0, 100.0)],
    ),
];

#[test]
fn strokes_and_inversions_have_the_forces_of_figures_4_and_5() {
    let compiled = bump();
    for kind in ENGINES {
        for (name, points) in STROKES {
            let mut beside = Beside::new(&compiled, kind);
            let mut last_m = 0.0;
            for &(x_mm, force_mn) in *points {
                let mut felt_n = 0.0;
                moved(last_m, &[(x_mm * 1e-3, 3e-6)], |x_m| {
                    felt_n = beside.tick(x_m)
                });
                last_m = x_mm * 1e-3;
                // A word of the sensor is 0.17 um, 0.04 mN on the steep side; a tick past the turn
                // is another word.
                assert!(
                    (felt_n - force_mn * 1e-3).abs() < 2e-4,
                    "{kind}, {name}: {felt_n} N at {x_mm} mm"
                );
            }
        }
    }
}

/// A xorshift generator with a fixed seed: numbers in 0 .. 1.
fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}

#[test]
fn thousands_of_random_motions_follow_the_paper() {
    const MOTIONS: usize = 3_000;
    let compiled = bump();
    for kind in ENGINES {
        let mut beside = Beside::new(&compiled, kind);
        let mut next = random(0x5eed_0fe5_ca9e_3d01);
        let (mut turned, mut through) = (0, 0);
        for _ in 0..MOTIONS {
            let count = 3 + (next() * 10.0) as usize;
            // Between 5.5 and 9 mm, most turns within the escapement; from 20 um to 1 mm a tick,
            // 0.9 m/s to 44 m/s.
            let mut turns: Vec<(f64, f64)> = (0..count)
                .map(|_| (5.5e-3 + 3.0e-3 * next(), 2e-5 * 50f64.powf(next())))
                .collect();
            // Every other motion begins at rest, the rest goes on from where the last one ended.
            if next() < 0.5 {
                turns.insert(0, (0.0, 1e-4));
            }
            let from_m = beside.paper.last_m;
            moved(from_m, &turns, |x_m| {
                beside.tick(x_m);
                turned += usize::from(matches!(beside.paper.on, Trajectory::Turned { .. }));
                through += usize::from(beside.paper.on == Trajectory::Through);
            });
        }
        let Beside { ticks, worst_n, .. } = beside;
        println!(
            "{kind}: {MOTIONS} motions, {ticks} ticks, {turned} turned, {through} through, off {worst_n:.1e} N"
        );
        assert!(
            turned > ticks / 20 && through > ticks / 20,
            "the motions reach every part of the figures"
        );
    }
}

/// The harpsichord with its stops.
fn harpsichord(front: &str, back: &str, four: &str) -> Compiled {
    let sets = [
        ("front", front),
        ("back", back),
        ("four", four),
        ("B", "0N*s/m"),
    ];
    common::instruments("harpsichord.whip", &sets).remove(0)
}

/// Position (m) and force (N).
type Curve = Vec<(f64, f64)>;

/// Forces of a stroke to 9 mm and back, every 10 um: going down, coming back; and how often each
/// row plucked.
fn stroke(player: &mut Player) -> (Curve, Curve, [usize; 3]) {
    let total = player.index("force");
    let (mut down, mut back) = (Vec::new(), Vec::new());
    player.events();
    moved(0.0, &[(9e-3, 1e-5)], |x_m| {
        player.tick(x_m);
        down.push((x_m, player.value_at(total)));
    });
    moved(9e-3, &[(0.0, 1e-5)], |x_m| {
        player.tick(x_m);
        back.push((x_m, player.value_at(total)));
    });
    let events = player.events();
    let count = |name: &str| events.iter().filter(|(event, _)| event == name).count();
    (
        down,
        back,
        [
            count("pluck_front"),
            count("pluck_back"),
            count("pluck_four"),
        ],
    )
}

/// Positions (mm) and heights (N) of the local maxima.
fn peaks(curve: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let summit = |w: &&[(f64, f64)]| w[1].1 > w[0].1 + 1e-4 && w[1].1 > w[2].1 + 1e-4;
    curve
        .windows(3)
        .filter(summit)
        .map(|w| (w[1].0 * 1e3, w[1].1))
        .collect()
}

fn at(curve: &[(f64, f64)], x_mm: f64) -> f64 {
    let nearest = |a: &&(f64, f64), b: &&(f64, f64)| {
        (a.0 - x_mm * 1e-3)
            .abs()
            .total_cmp(&(b.0 - x_mm * 1e-3).abs())
    };
    curve.iter().min_by(nearest).expect("a curve").1
}

#[test]
fn plectra_at_three_depths_make_the_peaks_of_figure_8() {
    let compiled = harpsichord("on", "on", "on");
    for kind in ENGINES {
        let mut player = Player::new(&compiled, kind);
        let (down, back, plucks) = stroke(&mut player);
        let found = peaks(&down);
        let expected = [(3.8, 0.9), (5.4, 0.8), (7.0, 0.6)];
        assert_eq!(found.len(), expected.len(), "{found:?}");
        for ((x_mm, force_n), (at_mm, height_n)) in found.iter().zip(expected) {
            // Samples are 10 um apart.
            assert!((x_mm - at_mm).abs() < 0.011, "{found:?}");
            assert!((force_n - height_n).abs() < 0.02, "{found:?}");
        }
        for silent_mm in [2.9, 4.05, 4.5, 5.65, 6.1, 7.25, 9.0] {
            assert_eq!(at(&down, silent_mm), 0.0, "going down at {silent_mm} mm");
        }
        assert!((at(&down, 3.4) - 0.45).abs() < 0.02 && (at(&down, 3.9) - 0.45).abs() < 0.06);
        assert!(
            back.iter().all(|(_, force_n)| *force_n == 0.0),
            "silent on the way back"
        );
        assert_eq!(plucks, [1, 1, 1]);
        assert_eq!(
            stroke(&mut player).2,
            [1, 1, 1],
            "and again on the next stroke"
        );
    }
}

#[test]
fn a_register_that_is_off_is_silent() {
    for (stops, plucks, expected_mm) in [
        (["on", "off", "off"], [1, 0, 0], vec![3.8]),
        (["off", "on", "off"], [0, 1, 0], vec![5.4]),
        (["off", "off", "on"], [0, 0, 1], vec![7.0]),
        (["off", "off", "off"], [0, 0, 0], vec![]),
    ] {
        let compiled = harpsichord(stops[0], stops[1], stops[2]);
        for kind in ENGINES {
            let (down, back, counted) = stroke(&mut Player::new(&compiled, kind));
            assert_eq!(counted, plucks, "{stops:?}");
            let found: Vec<f64> = peaks(&down)
                .iter()
                .map(|(x_mm, _)| (x_mm * 10.0).round() / 10.0)
                .collect();
            assert_eq!(found, expected_mm, "{stops:?}");
            let most_n = down.iter().chain(&back).map(|p| p.1).fold(0.0, f64::max);
            assert_eq!(
                most_n == 0.0,
                expected_mm.is_empty(),
                "{stops:?}: {most_n} N"
            );
        }
    }
}

#[test]
fn a_plectrum_plucks_again_only_after_its_touch_point() {
    let compiled = harpsichord("on", "off", "off");
    for kind in ENGINES {
        let mut player = Player::new(&compiled, kind);
        // From 3.0 mm it touches, at 4.0 mm it has plucked.
        let mut last_m = 0.0;
        for (x_mm, plucks) in [
            (3.95, 0),
            (3.1, 0),
            (4.2, 1),
            (3.05, 0),
            (4.2, 0),
            (2.95, 0),
            (4.2, 1),
            (0.0, 0),
            (9.0, 1),
        ] {
            moved(last_m, &[(x_mm * 1e-3, 1e-5)], |x_m| player.tick(x_m));
            last_m = x_mm * 1e-3;
            // The event follows the tongue by a tick.
            player.tick(last_m);
            player.tick(last_m);
            assert_eq!(player.count("pluck_front"), plucks, "at {x_mm} mm");
        }
    }
}
