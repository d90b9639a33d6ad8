//! What is said of force terms that make the loop ring, and of those that are not proven stable.

use super::advice::{Looked, Search, rounded, rounded_down};
use super::key::Hand;
use super::loops::{Between, Loops, PerHand, turns};
use super::modes::{Mode, Stability};
use super::trial::{Oscillation, Seen, Trial};
use whippen_lang::diag::{Code, Diagnostic};
use whippen_lang::model::Model;
use whippen_lang::units::{Dim, shown};

/// So many modes of a force term are tried out, the worst first.
const TRIED_MAX: usize = 4;

/// A smaller part of a term is none.
const PART_LEAST: f64 = 5e-3;

/// A force term and the modes that it has the largest share in, none of them proven stable.
struct Blame<'a> {
    force: usize,
    /// The worst first.
    modes: Vec<&'a Mode>,
}

/// A warning for every force term that makes the key ring, and a note for every other that is not
/// proven stable, in the order of the text. `see` runs the program where a mode occurs.
pub fn warnings(
    model: &Model,
    stability: &Stability,
    see: &mut dyn FnMut(&Trial) -> Seen,
) -> Vec<Diagnostic> {
    let mut blames: Vec<Blame> = Vec::new();
    let unproven = |m: &&Mode| m.settles && m.worst.factor <= 1.0;
    for mode in stability.modes.iter().filter(unproven) {
        let force = guilty(&stability.loops, mode);
        match blames.iter_mut().find(|b| b.force == force) {
            None => blames.push(Blame {
                force,
                modes: vec![mode],
            }),
            Some(known) => known.modes.push(mode),
        }
    }
    blames.sort_by_key(|b| b.force);
    let search = Search::new(stability);
    let mut found: Vec<Diagnostic> = blames
        .iter()
        .map(|blame| {
            let (mode, seen) = tried(&stability.loops, blame, see);
            told(model, stability, (blame, mode, seen), &search)
        })
        .collect();
    found.extend(restless(model, stability, see));
    found.extend((stability.undecided > 0).then(|| undecided(model, stability)));
    found
}

/// Of an instrument with too many choices.
fn undecided(model: &Model, stability: &Stability) -> Diagnostic {
    let at = stability.port.as_ref();
    let at = at.map_or(String::new(), |port| format!(" at the port `{port}`"));
    let message = format!(
        "whether `{}`{at} is stable is not decided: its choices make more cases than are looked at",
        model.name
    );
    let label = match (stability.modes.len(), stability.is_stable_where_decided()) {
        (0, _) => "none was decided".to_string(),
        (cases, true) => format!("{cases} were decided, and are stable"),
        (cases, false) => format!("{cases} were decided, and not all are proven stable"),
    };
    let hint = "contacts, limits and states that can all be met at once multiply; \
                runs in a closed loop show what they do: whippen run FILE --hand free";
    let diagnostic = Diagnostic::new(Code::NotProvenStable, model.span, message, label);
    explained(Code::NotProvenStable, diagnostic.hint(hint))
}

/// The force term that gives most to the growing motion.
fn guilty(loops: &Loops, mode: &Mode) -> usize {
    let gives = loops.gives(mode);
    (0..gives.len())
        .max_by(|a, b| gives[*a].total_cmp(&gives[*b]))
        .unwrap_or(0)
}

/// The mode that is told of a term, and what is seen there: the first that rings, else the worst.
fn tried<'a>(
    loops: &Loops,
    blame: &Blame<'a>,
    see: &mut dyn FnMut(&Trial) -> Seen,
) -> (&'a Mode, Seen) {
    let worst = blame.modes[0];
    let mut all = Seen::Quiet;
    for mode in blame.modes.iter().take(TRIED_MAX) {
        let seen = see(&Trial {
            places: &mode.places,
            hands: hands_to_try(loops, mode),
            falls_with_speed: mode.gains[1] < 0.0,
        });
        match seen {
            Seen::Rings(_) => return (mode, seen),
            Seen::NotTried => all = seen,
            Seen::Quiet => {}
        }
    }
    (worst, all)
}

/// The worst hand, the worst that has a spring, and nobody, of those in which a mode is unstable.
fn hands_to_try(loops: &Loops, mode: &Mode) -> Vec<PerHand> {
    let mut all = loops.per_hand(&mode.system, &mut Between::default());
    all.retain(|p| p.factor <= 1.0);
    all.sort_by(|a, b| a.factor.total_cmp(&b.factor));
    let first = |which: &dyn Fn(&Hand) -> bool| all.iter().find(|p| which(&p.hand)).copied();
    let mut chosen: Vec<PerHand> = Vec::new();
    let wanted = [
        first(&|_| true),
        first(&|hand| hand.stiffness > 0.0),
        first(&|hand| *hand == Hand::FREE),
    ];
    for found in wanted.into_iter().flatten() {
        if chosen.iter().all(|c| c.hand != found.hand) {
            chosen.push(loops.as_it_is(&mode.system, found));
        }
    }
    chosen
}

