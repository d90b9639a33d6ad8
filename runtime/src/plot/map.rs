//! A map: lines and points over two quantities, with a legend.

use std::path::Path;

use super::axis::Axis;
use super::drawing::{Anchor, Drawing};
use super::frame::{
    BLACK, HEADING, LEFT, RIGHT, WIDTH, abscissa, legend, level_grid, line_colour, upright_grid,
};
use super::{png, save_drawing, svg};
use crate::files::FileError;

/// Height of the field.
const HEIGHT: f64 = 400.0;
/// Top of the field.
const TOP: f64 = 66.0;

/// One line or row of points.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Curve {
    /// Its name in the legend.
    pub name: String,
    /// Its points, from left to right, in the units of the axes.
    pub points: Vec<(f64, f64)>,
    /// Points stand by themselves: dots instead of a line.
    pub dots: bool,
}

/// What to draw.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Map {
    /// Heading.
    pub title: String,
    /// Name and unit of what grows to the right: `virtual damping (N·s/m)`.
    pub abscissa: String,
    /// Name and unit of what grows upwards.
    pub ordinate: String,
    /// Where both axes begin, usually at 0.
    pub starts: (f64, f64),
    /// Where they end.
    pub ends: (f64, f64),
    /// What is drawn; the first at the bottom. What lies beyond the ends is left out.
    pub curves: Vec<Curve>,
}

impl Map {
    fn draw(&self) -> Drawing {
        let bottom = TOP + HEIGHT;
        let mut page = Drawing {
            width: WIDTH,
            height: bottom + 40.0,
            ..Drawing::default()
        };
        page.text(
            (LEFT, 24.0),
            Anchor::Start,
            15.0,
            BLACK,
            self.title.as_str(),
        );
        let x = Axis::exact(self.starts.0, self.ends.0, LEFT, RIGHT);
        let y = Axis::exact(self.starts.1, self.ends.1, bottom, TOP);
        upright_grid(&mut page, &x, TOP, bottom);
        level_grid(&mut page, &y, TOP, self.ordinate.clone());
        for (number, curve) in self.curves.iter().enumerate() {
            let colour = line_colour(number);
            let inside = |p: &&(f64, f64)| {
                let (start, end) = (self.starts, self.ends);
                (start.0..=end.0).contains(&p.0) && (start.1..=end.1).contains(&p.1)
            };
            let places = curve
                .points
                .iter()
                .filter(inside)
                .map(|p| (x.place(p.0), y.place(p.1)));
            let at = TOP + HEADING + 16.0 * number as f64;
            if curve.dots {
                places.for_each(|place| page.line(vec![place], colour, 3.0));
                legend(&mut page, at, &curve.name, Some(colour), 6.0);
            } else {
                page.line(places.collect(), colour, 1.6);
                legend(&mut page, at, &curve.name, Some(colour), 1.6);
            }
        }
        abscissa(&mut page, &x, bottom, self.abscissa.clone());
        page
    }

    /// Writes the map to a file whose name ends in `.svg` or `.png`.
    ///
    /// # Errors
    /// The name ends otherwise, or the file cannot be written.
    pub fn save(&self, path: &Path) -> Result<(), FileError> {
        save_drawing(&self.draw(), path)
    }

    /// The map as an SVG document.
    pub fn svg(&self) -> String {
        svg::print(&self.draw())
    }

    /// The map as a PNG picture; `None` if it does not fit into memory.
    pub fn png(&self) -> Option<Vec<u8>> {
        png::paint(&self.draw())
    }
}
