//! The stability budget for people and for programs.

use std::fmt::Write;

use serde_json::{Value, json};
use whippen_compiler::diag::{Code, Diagnostic};
use whippen_compiler::model::{Interval, Model};
use whippen_compiler::stability::{self, Borders, Hand, Mode, Stability};
use whippen_runtime::judged::JudgedPort;
use whippen_runtime::ringing;

/// So many modes are listed.
const MODES_SHOWN: usize = 4;

/// What is known of the loop of one instrument.
pub struct StabilityBudget {
    found: Stability,
    hands: usize,
    turns: bool,
    warnings: Vec<Diagnostic>,
}

impl StabilityBudget {
    /// `None` if nothing is known of the port.
    pub fn of(port: &JudgedPort) -> Option<StabilityBudget> {
        let found = port.found.as_ref().ok()?.clone();
        let turns = port.model.turns();
        Some(StabilityBudget {
            warnings: ringing::warnings_of(port),
            found,
            hands: stability::hands(turns).len() - 1,
            turns,
        })
    }

    /// What rings, and what is not proven stable.
    pub fn warnings(&self) -> &[Diagnostic] {
        &self.warnings
    }

    /// `passive`, `stable`, `unproven`, `undecided` or `rings`.
    fn verdict(&self) -> &'static str {
        let rings = self.warnings.iter().any(|d| d.code == Code::Unstable);
        match (self.found.is_stable(), self.found.is_passive()) {
            (true, true) => "passive",
            (true, false) => "stable",
            (false, _) if rings => "rings",
            (false, _) if self.found.is_stable_where_decided() => "undecided",
            (false, _) => "unproven",
        }
    }

    /// How much larger all forces may be before it rings (percent), and the damping of the key
    /// above what passivity needs (percent).
    fn margins(&self) -> [f64; 2] {
        let needed = self.found.damping_needed();
        [
            100.0 * (self.found.factor() - 1.0),
            100.0 * (self.found.key.damping / needed.max(1e-12) - 1.0),
        ]
    }

    /// Stiffness, damping, mass.
    fn units(&self) -> [&'static str; 3] {
        if self.turns {
            ["N*m/rad", "N*m*s/rad", "kg*m^2"]
        } else {
            ["N/m", "N*s/m", "kg"]
        }
    }

    pub fn text(&self) -> String {
        let at = self.found.port.as_ref();
        let at = at.map_or(String::new(), |port| format!(" of `{port}`"));
        let mut out = format!("stability{at}: {}\n", self.verdict_in_words());
        if !self.found.modes.is_empty() {
            self.add_damping(&mut out);
        }
        self.add_gains(&mut out);
        self.add_quiet(&mut out);
        if self.found.undecided > 0 {
            out += "  its choices make more cases than are looked at (docs/stability.md)\n";
        }
        let modes = &self.found.modes;
        for mode in modes.iter().take(MODES_SHOWN) {
            self.mode(&mut out, mode);
        }
        if modes.len() > MODES_SHOWN {
            let more = modes.len() - MODES_SHOWN;
            let _ = writeln!(out, "  and {more} modes with more margin");
        }
        out
    }

    fn verdict_in_words(&self) -> String {
        let margin = margin_in_words(self.margins()[0]);
        match self.verdict() {
            "passive" => format!("passive; stable with every hand, {margin}"),
            "stable" => format!(
                "stable with nobody and with each of {} hands, {margin}",
                self.hands
            ),
            "rings" => format!("IT RINGS, {margin}"),
            "undecided" => match self.found.modes.len() {
                0 => "not decided".to_string(),
                cases => format!("not decided; {cases} cases that were are stable, {margin}"),
            },
            _ => format!("not proven stable, but nothing is seen to ring; {margin}"),
        }
    }

    fn add_damping(&self, out: &mut String) {
        let s = &self.found;
        let changing = s
            .damping_for_changing
            .map(|b| format!(" ({} where gains change while playing)", number(b)));
        let _ = writeln!(
            out,
            "  passivity needs {} {} of the key's own damping and it has {}{}",
            number(s.damping_needed()),
            self.units()[1],
            number(s.key.damping),
            changing.unwrap_or_default()
        );
    }

    /// The ranges of the gains that are not 0.
    fn add_gains(&self, out: &mut String) {
        let gains = self.found.largest.iter().zip(self.units());
        for (what, (range, unit)) in ["stiffness", "damping", "mass"].iter().zip(gains) {
            if range.magnitude() > 0.0 {
                let (low, high) = (number(range.low), number(range.high));
                let _ = writeln!(out, "  {what} {low} .. {high} {unit}");
            }
        }
    }

    /// Whether the sensor's steps can be felt or heard.
    fn add_quiet(&self, out: &mut String) {
        let s = &self.found;
        let unit = if self.turns { "mN*m" } else { "mN" };
        let _ = writeln!(
            out,
            "  one word of the sensor moves the force by {} {unit}, dry friction holds {}: {}",
            number(s.force_per_word * 1e3),
            number(s.key.friction * 1e3),
            if s.is_quiet() { "quiet" } else { "it may hum" }
        );
    }

    fn mode(&self, out: &mut String, mode: &Mode) {
        let gains: Vec<String> = (mode.gains.iter().zip(self.units()))
            .filter(|(gain, _)| **gain != 0.0)
            .map(|(gain, unit)| format!("{} {unit}", number(*gain)))
            .collect();
        let gains = if gains.is_empty() {
            "no force that depends on motion".to_string()
        } else {
            gains.join(", ")
        };
        let margin = if mode.settles {
            margin_in_words(100.0 * (mode.worst.factor - 1.0))
        } else {
            "unstable by itself".into()
        };
        let at = if mode.worst.ring_hz > 0.0 {
            format!(
                ", {:.0} Hz, {}",
                mode.worst.ring_hz,
                self.hand(mode.worst.hand)
            )
        } else {
            String::new()
        };
        let _ = writeln!(out, "  {}: {gains}: {margin}{at}", mode.name);
    }

    fn hand(&self, hand: Hand) -> String {
        if hand == Hand::FREE {
            return "nobody".to_string();
        }
        let units = self.units();
        format!(
            "hand {} {}, {} {}, {} {}",
            number(hand.mass),
            units[2],
            number(hand.damping),
            units[1],
            number(hand.stiffness),
            units[0]
        )
    }

    /// Borders of a spring with a damper, over as much damping as the instrument has.
    pub fn map(&self, model: &Model) -> Value {
        let window = model.senses.first().map_or(3, |s| s.window);
        let device = Borders::new(&self.found.key, self.found.rate_hz, window);
        let own = self
            .found
            .modes
            .iter()
            .map(|m| m.gains[1])
            .fold(2.0 * self.found.key.damping, f64::max);
        let dampings: Vec<f64> = (0..=40).map(|i| 1.2 * own * f64::from(i) / 40.0).collect();
        let nobody: Vec<[f64; 2]> = dampings
            .iter()
            .map(|b| [*b, device.stable(&Hand::FREE, *b)])
            .collect();
        let passive: Vec<[f64; 2]> = dampings
            .iter()
            .filter_map(|b| Some([*b, device.passive(*b)?]))
            .collect();
        let borders = nobody.iter().map(|p| p[1]);
        let stiffest = self
            .found
            .modes
            .iter()
            .map(|m| m.gains[0])
            .chain(borders)
            .fold(0.0, f64::max);
        let units = self.units();
        json!({
            "damping_end": 1.2 * own, "stiffness_end": stiffest,
            "damping_unit": format!("damping ({})", units[1]), "stiffness_unit": format!("stiffness ({})", units[0]),
            "nobody": nobody, "passive": passive,
        })
    }

    pub fn json(&self) -> Value {
        let (s, [margin, passive]) = (&self.found, self.margins());
        let range = |i: &Interval| json!([i.low, i.high]);
        let hand =
            |h: &Hand| json!({ "mass": h.mass, "damping": h.damping, "stiffness": h.stiffness });
        let mode = |m: &Mode| {
            json!({
                "name": m.name, "stiffness": m.gains[0], "damping": m.gains[1], "mass": m.gains[2], "coupled": m.coupled,
                "settles": m.settles, "damping_needed": m.damping_needed, "factor": m.worst.factor,
                "ring_hz": m.worst.ring_hz, "growth_per_s": m.worst.growth_per_s, "hand": hand(&m.worst.hand),
            })
        };
        json!({
            "verdict": self.verdict(),
            "margin_percent": margin,
            "passivity_margin_percent": passive,
            "damping_needed": s.damping_needed(),
            "damping_needed_changing": s.damping_for_changing,
            "key": { "mass": s.key.mass, "damping": s.key.damping, "friction": s.key.friction,
                     "delay_ticks": s.key.delay_ticks, "bandwidth_hz": s.key.bandwidth_hz, "lag_hz": s.key.lag_hz,
                     "mode_hz": s.key.mode.map(|mode| mode.hz), "mode_damping": s.key.mode.map(|mode| mode.damping) },
            "stiffness": range(&s.largest[0]), "damping": range(&s.largest[1]), "mass": range(&s.largest[2]),
            "force_per_word": s.force_per_word, "quiet": s.is_quiet(), "undecided": s.undecided, "hands": self.hands,
            "modes": s.modes.iter().map(mode).collect::<Vec<_>>(),
        })
    }
}

/// A margin in words.
fn margin_in_words(percent: f64) -> String {
    match percent {
        p if p >= 9_899.0 => "margin beyond 100 times".to_string(),
        p if p >= 0.0 => format!("margin {p:.0} %"),
        p => format!("{:.0} % too much", -100.0 * p / (100.0 + p)),
    }
}

/// Three digits.
fn number(value: f64) -> String {
    let rounded: f64 = format!("{value:.2e}").parse().unwrap_or(value);
    if rounded != 0.0 && !(1e-3..1e6).contains(&rounded.abs()) {
        format!("{rounded:e}")
    } else {
        format!("{rounded}")
    }
}
