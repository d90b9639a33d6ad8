//! A panel of how a string vibrates: time to the right, places upwards, displacement as colour, in
//! the window in which it moved most; what rubs it, where and whether it sticks.

use whippen_compiler::units::{Dim, shown as quantity};

use super::axis::Axis;
use super::drawing::{Anchor, Colour, Drawing};
use super::frame::{
    BLACK, DARK, GREY, LEADING, LEFT, LEGEND, RIGHT, TEXT, abscissa, level_grid, upright_grid,
};
use crate::sticking::Sticking;
use crate::vibration::{Shapes, Vibration};

/// From one way to the other: Paul Tol's "sunset" scheme, white where the string rests.
const COLOURS: [Colour; 7] = [
    0x36_4b_9a, 0x6e_a6_cd, 0xc2_e4_ef, 0xff_ff_ff, 0xfe_da_8b, 0xf6_7e_4b, 0xa5_00_26,
];
/// What sticks, and what slips.
const STICKS: Colour = 0x22_22_22;
const SLIPS: Colour = 0x22_aa_44;
/// Levels of the scale.
const LEVELS: [f64; 5] = [1.0, 0.5, 0.0, -0.5, -1.0];

/// Height of the panel.
pub const HEIGHT: f64 = 170.0;

/// Draws the panel with its own axis of time, from `top` on; when each tick is, by its number.
pub fn draw(
    page: &mut Drawing,
    top: f64,
    (of, window): (&Vibration, &Shapes),
    time_s: impl Fn(usize) -> f64,
) {
    let bottom = top + HEIGHT;
    let shapes = &window.shapes;
    let tick_s = time_s(1) - time_s(0);
    let lasts_s = (shapes.len() * of.every) as f64 * tick_s;
    let x = Axis::exact(0.0, lasts_s, LEFT, RIGHT).in_units(1e3);
    let y = Axis::exact(of.along_m[0], of.along_m[1], bottom, top).in_units(1e3);
    let most = f64::from(window.greatest());
    let shade = |u: f32| colour(f64::from(u) / most);
    upright_grid(page, &x, top, bottom);
    let begins_s = time_s(window.first);
    let title = format!("{} (mm), moving, from {begins_s:.4} s on", of.name);
    level_grid(page, &y, top, title);
    let places = shapes.first().map_or(0, Vec::len);
    let rows = (0..places).rev();
    let pixels = rows.flat_map(|place| shapes.iter().map(move |shape| shape[place]));
    let pixels: Vec<Colour> = pixels.map(shade).collect();
    page.image((LEFT, top), (RIGHT - LEFT, HEIGHT), pixels, shapes.len());
    rubbed(page, (top, bottom), &window.rubbed);
    page.line(vec![(LEFT, top), (LEFT, bottom)], GREY, 0.8);
    abscissa(page, &x, bottom, "since then (ms)".into());
    for (step, level) in LEVELS.into_iter().enumerate() {
        let row = top + 6.0 + step as f64 * LEADING;
        page.rect(
            (LEGEND, row - 5.0),
            (LEGEND + 16.0, row + 5.0),
            colour(level),
        );
        let label = quantity(significant(level * most), Dim::LENGTH).replace('-', "\u{2212}");
        page.text((LEGEND + 22.0, row + 3.8), Anchor::Start, TEXT, DARK, label);
    }
    let does = |state: Sticking| window.rubbed.iter().flatten().any(|(s, _)| *s == state);
    let friction = of.friction.as_deref().unwrap_or_default();
    let states = [
        (Sticking::Sticks, STICKS, "sticks"),
        (Sticking::Slips, SLIPS, "slips"),
    ];
    let shown = states.into_iter().filter(|(state, ..)| does(*state));
    for (row, (_, ink, word)) in shown.enumerate() {
        let row = top + 14.0 + (LEVELS.len() + row) as f64 * LEADING;
        page.rect((LEGEND, row - 1.5), (LEGEND + 16.0, row + 1.5), ink);
        let label = format!("{friction} {word}");
        page.text(
            (LEGEND + 22.0, row + 3.8),
            Anchor::Start,
            TEXT,
            BLACK,
            label,
        );
    }
}

/// Where a friction is, as long as it does the same.
fn rubbed(page: &mut Drawing, (top, bottom): (f64, f64), all: &[Option<(Sticking, f32)>]) {
    let wide = (RIGHT - LEFT) / all.len().max(1) as f64;
    let mut at = 0;
    while at < all.len() {
        let Some((state, place)) = all[at] else {
            at += 1;
            continue;
        };
        let same = |other: &&Option<(Sticking, f32)>| {
            other.is_some_and(|(s, p)| s == state && (p - place).abs() < 0.005)
        };
        let many = all[at..].iter().take_while(same).count();
        let ink = match state {
            Sticking::Free => None,
            Sticking::Sticks => Some(STICKS),
            Sticking::Slips => Some(SLIPS),
        };
        if let Some(ink) = ink {
            let y = bottom - f64::from(place) * (bottom - top);
            let from = LEFT + at as f64 * wide;
            page.rect((from, y - 1.5), (from + many as f64 * wide, y + 1.5), ink);
        }
        at += many.max(1);
    }
}

/// Two digits that count.
fn significant(value: f64) -> f64 {
    format!("{value:.1e}").parse().unwrap_or(value)
}

/// The colour of a part of the greatest displacement, -1 .. 1.
fn colour(part: f64) -> Colour {
    let last = COLOURS.len() - 1;
    let place = 0.5 * (part.clamp(-1.0, 1.0) + 1.0) * last as f64;
    let below = (place as usize).min(last - 1);
    let between = place - below as f64;
    let [low, high] = [COLOURS[below], COLOURS[below + 1]].map(u32::to_be_bytes);
    let mixed = |n: usize| {
        let (low, high) = (f64::from(low[n]), f64::from(high[n]));
        (low + between * (high - low)).round() as u8
    };
    u32::from_be_bytes([0, mixed(1), mixed(2), mixed(3)])
}
