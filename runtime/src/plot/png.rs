//! A drawing as PNG: two pixels per point, smooth edges, text from outlines.

use tiny_skia::{
    Color, ColorU8, FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, PixmapPaint,
    Stroke, Transform,
};

use super::drawing::{Anchor, Colour, Drawing, Point, Shape};
use super::font;

/// Pixels per point.
const SCALE: f32 = 2.0;

/// The picture; `None` if it is too large for the memory.
pub fn paint(drawing: &Drawing) -> Option<Vec<u8>> {
    let pixels = |points: f64| (points * f64::from(SCALE)).ceil() as u32;
    let mut page = Pixmap::new(pixels(drawing.width), pixels(drawing.height))?;
    page.fill(Color::WHITE);
    drawing
        .shapes
        .iter()
        .for_each(|shape| paint_shape(&mut page, shape));
    page.encode_png().ok()
}

fn paint_shape(page: &mut Pixmap, shape: &Shape) {
    let scale = Transform::from_scale(SCALE, SCALE);
    match shape {
        Shape::Line {
            points,
            colour,
            width,
        } => {
            let stroke = Stroke {
                width: *width as f32,
                line_cap: LineCap::Round,
                line_join: LineJoin::Round,
                ..Stroke::default()
            };
            if let Some(path) = path(points, false) {
                page.stroke_path(&path, &ink(*colour), &stroke, scale, None);
            }
        }
        Shape::Area { points, colour } => {
            if let Some(path) = path(points, true) {
                page.fill_path(&path, &ink(*colour), FillRule::Winding, scale, None);
            }
        }
        Shape::Image {
            at,
            size,
            pixels,
            columns,
        } => {
            if let Some(picture) = picture(pixels, *columns) {
                let stretched = [
                    size.0 / f64::from(picture.width()),
                    size.1 / f64::from(picture.height()),
                ];
                let place = scale
                    .pre_translate(at.0 as f32, at.1 as f32)
                    .pre_scale(stretched[0] as f32, stretched[1] as f32);
                page.draw_pixmap(0, 0, picture.as_ref(), &PixmapPaint::default(), place, None);
            }
        }
        Shape::Text {
            at,
            text,
            size,
            colour,
            anchor,
        } => {
            let back = match anchor {
                Anchor::Start => 0.0,
                Anchor::Middle => 0.5,
                Anchor::End => 1.0,
            };
            let left = at.0 - back * font::width(text, *size);
            if let Some(path) = font::outline(text, *size) {
                let place = scale.pre_translate(left as f32, at.1 as f32);
                page.fill_path(&path, &ink(*colour), FillRule::Winding, place, None);
            }
        }
    }
}

/// Pixels as a picture; `None` if there are none.
pub fn picture(pixels: &[Colour], columns: usize) -> Option<Pixmap> {
    let rows = pixels.len().checked_div(columns)?;
    let mut picture = Pixmap::new(columns as u32, rows as u32)?;
    for (pixel, colour) in picture.pixels_mut().iter_mut().zip(pixels) {
        let [_, red, green, blue] = colour.to_be_bytes();
        *pixel = ColorU8::from_rgba(red, green, blue, 255).premultiply();
    }
    Some(picture)
}

fn ink(colour: Colour) -> Paint<'static> {
    let [_, red, green, blue] = colour.to_be_bytes();
    let mut paint = Paint {
        anti_alias: true,
        ..Paint::default()
    };
    paint.set_color_rgba8(red, green, blue, 255);
    paint
}

fn path(points: &[Point], closed: bool) -> Option<Path> {
    let mut path = PathBuilder::new();
    let ((x, y), rest) = points.split_first()?;
    path.move_to(*x as f32, *y as f32);
    for (x, y) in rest {
        path.line_to(*x as f32, *y as f32);
    }
    if closed {
        path.close();
    }
    path.finish()
}
