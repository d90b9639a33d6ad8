//! What a page draws of what moves: strings, masses, plucked strings, and the tool that plays them.
//!
//! ```text
//!   { kind, tool, pad, touch, force, lean, strings, masses, plucked }
//! ```
//!
//! What moves is found in any program, by the cells that the module has anyway. Where strings lie
//! and how a pointer holds the tool is a line of the table below for the bundled instruments, as
//! the windows of Onofrei, Fontana, Serafin 2023 have it (figures 7 and 10); other programs get
//! strings side by side.
//!
//! Not here: reading the cells (`playable/moving.js`), drawing (`playable/window.js`).

use serde_json::{Value, json};
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::units::Dim;

/// The most strings or masses of a picture, which bounds what the audio thread sends.
const MOVING_MAX: usize = 64;

/// Where the words of a force or of a touch are found.
#[derive(Debug, Clone, Copy)]
enum ToolSource {
    Drive(usize),
    Port(usize),
    Live(usize),
}

impl ToolSource {
    fn json(self) -> Value {
        match self {
            ToolSource::Drive(at) => json!({ "drive": at }),
            ToolSource::Port(at) => json!({ "port": at }),
            ToolSource::Live(at) => json!({ "live": at }),
        }
    }
}

/// How the tool is put down.
#[derive(Debug, Clone, Copy)]
struct ToolTouch {
    /// What a pointer moves by being down.
    moves: ToolSource,
    /// Where it is while no pointer is down (SI).
    up: f64,
    /// Where it is at first while one is (SI).
    down: f64,
    /// The least and the most, from the lightest touch to the hardest.
    levels: [f64; 2],
}

/// The window of an instrument.
#[derive(Debug, Clone, Copy)]
struct WindowLayout {
    instrument: &'static str,
    tool: &'static str,
    /// The ports of the pad, to the right and upwards.
    pad: [usize; 2],
    /// Whether strings run upwards.
    upright: bool,
    /// The ports of a view from the front, if there is one.
    front: Option<[usize; 2]>,
    touch: ToolTouch,
    /// The force by which the tool is coloured.
    force: ToolSource,
    /// The port by which a bow leans, and half its length (m).
    bow: Option<(usize, f64)>,
    /// Where each string or mass rests: in the pad's ports, and in those of the front view.
    places: fn(usize) -> [f64; 2],
}

const VIOLIN: [[f64; 2]; 4] = [
    [-0.075, -0.010],
    [-0.025, 0.025],
    [0.025, 0.025],
    [0.075, -0.010],
];

const LAYOUTS: [WindowLayout; 5] = [
    WindowLayout {
        instrument: "bowed_violin",
        tool: "bow",
        pad: [0, 2],
        upright: true,
        front: Some([0, 1]),
        touch: ToolTouch {
            moves: ToolSource::Port(1),
            up: 0.045,
            down: 0.02,
            levels: [0.0245, -0.02],
        },
        force: ToolSource::Drive(1),
        bow: Some((3, 0.225)),
        places: |at| VIOLIN[at.min(3)],
    },
    WindowLayout {
        instrument: "rubbed_bank",
        tool: "stick",
        pad: [0, 2],
        upright: true,
        front: None,
        touch: ToolTouch {
            moves: ToolSource::Port(1),
            up: 0.01,
            down: -0.004,
            levels: [-0.0005, -0.015],
        },
        force: ToolSource::Drive(1),
        bow: None,
        places: |at| [0.0, 0.007 * at as f64 - 0.035],
    },
    WindowLayout {
        instrument: "rubbed_mouse",
        tool: "stick",
        pad: [0, 1],
        upright: true,
        front: None,
        touch: ToolTouch {
            moves: ToolSource::Live(0),
            up: 0.0,
            down: 30.0,
            levels: [1.0, 1000.0],
        },
        force: ToolSource::Live(0),
        bow: None,
        places: |at| [0.5, 0.1 * at as f64],
    },
    WindowLayout {
        instrument: "rubbed_pad",
        tool: "stick",
        pad: [0, 1],
        upright: true,
        front: None,
        touch: ToolTouch {
            moves: ToolSource::Port(2),
            up: 0.0,
            down: 2.0,
            levels: [0.1, 20.0],
        },
        force: ToolSource::Port(2),
        bow: None,
        places: |at| [0.12, 0.014 * at as f64],
    },
    WindowLayout {
        instrument: "keytar",
        tool: "plectrum",
        pad: [0, 1],
        upright: false,
        front: None,
        touch: ToolTouch {
            moves: ToolSource::Port(2),
            up: 0.01,
            down: -0.003,
            levels: [-0.001, -0.015],
        },
        force: ToolSource::Drive(1),
        bow: None,
        places: |at| [0.0, 0.010 * at as f64 - 0.025],
    },
];

