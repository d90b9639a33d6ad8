//! A program with the values that were found, everything else as it was written.

use whippen_compiler::model::Model;
use whippen_compiler::source::{SourceMap, Span};
use whippen_compiler::units::{Quantity, parse_quantity};

use super::free::parameter;

/// A value of `--set` as a program has it: a space before the unit.
fn as_written(value: &str) -> String {
    match parse_quantity(value) {
        Ok(Quantity::Real { value, dim }) => {
            format!("{value} {}", dim.unit()).trim_end().to_string()
        }
        _ => value.to_string(),
    }
}

/// The text of the file in which parameters are declared, with other values.
///
/// # Errors
/// They are declared in several files, or not in a file of the program, in words.
pub fn text(
    map: &SourceMap,
    sources: usize,
    model: &Model,
    values: &[(String, String)],
) -> Result<String, String> {
    let mut places: Vec<(Span, String)> = Vec::new();
    for (name, value) in values {
        let own = parameter(model, name);
        let span = own
            .map(|own| own.span)
            .filter(|s| (s.file as usize) < sources);
        let text = as_written(value);
        let span = span.ok_or_else(|| {
            format!("`{name}` is not declared in a file of yours; set it with --set {name}={value}")
        })?;
        places.push((span, text));
    }
    let file = places.first().map(|place| place.0.file);
    if places.iter().any(|place| Some(place.0.file) != file) {
        return Err("the parameters are declared in several files; set them with --set".into());
    }
    places.sort_by_key(|place| place.0.start);
    let whole = &map.files()[file.unwrap_or(0) as usize].text;
    let (mut out, mut done) = (String::new(), 0);
    for (span, value) in places {
        out += &whole[done..span.start as usize];
        out += &value;
        done = span.end as usize;
    }
    Ok(out + &whole[done..])
}
