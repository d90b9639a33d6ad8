//! What all panels share: sizes, colours, units, grids, legends.

use super::axis::Axis;
use super::drawing::{Anchor, Colour, Drawing};
use super::font;

/// Width of the page.
pub const WIDTH: f64 = 1000.0;
/// Left edge of the data.
pub const LEFT: f64 = 58.0;
/// Right edge of the data; legends stand beyond it.
pub const RIGHT: f64 = 812.0;
/// Left edge of legends.
pub const LEGEND: f64 = 828.0;
/// Distance of lines in a legend.
pub const LEADING: f64 = 16.0;
/// Height of ordinary text.
pub const TEXT: f64 = 11.0;
/// Height of the headings of panels.
pub const HEADING: f64 = 12.0;

/// Headings and the total.
pub const BLACK: Colour = 0x22_22_22;
/// Ordinary text.
pub const DARK: Colour = 0x44_44_44;
/// Things of less weight.
pub const GREY: Colour = 0x99_99_99;
/// Lines behind the data.
pub const GRID: Colour = 0xe6_e6_e6;

/// The level of zero.
pub const ZERO: Colour = 0xb8_b8_b8;
/// Marks through the panels.
pub const MARK: Colour = 0xbb_bb_bb;

/// Lines: Paul Tol's "muted" scheme, ordered so that neighbours differ most.
const LINES: [Colour; 9] = [
    0x33_22_88, 0xcc_66_77, 0x11_77_33, 0x88_cc_ee, 0x88_22_55, 0xdd_cc_77, 0x44_aa_99, 0xaa_44_99,
    0x99_99_33,
];

/// Bands: grey for the first state, then Paul Tol's "light" scheme.
const BANDS: [Colour; 8] = [
    0xe9_e9_e9, 0x77_aa_dd, 0xee_88_66, 0xee_dd_88, 0x44_bb_99, 0xff_aa_bb, 0xbb_cc_33, 0x99_dd_ff,
];

/// The colour of the `i`-th line.
pub fn line_colour(i: usize) -> Colour {
    LINES[i % LINES.len()]
}

/// The colour of the `i`-th state of a machine.
pub fn band_colour(i: usize) -> Colour {
    if i == 0 {
        BANDS[0]
    } else {
        BANDS[1 + (i - 1) % (BANDS.len() - 1)]
    }
}

/// The unit a quantity is shown in, and the factor from SI.
pub fn shown(unit: &str) -> (String, f64) {
    match unit {
        "m" => ("mm".into(), 1e3),
        "n" => ("N".into(), 1.0),
        "n_m" => ("mN·m".into(), 1e3),
        _ => match unit.strip_prefix("per_") {
            Some(below) => (format!("1/{}", below.replace('_', "·")), 1.0),
            None => (unit.replace("_per_", "/").replace('_', "·"), 1.0),
        },
    }
}

/// What the player moves, a key or the port that has a name: what it is called, and the unit and
/// factor it is shown in. Who turns a knob thinks in degrees.
pub fn moved(port: Option<&str>, unit: &str) -> (String, String, f64) {
    let degrees = 180.0 / std::f64::consts::PI;
    match (unit, port) {
        ("rad", None) => ("angle".into(), "deg".into(), degrees),
        ("rad", Some(port)) => (format!("angle of {port}"), "deg".into(), degrees),
        (_, None) => ("key travel".into(), shown(unit).0, shown(unit).1),
        ("m", Some(port)) => (format!("position of {port}"), shown(unit).0, shown(unit).1),
        (_, Some(port)) => (port.to_string(), shown(unit).0, shown(unit).1),
    }
}

/// What the player feels there, by its unit.
pub fn felt(port: Option<&str>, unit: &str) -> String {
    match (unit, port) {
        ("n_m", None) => "torque".into(),
        (_, None) => "force at the key".into(),
        ("n_m", Some(port)) => format!("torque on {port}"),
        (_, Some(port)) => format!("force on {port}"),
    }
}

/// A heading with a unit: `force (N)`.
pub fn heading(name: &str, unit: &str) -> String {
    if unit.is_empty() {
        name.to_string()
    } else {
        format!("{name} ({unit})")
    }
}

/// Level lines with labels at the ticks of the ordinate, and the heading above.
pub fn level_grid(page: &mut Drawing, y: &Axis, top: f64, heading: String) {
    page.text((LEFT, top - 7.0), Anchor::Start, HEADING, BLACK, heading);
    for (at, label) in y.ticks(30.0) {
        let colour = if at == y.place(0.0) { ZERO } else { GRID };
        page.line(vec![(LEFT, at), (RIGHT, at)], colour, 0.8);
        page.text((LEFT - 7.0, at + 3.8), Anchor::End, TEXT, DARK, label);
    }
}

/// Upright lines at the ticks of the abscissa.
pub fn upright_grid(page: &mut Drawing, x: &Axis, top: f64, bottom: f64) {
    for (at, _) in x.ticks(80.0) {
        page.line(vec![(at, top), (at, bottom)], GRID, 0.8);
    }
}

/// Labels at the ticks of the abscissa below `bottom`, and the name of the axis at their right.
pub fn abscissa(page: &mut Drawing, x: &Axis, bottom: f64, name: String) {
    page.line(vec![(LEFT, bottom), (RIGHT, bottom)], GREY, 0.8);
    for (at, label) in x.ticks(80.0) {
        page.line(vec![(at, bottom), (at, bottom + 4.0)], GREY, 0.8);
        page.text((at, bottom + 16.0), Anchor::Middle, TEXT, DARK, label);
    }
    page.text((LEGEND, bottom + 16.0), Anchor::Start, TEXT, BLACK, name);
}

/// One line of a legend: a sample of the line and its name. Without a colour it stands for a line
/// that is not drawn.
pub fn legend(page: &mut Drawing, y: f64, name: &str, colour: Option<Colour>, width: f64) {
    if let Some(colour) = colour {
        page.line(vec![(LEGEND, y), (LEGEND + 16.0, y)], colour, width);
    }
    let ink = if colour.is_some() { DARK } else { GREY };
    let name = shortened(name, WIDTH - LEGEND - 28.0);
    page.text((LEGEND + 22.0, y + 3.8), Anchor::Start, TEXT, ink, name);
}

/// A text that is not wider than `width`.
pub fn shortened(text: &str, width: f64) -> String {
    if font::width(text, TEXT) <= width {
        return text.to_string();
    }
    let mut short = text.to_string();
    while !short.is_empty() && font::width(&short, TEXT) + font::width("…", TEXT) > width {
        short.pop();
    }
    short + "…"
}
