//! A heat map: a value over two quantities, as cells of a grid or as points, in colours.

use std::path::Path;

use super::axis::Axis;
use super::drawing::{Anchor, Colour, Drawing, Point};
use super::frame::{
    BLACK, DARK, GREY, LEADING, LEFT, LEGEND, RIGHT, TEXT, WIDTH, abscissa, legend, level_grid,
    shortened, upright_grid,
};
use super::{Curve, save_drawing};
use crate::files::FileError;

/// Height of the field.
const HEIGHT: f64 = 400.0;
/// Top of the field.
const TOP: f64 = 66.0;
/// Half the side of a point.
const POINT: f64 = 5.0;
/// Lines over the field.
const INKS: [Colour; 3] = [0x22_22_88, 0x11_77_33, 0x88_22_55];
/// Steps of the scale.
const STEPS: usize = 64;

/// From low to high: Paul Tol's "YlOrBr" scheme.
const COLOURS: [Colour; 9] = [
    0xff_ff_e5, 0xff_f7_bc, 0xfe_e3_91, 0xfe_c4_4f, 0xfb_9a_29, 0xec_70_14, 0xcc_4c_02, 0x99_34_04,
    0x66_25_06,
];

/// What to draw.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HeatMap {
    /// Heading.
    pub title: String,
    /// Name and unit of what grows to the right.
    pub abscissa: String,
    /// Name and unit of what grows upwards.
    pub ordinate: String,
    /// Name and unit of the value.
    pub value: String,
    /// How many places of a grid there are to the right and upwards; points by themselves if none.
    pub grid: Option<(usize, usize)>,
    /// Places and values; one that is not there is left white.
    pub points: Vec<(f64, f64, Option<f64>)>,
    /// Lines over it.
    pub lines: Vec<Curve>,
}

impl HeatMap {
    /// Writes it to a file whose name ends in `.svg` or `.png`.
    ///
    /// # Errors
    /// The name ends otherwise, or the file cannot be written.
    pub fn save(&self, path: &Path) -> Result<(), FileError> {
        save_drawing(&self.draw(), path)
    }

    fn draw(&self) -> Drawing {
        let bottom = TOP + HEIGHT;
        let mut page = Drawing {
            width: WIDTH,
            height: bottom + 40.0,
            ..Drawing::default()
        };
        let title = self.title.as_str();
        page.text((LEFT, 24.0), Anchor::Start, 15.0, BLACK, title);
        let cells = self.grid.unwrap_or((0, 0));
        let x = axis(self.points.iter().map(|p| p.0), cells.0, (LEFT, RIGHT));
        let y = axis(self.points.iter().map(|p| p.1), cells.1, (bottom, TOP));
        let half = match self.grid {
            Some((across, up)) => (
                0.5 * (RIGHT - LEFT) / across as f64,
                0.5 * HEIGHT / up as f64,
            ),
            None => (POINT, POINT),
        };
        let values = || self.points.iter().filter_map(|p| p.2);
        let low = values().fold(f64::INFINITY, f64::min);
        let high = values().fold(f64::NEG_INFINITY, f64::max);
        let cell = |page: &mut Drawing| {
            for (right, up, value) in &self.points {
                let Some(value) = value else { continue };
                let (at_x, at_y) = (x.place(*right), y.place(*up));
                let corner = (at_x - half.0, at_y - half.1);
                let other = (at_x + half.0, at_y + half.1);
                page.rect(corner, other, colour(part(*value, low, high)));
            }
        };
        // Cells hide the grid, points stand on it.
        if self.grid.is_some() {
            cell(&mut page);
        }
        upright_grid(&mut page, &x, TOP, bottom);
        level_grid(&mut page, &y, TOP, self.ordinate.clone());
        if self.grid.is_none() {
            cell(&mut page);
        }
        self.curves(&mut page, (&x, &y), bottom);
        abscissa(&mut page, &x, bottom, self.abscissa.clone());
        if low <= high {
            self.scale(&mut page, (low, high));
        }
        page
    }

    /// The lines, as far as they are in the field, and their names below the scale.
    fn curves(&self, page: &mut Drawing, (x, y): (&Axis, &Axis), bottom: f64) {
        for (row, curve) in self.lines.iter().enumerate() {
            let ink = INKS[row % INKS.len()];
            let place = |(right, up): &(f64, f64)| (x.place(*right), y.place(*up));
            let places: Vec<_> = curve.points.iter().map(place).collect();
            for pair in places.windows(2) {
                if let Some((from, to)) = within(pair[0], pair[1], (TOP, bottom)) {
                    page.line(vec![from, to], 0xff_ff_ff, 3.6);
                    page.line(vec![from, to], ink, 2.0);
                }
            }
            legend(
                page,
                TOP + 240.0 + row as f64 * LEADING,
                &curve.name,
                Some(ink),
                2.0,
            );
        }
    }

