//! Titles of columns: a name and a unit, as tables spell them (`x_mm`, `speed_m_per_s`).
//!
//! A suffix is a unit of the language in small letters, with `_` for `*`, `_per_` for `/` and
//! digits for powers. [`super::unit_suffix`] writes them; this reads them.

use super::{UNITS, Unit, parse_unit};

/// Splits a title into its name and its unit: the longest tail that spells a unit. A title without
/// a unit is a plain number.
pub fn split_title(title: &str) -> (&str, Option<Unit>) {
    let tails = title
        .match_indices('_')
        .map(|(at, _)| (&title[..at], &title[at + 1..]));
    tails
        .filter(|(name, _)| !name.is_empty())
        .find_map(|(name, tail)| unit_of_suffix(tail).map(|unit| (name, Some(unit))))
        .unwrap_or((title, None))
}

/// The unit a suffix spells.
pub fn unit_of_suffix(suffix: &str) -> Option<Unit> {
    let mut expression = String::new();
    let mut sign = '*';
    for word in suffix.split('_') {
        if word == "per" {
            sign = '/';
            continue;
        }
        let digits = word.trim_start_matches(|c: char| !c.is_ascii_digit());
        let name = spelled(&word[..word.len() - digits.len()])?;
        if !expression.is_empty() || sign == '/' {
            expression.push(sign);
        }
        expression.push_str(name);
        if !digits.is_empty() {
            expression.push('^');
            expression.push_str(digits);
        }
        sign = '*';
    }
    // `per_s` alone is one over a unit.
    match expression.strip_prefix('/') {
        Some(below) => parse_unit(below)
            .filter(|_| !below.contains(['*', '/']))
            .map(one_over),
        None => parse_unit(&expression),
    }
}

fn one_over(unit: Unit) -> Unit {
    Unit {
        up: unit.down,
        down: unit.up,
        dim: unit.dim.powi(-1),
    }
}

/// The unit's name as the language spells it, large or small letters aside.
fn spelled(word: &str) -> Option<&'static str> {
    let exact = UNITS.iter().find(|u| u.name == word);
    exact
        .or_else(|| UNITS.iter().find(|u| u.name.eq_ignore_ascii_case(word)))
        .map(|u| u.name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::{DIMENSIONS, Dim, unit_suffix};

    #[test]
    fn titles_of_traces_and_tables() {
        let read = |title| match split_title(title) {
            (name, Some(unit)) => (name, unit.factor(), unit.dim),
            (name, None) => (name, f64::NAN, Dim::NUMBER),
        };
        assert_eq!(read("t_s"), ("t", 1.0, Dim::TIME));
        assert_eq!(read("t_ms"), ("t", 1e-3, Dim::TIME));
        assert_eq!(read("x_mm"), ("x", 1e-3, Dim::LENGTH));
        assert_eq!(read("front_of_key_mm"), ("front_of_key", 1e-3, Dim::LENGTH));
        assert_eq!(read("f_n"), ("f", 1.0, Dim::FORCE));
        assert_eq!(read("F_mN"), ("F", 1e-3, Dim::FORCE));
        assert_eq!(read("speed_m_per_s"), ("speed", 1.0, Dim::SPEED));
        assert_eq!(read("a_m_per_s2"), ("a", 1.0, Dim::ACCELERATION));
        assert_eq!(read("clock_per_s"), ("clock", 1.0, Dim::PER_TIME));
        assert_eq!(read("b_n_s_per_m").2, Dim::new(0, 1, -1, 0));
        for plain in [
            "x",
            "contact",
            "jack_state",
            "_mm",
            "adc_after_offset_0.30_gain_0.58",
            "",
            "_",
            "é_ü",
        ] {
            assert_eq!(split_title(plain), (plain, None));
        }
    }

    #[test]
    fn every_suffix_the_compiler_writes_is_read_back() {
        for named in DIMENSIONS.iter().filter(|d| !d.dim.is_number()) {
            let suffix = unit_suffix(&named.dim.unit());
            let unit = unit_of_suffix(&suffix).unwrap_or_else(|| panic!("{suffix}"));
            assert_eq!((unit.factor(), unit.dim), (1.0, named.dim), "{suffix}");
        }
    }
}
