//! A drawing: shapes in the order in which they are painted, in points from the upper left corner.
//!
//! Panels add shapes; `svg` and `png` put the same list on paper. Four kinds of shapes are enough.

/// A place: right, down.
pub type Point = (f64, f64);

/// Red, green, blue as `0xrrggbb`.
pub type Colour = u32;

/// Where a text stands relative to its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Anchor {
    /// It begins there.
    Start,
    /// Its middle is there.
    Middle,
    /// It ends there.
    End,
}

/// One shape.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A line through points, with round joins and ends.
    Line {
        /// Its points, at least two.
        points: Vec<Point>,
        /// Its colour.
        colour: Colour,
        /// Its width.
        width: f64,
    },
    /// A filled polygon.
    Area {
        /// Its corners.
        points: Vec<Point>,
        /// Its colour.
        colour: Colour,
    },
    /// A picture, stretched to its place.
    Image {
        /// Its upper left corner.
        at: Point,
        /// Its width and height on the page.
        size: Point,
        /// Its pixels, row by row.
        pixels: Vec<Colour>,
        /// Pixels of a row.
        columns: usize,
    },
    /// One line of text.
    Text {
        /// Place on the baseline.
        at: Point,
        /// The text.
        text: String,
        /// Height of the font.
        size: f64,
        /// Its colour.
        colour: Colour,
        /// Where it stands relative to its place.
        anchor: Anchor,
    },
}

/// Shapes on a white page.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Drawing {
    /// Width of the page.
    pub width: f64,
    /// Height of the page.
    pub height: f64,
    /// What is on it, the first at the bottom.
    pub shapes: Vec<Shape>,
}

impl Drawing {
    /// Adds a line, or a dot where it has one point only.
    pub fn line(&mut self, points: Vec<Point>, colour: Colour, width: f64) {
        match points[..] {
            [] => {}
            [(x, y)] => self.rect((x - width, y - width), (x + width, y + width), colour),
            _ => self.shapes.push(Shape::Line {
                points,
                colour,
                width,
            }),
        }
    }

    /// Adds a picture by its upper left corner and its size on the page.
    pub fn image(&mut self, at: Point, size: Point, pixels: Vec<Colour>, columns: usize) {
        self.shapes.push(Shape::Image {
            at,
            size,
            pixels,
            columns,
        });
    }

    /// Adds a filled rectangle by its upper left and lower right corners.
    pub fn rect(&mut self, (left, top): Point, (right, bottom): Point, colour: Colour) {
        let points = vec![(left, top), (right, top), (right, bottom), (left, bottom)];
        self.shapes.push(Shape::Area { points, colour });
    }

    /// Adds a text.
    pub fn text(
        &mut self,
        at: Point,
        anchor: Anchor,
        size: f64,
        colour: Colour,
        text: impl Into<String>,
    ) {
        self.shapes.push(Shape::Text {
            at,
            text: text.into(),
            size,
            colour,
            anchor,
        });
    }
}
