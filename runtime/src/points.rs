//! Chosen points of strings: `line.u@12%`, `strings[2].u'@40 mm`.

use whippen_compiler::diag::nearest;
use whippen_compiler::model::{Reading, Strand};
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::units::{Dim, Quantity, parse_quantity, shown};

use crate::engine::EngineKind;
use crate::trace::Heading;

/// A point of a string, and what is traced of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// What its column is called.
    pub heading: Heading,
    /// The string (its number among the lowered).
    pub(crate) string: usize,
    /// Displacement or rate.
    pub(crate) reading: Reading,
    /// Where (m from where the string begins).
    pub(crate) place_m: f64,
}

impl Point {
    /// The point that a text names.
    ///
    /// # Errors
    /// There is no such string, or no such place on it, in words.
    pub fn parse(text: &str, compiled: &Compiled, kind: EngineKind) -> Result<Point, String> {
        let (path, place) = text.split_once('@').ok_or_else(|| {
            format!(
                "`{text}` does not say where: a point is `{}`, or a place such as `@40 mm`",
                example(compiled)
            )
        })?;
        let (path, place) = (path.trim(), place.trim());
        let (plain, reading) = match path.strip_suffix('\'') {
            Some(plain) => (plain, Reading::Rate),
            None => (path, Reading::Displacement),
        };
        let string = string(plain, compiled)?;
        let lowered = compiled.lowered.strands[string];
        let strand = &compiled.model.strands[lowered.strand];
        let place_m = place_on(place, strand).map_err(|why| format!("`{text}`: {why}"))?;
        let (unit, step) = match reading {
            Reading::Rate => ("m_per_s", lowered.lsb * f64::from(compiled.model.rate_hz)),
            _ => ("m", 0.5 * lowered.lsb),
        };
        Ok(Point {
            heading: Heading {
                name: format!("{path}@{place}"),
                unit: unit.to_string(),
                step: (kind != EngineKind::Ideal).then_some(step),
                ..Heading::default()
            },
            string,
            reading,
            place_m,
        })
    }
}

/// A point that there is.
fn example(compiled: &Compiled) -> String {
    let first = names(compiled).into_iter().next();
    format!("{}@12%", first.as_deref().unwrap_or("line.u"))
}

/// The displacements of all strings, as a point names them.
fn names(compiled: &Compiled) -> Vec<String> {
    let lowered = compiled.lowered.strands.iter();
    let strands = lowered.map(|one| &compiled.model.strands[one.strand]);
    let name = |strand: &Strand| {
        let own = strand.displacement.rsplit('.').next().unwrap_or("u");
        format!("{}.{own}", strand.name)
    };
    strands.map(name).collect()
}

/// The string whose displacement has this name: in full (`strings[2].heard.line.u`), or as much of
/// it as no other has too (`strings[2].u`, `u`, `line`).
fn string(path: &str, compiled: &Compiled) -> Result<usize, String> {
    let names = names(compiled);
    if names.is_empty() {
        return Err(format!("`{}` has no string", compiled.model.name));
    }
    if let Some(exactly) = names.iter().position(|name| name == path) {
        return Ok(exactly);
    }
    let is_named = |name: &&String| {
        let parts = || name.split('.');
        let mut rest = parts();
        let inside = path.split('.').all(|part| rest.any(|own| own == part));
        // The last part of a path is that of the string, or of its displacement.
        inside && (parts().next_back() == path.split('.').next_back() || is_string(name, path))
    };
    let found: Vec<&String> = names.iter().filter(is_named).collect();
    match found[..] {
        [one] => Ok(names.iter().position(|name| name == one).unwrap_or(0)),
        [] => {
            let near = nearest(path, names.iter().map(String::as_str));
            let near = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
            Err(format!(
                "there is no string `{path}`{near}; there are `{}`",
                names.join("`, `")
            ))
        }
        _ => {
            let found: Vec<&str> = found.into_iter().map(String::as_str).collect();
            Err(format!(
                "`{path}` may be `{}`; say which",
                found.join("`, `")
            ))
        }
    }
}

/// Whether a path ends with the name of the string itself.
fn is_string(name: &str, path: &str) -> bool {
    let string = name.rsplit_once('.').map_or(name, |(string, _)| string);
    string.rsplit('.').next() == path.rsplit('.').next()
}

/// A place on a string: a part of it (`12%`), or where it is as the program says it (`40 mm`).
fn place_on(place: &str, strand: &Strand) -> Result<f64, String> {
    let ends = [strand.along.low, strand.along.high].map(|end| shown(end, Dim::LENGTH));
    let reaches = format!(
        "`{}` reaches from {} to {}, which is 0% to 100%",
        strand.name, ends[0], ends[1]
    );
    let place_m = match place.strip_suffix('%') {
        Some(part) => {
            let part: f64 = part.trim().parse().map_err(|_| {
                format!("`{place}` is no place; a part of a string is such as `12%`")
            })?;
            0.01 * part * strand.length()
        }
        None => match parse_quantity(place) {
            Ok(Quantity::Real { value, dim }) if dim == Dim::LENGTH => value - strand.along.low,
            _ => {
                let why = "is no place: write a length, such as `40 mm`, or a part, such as `12%`";
                return Err(format!("`{place}` {why}; {reaches}"));
            }
        },
    };
    let slack = 1e-9 * strand.length();
    if place_m >= -slack && place_m <= strand.length() + slack {
        Ok(place_m.clamp(0.0, strand.length()))
    } else {
        Err(format!("{place} is not on the string; {reaches}"))
    }
}
