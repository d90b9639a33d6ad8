//! The font of plots: Roboto, embedded (`font/`, with its licence), so that a picture needs nothing
//! of the machine it is made on.
//!
//! Not here: kerning and scripts other than Latin and Greek; unknown characters are drawn as boxes.

use std::sync::LazyLock;

use tiny_skia::{Path, PathBuilder};
use ttf_parser::{Face, GlyphId, OutlineBuilder};

static FACE: LazyLock<Face<'static>> = LazyLock::new(|| {
    let bytes = include_bytes!("font/Roboto-subset.ttf");
    Face::parse(bytes, 0).expect("the embedded font is correct")
});

/// The width of a text in a font of the given height.
pub fn width(text: &str, size: f64) -> f64 {
    text.chars().map(|c| advance(glyph(c))).sum::<f64>() * scale(size)
}

/// The outlines of a text whose baseline begins at the origin; `None` for a text without ink.
pub fn outline(text: &str, size: f64) -> Option<Path> {
    let mut pen = Pen {
        path: PathBuilder::new(),
        x: 0.0,
        scale: scale(size),
    };
    for id in text.chars().map(glyph) {
        FACE.outline_glyph(id, &mut pen);
        pen.x += advance(id) * pen.scale;
    }
    pen.path.finish()
}

fn scale(size: f64) -> f64 {
    size / f64::from(FACE.units_per_em())
}

fn glyph(c: char) -> GlyphId {
    FACE.glyph_index(c).unwrap_or_default()
}

/// The width of a glyph in units of the font.
fn advance(id: GlyphId) -> f64 {
    f64::from(FACE.glyph_hor_advance(id).unwrap_or(0))
}

/// Puts outlines at the present place, scaled and the right way up.
struct Pen {
    path: PathBuilder,
    x: f64,
    scale: f64,
}

impl Pen {
    fn place(&self, x: f32, y: f32) -> (f32, f32) {
        (
            (self.x + f64::from(x) * self.scale) as f32,
            (-f64::from(y) * self.scale) as f32,
        )
    }
}

impl OutlineBuilder for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.place(x, y);
        self.path.move_to(x, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.place(x, y);
        self.path.line_to(x, y);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let ((x1, y1), (x, y)) = (self.place(x1, y1), self.place(x, y));
        self.path.quad_to(x1, y1, x, y);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let ((x1, y1), (x2, y2), (x, y)) =
            (self.place(x1, y1), self.place(x2, y2), self.place(x, y));
        self.path.cubic_to(x1, y1, x2, y2, x, y);
    }

    fn close(&mut self) {
        self.path.close();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_have_widths_and_ink() {
        let ink = outline("force (N), φ − ½·µm", 12.0).unwrap().bounds();
        let wide = width("force (N), φ − ½·µm", 12.0);
        assert!(
            (f64::from(ink.right()) - wide).abs() < 1.5 && ink.top() < -8.0 && ink.bottom() < 4.0,
            "{ink:?} {wide}"
        );
        assert!((width("mm", 24.0) / width("mm", 12.0) - 2.0).abs() < 1e-12);
        assert_eq!((width("", 12.0), outline("  ", 12.0)), (0.0, None));
        for c in "−·×φθ²³½≤…'".chars() {
            assert_ne!(glyph(c), GlyphId(0), "{c} is in the font");
        }
    }
}