/// Whether there is a window, and whether it has a view from the front.
pub fn has(compiled: &Compiled) -> [bool; 2] {
    let window = window(compiled);
    let has_front = window.as_ref().is_some_and(|of| !of["front"].is_null());
    [window.is_some(), has_front]
}

/// Whether a pointer puts a tool down.
pub fn touch(compiled: &Compiled) -> bool {
    window(compiled).is_some_and(|of| !of["touch"].is_null())
}

/// What is to be drawn of a program; none where nothing moves and nothing is known of it.
pub fn window(compiled: &Compiled) -> Option<Value> {
    if compiled.model.is_of_key() {
        return None;
    }
    let layout = LAYOUTS
        .iter()
        .find(|layout| layout.instrument == compiled.model.name);
    let (strings, masses, plucked) = (strings(compiled), masses(compiled), plucked(compiled));
    let moving = [strings.len(), masses.len(), plucked.len()];
    let count = moving.into_iter().max().unwrap_or(0);
    if count == 0 {
        return None;
    }
    let places = layout.map(|layout| (0..count).map(layout.places).collect::<Vec<_>>());
    let is_right = layout.is_none_or(|layout| {
        let ports = compiled.model.senses.len();
        layout.pad.iter().all(|port| *port < ports)
    });
    let layout = layout.filter(|_| is_right);
    Some(json!({
        "strings": strings,
        "masses": masses,
        "plucked": plucked,
        "places": places,
        "tool": layout.map(|of| of.tool),
        "pad": layout.map(|of| of.pad),
        "upright": layout.is_none_or(|of| of.upright),
        "front": layout.and_then(|of| of.front),
        "touch": layout.map(|of| json!({
            "moves": of.touch.moves.json(), "up": of.touch.up, "down": of.touch.down,
            "levels": of.touch.levels,
        })),
        "force": layout.map(|of| of.force.json()),
        "bow": layout.and_then(|of| of.bow),
    }))
}

/// Strings of points: the cell of their slopes, and what a word of it is.
fn strings(compiled: &Compiled) -> Vec<Value> {
    let lowered = compiled.lowered.strands.iter().take(MOVING_MAX);
    let one = lowered.map(|one| {
        let strand = &compiled.model.strands[one.strand];
        json!({
            "name": strand.name, "cell": one.cells[0], "unit": 0.5 * one.lsb,
            "length": strand.length(),
        })
    });
    one.collect()
}

/// The cell of that name: its number, and what its word means.
fn cell(compiled: &Compiled, name: &str) -> Option<Value> {
    let at = compiled.lowered.kernel.cells.iter();
    let at = at.clone().position(|cell| cell.name == name)?;
    let of = compiled.lowered.memory.iter().find(|of| of.name == name)?;
    Some(json!({ "name": name, "cell": at, "lsb": of.lsb, "zero": of.zero }))
}

/// Masses of a bank: coordinates that are lengths and have rates.
fn masses(compiled: &Compiled) -> Vec<Value> {
    let kernel = &compiled.lowered.kernel;
    let has = |name: &str| kernel.cells.iter().any(|cell| cell.name == name);
    let memory = compiled.lowered.memory.iter();
    let moving = memory.filter(|of| {
        of.dim == Dim::LENGTH && of.name.contains('[') && has(&format!("{}'", of.name))
    });
    let all = moving.filter_map(|of| cell(compiled, &of.name));
    all.take(MOVING_MAX).collect()
}

/// Strings that are loops of delay: how far they are bent, and what leaves the loop.
fn plucked(compiled: &Compiled) -> Vec<Value> {
    let of = |at: usize| {
        let bent = cell(compiled, &format!("strings[{at}].string.bent"))?;
        let voice = cell(compiled, &format!("strings[{at}].voice.before"))?;
        Some(json!({ "name": format!("strings[{at}]"), "bent": bent, "voice": voice }))
    };
    (0..MOVING_MAX).map_while(of).collect()
}

#[cfg(test)]
mod tests {
    use super::LAYOUTS;

    #[test]
    fn a_touch_begins_between_its_ends() {
        for layout in LAYOUTS {
            let [light, hard] = layout.touch.levels;
            let down = layout.touch.down;
            assert!(
                (light - down) * (hard - down) <= 0.0,
                "{}",
                layout.instrument
            );
        }
    }
}