    /// The colours with their values, at the right.
    fn scale(&self, page: &mut Drawing, (low, high): (f64, f64)) {
        let name = shortened(&self.value, WIDTH - LEGEND);
        page.text((LEGEND, TOP - 7.0), Anchor::Start, TEXT, BLACK, name);
        let (top, height) = (TOP + 4.0, 200.0);
        for step in 0..STEPS {
            let part = |step: usize| step as f64 / STEPS as f64;
            let upper = top + height * (1.0 - part(step + 1));
            let lower = top + height * (1.0 - part(step));
            let shade = colour((step as f64 + 0.5) / STEPS as f64);
            page.rect((LEGEND, upper), (LEGEND + 16.0, lower), shade);
        }
        let axis = Axis::exact(low, high, top + height, top);
        for (at, label) in axis.ticks(40.0) {
            page.line(vec![(LEGEND + 16.0, at), (LEGEND + 20.0, at)], GREY, 0.8);
            page.text((LEGEND + 24.0, at + 3.8), Anchor::Start, TEXT, DARK, label);
        }
    }
}

/// The part of a line between two heights.
fn within(a: Point, b: Point, (top, bottom): (f64, f64)) -> Option<(Point, Point)> {
    let at = |y: f64| (a.0 + (b.0 - a.0) * (y - a.1) / (b.1 - a.1), y);
    let end = |p: Point| match p.1 {
        y if y < top => at(top),
        y if y > bottom => at(bottom),
        _ => p,
    };
    let is_beyond = a.1.max(b.1) < top || a.1.min(b.1) > bottom;
    (!is_beyond).then(|| (end(a), end(b)))
}

/// An axis around places; of a grid with half a cell beyond them.
fn axis(places: impl Iterator<Item = f64> + Clone, count: usize, page: (f64, f64)) -> Axis {
    let low = places.clone().fold(f64::INFINITY, f64::min);
    let high = places.fold(f64::NEG_INFINITY, f64::max);
    let room = match count {
        0 | 1 => 0.03 * (high - low),
        count => 0.5 * (high - low) / (count - 1) as f64,
    };
    if low <= high {
        Axis::exact(low - room, high + room, page.0, page.1)
    } else {
        Axis::exact(0.0, 1.0, page.0, page.1)
    }
}

/// How far a value is from the lowest to the highest; half way where all are the same.
fn part(value: f64, low: f64, high: f64) -> f64 {
    if high > low {
        (value - low) / (high - low)
    } else {
        0.5
    }
}

/// The colour at a part of the scale.
fn colour(part: f64) -> Colour {
    let place = part.clamp(0.0, 1.0) * (COLOURS.len() - 1) as f64;
    let below = (place as usize).min(COLOURS.len() - 2);
    let share = place - below as f64;
    let channel = |shift: u32| {
        let of = |colour: Colour| f64::from(colour >> shift & 0xff);
        let mixed = of(COLOURS[below]) * (1.0 - share) + of(COLOURS[below + 1]) * share;
        (mixed.round() as Colour) << shift
    };
    channel(16) | channel(8) | channel(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_go_from_end_to_end() {
        assert_eq!(colour(0.0), COLOURS[0]);
        assert_eq!(colour(1.0), COLOURS[8]);
        assert_eq!(colour(0.5), COLOURS[4]);
        assert_eq!(part(3.0, 3.0, 3.0), 0.5);
    }

    #[test]
    fn cells_of_a_grid_touch_and_what_is_not_there_is_white() {
        let point = |i: usize| {
            (
                f64::from(i as u8 % 2),
                f64::from(i as u8 / 2),
                Some(i as f64),
            )
        };
        let mut map = HeatMap {
            grid: Some((2, 2)),
            points: (0..4).map(point).collect(),
            ..HeatMap::default()
        };
        let filled = |map: &HeatMap| {
            let shapes = map.draw().shapes;
            let is_area = |s: &&super::super::drawing::Shape| {
                matches!(s, super::super::drawing::Shape::Area { .. })
            };
            shapes.iter().filter(is_area).count() - STEPS
        };
        assert_eq!(filled(&map), 4);
        map.points[2].2 = None;
        assert_eq!(filled(&map), 3);
        map.points.clear();
        assert!(!map.draw().shapes.is_empty());
    }
}
