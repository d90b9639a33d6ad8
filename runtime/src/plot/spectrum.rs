//! A panel of what a sound is made of: frequency upwards in octaves, level as colour.

use super::axis::Axis;
use super::drawing::{Anchor, Colour, Drawing};
use super::frame::{BLACK, DARK, GREY, HEADING, LEADING, LEFT, LEGEND, RIGHT, TEXT, heading};
use super::time::Clock;
use crate::spectrogram::Spectrogram;

/// Levels from the loudest down to what is white (dB).
const REACH_DB: f64 = 80.0;
/// Loudest level below which nothing is shown (dB): what 24 bits hold.
const QUIETEST_DB: f64 = -60.0;
/// From the quietest to the loudest: even steps of lightness that print well without colours.
const COLOURS: [Colour; 5] = [0xff_ff_ff, 0xc5_dd_ef, 0x5b_8f_c9, 0x33_22_88, 0x12_06_2e];
/// Frequencies with a label (Hz).
const LABELLED_HZ: [u32; 9] = [50, 100, 200, 500, 1000, 2000, 5000, 10_000, 20_000];

/// Draws the panel; `place` is its upper edge and height.
pub fn draw(page: &mut Drawing, clock: &Clock, (top, height): (f64, f64), of: &Spectrogram) {
    let bottom = top + height;
    let bands = of.bands_hz();
    let title = heading(&format!("{}: spectrum", of.name), "Hz");
    page.text((LEFT, top - 7.0), Anchor::Start, HEADING, BLACK, title);
    let levels = |column| (0..bands.len()).map(move |band| of.level_db(column, band));
    let loudest = (0..of.columns())
        .flat_map(levels)
        .fold(f64::NEG_INFINITY, f64::max);
    // White is at a round level, and silence is white.
    let loudest = (10.0 * (loudest / 10.0).ceil()).max(QUIETEST_DB);
    let shade = |db: f64| colour((db - loudest) / REACH_DB + 1.0);
    if of.columns() > 0 && !bands.is_empty() {
        let rows = (0..bands.len()).rev();
        let pixel = |band| (0..of.columns()).map(move |column| of.level_db(column, band));
        let pixels = rows.flat_map(pixel).map(shade).collect();
        let end = clock.place(of.columns() * of.column_ticks());
        page.image((LEFT, top), (end - LEFT, height), pixels, of.columns());
        // The last column reaches beyond the last tick.
        page.rect((RIGHT, top), (RIGHT.max(end), bottom), 0xff_ff_ff);
    }
    let octaves = |hz: f64| hz.log2();
    let half = 0.5 / 12.0;
    let ends = bands.first().zip(bands.last());
    let (low, high) = ends.map_or((0.0, 1.0), |(low, high)| (octaves(*low), octaves(*high)));
    let axis = Axis::exact(low - half, high + half, bottom, top);
    for hz in LABELLED_HZ {
        let at = axis.place(octaves(f64::from(hz)));
        if (top..=bottom).contains(&at) {
            page.line(vec![(LEFT - 4.0, at), (LEFT, at)], GREY, 0.8);
            page.text(
                (LEFT - 7.0, at + 3.8),
                Anchor::End,
                TEXT,
                DARK,
                hz.to_string(),
            );
        }
    }
    for step in 0..5 {
        let db = loudest - f64::from(step) * 0.25 * REACH_DB;
        let row = top + 6.0 + f64::from(step) * LEADING;
        page.rect((LEGEND, row - 5.0), (LEGEND + 16.0, row + 5.0), shade(db));
        let label = format!("{:.0} dB", db + 0.0).replace('-', "\u{2212}");
        page.text((LEGEND + 22.0, row + 3.8), Anchor::Start, TEXT, DARK, label);
    }
    page.line(vec![(LEFT, top), (LEFT, bottom)], GREY, 0.8);
}

/// The colour of a part of the scale, 0 for white.
fn colour(part: f64) -> Colour {
    let last = COLOURS.len() - 1;
    let place = part.clamp(0.0, 1.0) * last as f64;
    let below = (place as usize).min(last - 1);
    let between = place - below as f64;
    let [low, high] = [COLOURS[below], COLOURS[below + 1]].map(u32::to_be_bytes);
    let mixed = |n: usize| {
        let (low, high) = (f64::from(low[n]), f64::from(high[n]));
        (low + between * (high - low)).round() as u8
    };
    u32::from_be_bytes([0, mixed(1), mixed(2), mixed(3)])
}