fn told(
    model: &Model,
    stability: &Stability,
    (blame, mode, seen): (&Blame, &Mode, Seen),
    search: &Search,
) -> Diagnostic {
    let term = &model.forces[blame.force];
    let most = coefficient(model, mode, blame.force);
    let what = if model.turns() { "torque" } else { "force" };
    let name = &term.name;
    let is = if mode.bounded { "may be" } else { "is" };
    let falls = if most.kind == 1 && most.value < 0.0 {
        ": it falls with speed, which drives the motion"
    } else {
        ""
    };
    let (kind, value) = (KINDS[most.kind], shown(rounded(most.value), most.dim));
    let label = format!("its {kind} here {is} {value}{falls}");
    let (code, message, hint) = match seen {
        Seen::Rings(o) => {
            let (hz, amplitude) = (frequency(o.hz), shown(rounded(o.amplitude), travel(model)));
            let (hand, moved) = (held_by(model, stability, o.hand), moved(model, stability));
            let grows = if o.grows { " and more" } else { "" };
            let message = format!(
                "the {what} `{name}` makes the {moved} ring, at {hz} by {amplitude}{grows} {hand}"
            );
            (
                Code::Unstable,
                message,
                where_seen(model, stability, mode, &o),
            )
        }
        Seen::Quiet | Seen::NotTried => {
            let motion = if turns(mode.worst.ring_hz) {
                format!("swing at {}", frequency(mode.worst.ring_hz))
            } else {
                "run away".to_string()
            };
            let hand = held_by(model, stability, mode.worst.hand);
            let message =
                format!("the {what} `{name}` is not proven stable: it may {motion} {hand}");
            let simulated = if seen == Seen::Quiet {
                "with friction, no push that was tried makes the simulated loop swing for long"
            } else {
                "it was not simulated to the end, as that takes too long"
            };
            (Code::NotProvenStable, message, simulated.to_string())
        }
    };
    let mut diagnostic = Diagnostic::new(code, term.span, message, label).hint(hint);
    for hint in advice(model, stability, (blame, most), search) {
        diagnostic = diagnostic.hint(hint);
    }
    if mode.name != "everywhere" {
        diagnostic = diagnostic.hint(format!("this is where {}", mode.name));
    }
    explained(code, diagnostic)
}

/// With what ringing is, where something rings.
fn explained(code: Code, diagnostic: Diagnostic) -> Diagnostic {
    match code {
        Code::Unstable => diagnostic.hint(
            "to ring is to swing to and fro without being moved, felt or heard as a hum: \
             the force comes a little after the motion that it answers (docs/stability.md)",
        ),
        _ => diagnostic,
    }
}

/// What would make it stable.
fn advice(
    model: &Model,
    stability: &Stability,
    (blame, most): (&Blame, Coefficient),
    search: &Search,
) -> Vec<String> {
    let mut hints = Vec::new();
    let part = search.part(blame.force, most.kind, &blame.modes);
    match part {
        Looked::Found(part) | Looked::Partly(part) if part < PART_LEAST => {
            hints.push("no part of it is proven stable".to_string());
        }
        Looked::Found(part) => hints.push(format!(
            "up to {} is stable with every hand",
            shown(rounded_down(most.value * part), most.dim)
        )),
        Looked::Partly(part) => hints.push(format!(
            "up to {} it rings in no hand by itself, but what is left without it does",
            shown(rounded_down(most.value * part), most.dim)
        )),
        Looked::Never => {
            hints.push(format!(
                "no {} of this term alone is stable with all the rest",
                KINDS[most.kind]
            ));
        }
        Looked::Unknown => {}
    }
    let sense = model.senses.first();
    let x = sense.map_or("x", |s| s.name.as_str());
    let window_s = sense.map_or(0.0, |s| f64::from(s.window) / stability.rate_hz);
    match search.damping(&blame.modes) {
        Looked::Found(damping) => hints.push(format!(
            "or add damping: `{} * {x}'`, with {x}' over {} as here, is the least that is stable with every hand",
            shown(damping, stiffness(model).mul(Dim::TIME)),
            shown(rounded(window_s), Dim::TIME)
        )),
        Looked::Never | Looked::Partly(_) => hints.push(format!(
            "no damping added by {x}' over {} makes it stable",
            shown(rounded(window_s), Dim::TIME)
        )),
        Looked::Unknown => {}
    }
    if let (Some(ticks), Some(sense)) = (search.shorter_window(&blame.modes), sense) {
        hints.push(format!(
            "or let `{}` be sensed over {}: what comes less late is stable as it is",
            sense.name,
            shown(rounded(f64::from(ticks) / stability.rate_hz), Dim::TIME)
        ));
    }
    hints
}

