//! A drawing as SVG. Text stays text; the viewer's own sans-serif is used where Roboto is not
//! installed.

use std::fmt::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::drawing::{Anchor, Drawing, Point, Shape};
use super::png;

/// The document.
pub fn print(drawing: &Drawing) -> String {
    let Drawing {
        width,
        height,
        shapes,
    } = drawing;
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
         font-family=\"Roboto, Helvetica, Arial, sans-serif\" stroke-linecap=\"round\" stroke-linejoin=\"round\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n"
    );
    shapes
        .chunk_by(is_drawn_alike)
        .for_each(|alike| print_shapes(&mut out, alike));
    out.push_str("</svg>\n");
    out
}

/// Whether two shapes are lines of one pen: they are one path, as loops fall into many pieces.
fn is_drawn_alike(one: &Shape, next: &Shape) -> bool {
    match (one, next) {
        (
            Shape::Line { colour, width, .. },
            Shape::Line {
                colour: next_colour,
                width: next_width,
                ..
            },
        ) => colour == next_colour && width == next_width,
        _ => false,
    }
}

/// Writes shapes that are drawn alike, or one of any kind. Writing to a string cannot fail, so
/// results of `write!` are dropped.
fn print_shapes(out: &mut String, shapes: &[Shape]) {
    match &shapes[0] {
        Shape::Line { colour, width, .. } => {
            let pieces = shapes.iter().map(|shape| match shape {
                Shape::Line { points, .. } => path(points),
                _ => String::new(),
            });
            let path: String = pieces.collect();
            let _ = writeln!(
                out,
                "<path d=\"{path}\" fill=\"none\" stroke=\"#{colour:06x}\" stroke-width=\"{width}\"/>"
            );
        }
        Shape::Area { points, colour } => {
            let _ = writeln!(
                out,
                "<path d=\"{}z\" fill=\"#{colour:06x}\"/>",
                path(points)
            );
        }
        Shape::Image {
            at,
            size,
            pixels,
            columns,
        } => {
            let picture = png::picture(pixels, *columns).and_then(|p| p.encode_png().ok());
            let data = STANDARD.encode(picture.unwrap_or_default());
            let [x, y, width, height] = [at.0, at.1, size.0, size.1].map(number);
            let _ = writeln!(
                out,
                "<image x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" preserveAspectRatio=\"none\" \
                 href=\"data:image/png;base64,{data}\"/>"
            );
        }
        Shape::Text {
            at,
            text,
            size,
            colour,
            anchor,
        } => {
            let anchor = match anchor {
                Anchor::Start => "start",
                Anchor::Middle => "middle",
                Anchor::End => "end",
            };
            let (x, y, text) = (number(at.0), number(at.1), escaped(text));
            let _ = writeln!(
                out,
                "<text x=\"{x}\" y=\"{y}\" font-size=\"{size}\" fill=\"#{colour:06x}\" text-anchor=\"{anchor}\">{text}</text>"
            );
        }
    }
}

fn path(points: &[Point]) -> String {
    let mut path = String::with_capacity(points.len() * 12);
    for (i, (x, y)) in points.iter().enumerate() {
        path.push(if i == 0 { 'M' } else { 'L' });
        path.push_str(&number(*x));
        path.push(' ');
        path.push_str(&number(*y));
    }
    path
}

/// Two decimals at most.
fn number(value: f64) -> String {
    let text = format!("{value:.2}");
    text.trim_end_matches('0').trim_end_matches('.').to_string()
}

fn escaped(text: &str) -> String {
    text.chars()
        .filter(|c| !c.is_control())
        .fold(String::new(), |mut out, c| {
            match c {
                '<' => out.push_str("&lt;"),
                '>' => out.push_str("&gt;"),
                '&' => out.push_str("&amp;"),
                _ => out.push(c),
            }
            out
        })
}