fn where_seen(model: &Model, stability: &Stability, mode: &Mode, o: &Oscillation) -> String {
    let at = shown(rounded(o.x), travel(model));
    let force = shown(rounded(o.force), force_dim(model));
    let mut how = if o.speed != 0.0 {
        let speed = shown(rounded(o.speed), travel(model).div(Dim::TIME));
        format!("so the simulated loop does, led past {at} with {speed}")
    } else {
        let push = shown(rounded(o.push), travel(model).div(Dim::TIME));
        let under = if o.force.abs() < 1e-3 * stability.key.friction {
            String::new()
        } else {
            format!(" under a steady {force}")
        };
        format!("so the simulated loop does, at {at}{under}, after a push to {push}")
    };
    let lives = mode
        .places
        .get(o.place)
        .map_or(&[][..], |place| &place.lives);
    for (live, value) in model.lives.iter().zip(lives) {
        if *value != live.value
            && let Some(dim) = live.dim
        {
            how += &format!(", with `{}` at {}", live.name, shown(*value, dim));
        }
    }
    how
}

/// Of a body that does not come to rest while the key stands still.
fn restless(
    model: &Model,
    stability: &Stability,
    see: &mut dyn FnMut(&Trial) -> Seen,
) -> Option<Diagnostic> {
    let mode = stability.modes.iter().find(|m| !m.settles)?;
    let seen = see(&Trial {
        places: &mode.places,
        hands: vec![PerHand {
            hand: Hand::FREE,
            ..mode.worst
        }],
        falls_with_speed: false,
    });
    let (code, message) = match seen {
        Seen::Rings(o) => (
            Code::Unstable,
            format!(
                "a body of `{}` makes the {} ring, at {} by {}",
                model.name,
                moved(model, stability),
                frequency(o.hz),
                shown(rounded(o.amplitude), travel(model))
            ),
        ),
        _ => (
            Code::NotProvenStable,
            format!(
                "what moves in `{}` is not proven to come to rest while the key stands still",
                model.name
            ),
        ),
    };
    let label = format!("where {}", mode.name);
    let hint = "either it falls over, or its springs and dampers are too stiff for its inertia at this rate";
    let diagnostic = Diagnostic::new(code, model.span, message, label).hint(hint);
    Some(explained(code, diagnostic))
}

/// What the loop is closed around.
fn moved(model: &Model, stability: &Stability) -> String {
    match &stability.port {
        Some(port) => format!("port `{port}`"),
        None if model.turns() => "knob".to_string(),
        None => "key".to_string(),
    }
}

/// Three digits.
fn frequency(hz: f64) -> String {
    format!("{} Hz", rounded(hz))
}

/// What the first sense measures.
fn travel(model: &Model) -> Dim {
    model.senses.first().map_or(Dim::LENGTH, |s| s.dim)
}

/// What of a term counts most where it rings.
#[derive(Clone, Copy)]
struct Coefficient {
    /// An index into [`KINDS`].
    kind: usize,
    value: f64,
    dim: Dim,
}

/// What a force may be in proportion to: the way, the speed, the acceleration.
const KINDS: [&str; 3] = ["stiffness", "damping", "added mass"];

fn coefficient(model: &Model, mode: &Mode, force: usize) -> Coefficient {
    let w = (std::f64::consts::TAU * mode.worst.ring_hz).hypot(mode.worst.growth_per_s);
    let direct = &mode.system.outputs[force].direct;
    let sum = |part: usize| direct.iter().skip(part).step_by(3).sum::<f64>();
    let weight = |part: usize| sum(part).abs() * w.powi(part as i32);
    let kind = (0..3)
        .max_by(|a, b| weight(*a).total_cmp(&weight(*b)))
        .unwrap_or(0);
    Coefficient {
        kind,
        value: sum(kind),
        dim: (0..kind).fold(stiffness(model), |dim, _| dim.mul(Dim::TIME)),
    }
}

fn held_by(model: &Model, stability: &Stability, hand: Hand) -> String {
    if hand == Hand::FREE {
        return format!(
            "when nobody holds the {} of {}",
            moved(model, stability),
            shown(stability.key.mass, mass(model))
        );
    }
    let stiffness = stiffness(model);
    let damping = stiffness.mul(Dim::TIME);
    format!(
        "in a hand of {}, {}, {}",
        shown(hand.mass, mass(model)),
        shown(hand.damping, damping),
        shown(hand.stiffness, stiffness)
    )
}

fn mass(model: &Model) -> Dim {
    if model.turns() {
        Dim::INERTIA
    } else {
        Dim::MASS
    }
}

fn stiffness(model: &Model) -> Dim {
    if model.turns() {
        Dim::TORQUE
    } else {
        Dim::FORCE.div(Dim::LENGTH)
    }
}

fn force_dim(model: &Model) -> Dim {
    if model.turns() {
        Dim::TORQUE
    } else {
        Dim::FORCE
    }
}
