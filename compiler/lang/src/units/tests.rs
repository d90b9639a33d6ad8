//! Dimensions, units, quantities.

use super::table::UNITS;
use super::*;

fn real(text: &str) -> (f64, Dim) {
    match parse_quantity(text) {
        Ok(Quantity::Real { value, dim }) => (value, dim),
        other => panic!("{text}: {other:?}"),
    }
}

#[test]
fn quantities_of_the_command_line() {
    assert_eq!(real("0.4N"), (0.4, Dim::FORCE));
    assert_eq!(real("0.4 N"), (0.4, Dim::FORCE));
    assert_eq!(real("12.7mm"), (0.0127, Dim::LENGTH));
    assert_eq!(real("-0.13 N"), (-0.13, Dim::FORCE));
    assert_eq!(real("8e3N/m"), (8e3, Dim::new(0, 1, -2, 0)));
    assert_eq!(real("1.54e-4 kg*m^2"), (1.54e-4, Dim::INERTIA));
    assert_eq!(real("180deg"), (std::f64::consts::PI, Dim::NUMBER));
    assert_eq!(real("60 gf").0, 0.588399);
    assert_eq!(real("3"), (3.0, Dim::NUMBER));
    assert_eq!(parse_quantity("on"), Ok(Quantity::Bool(true)));
    assert_eq!(parse_quantity("off"), Ok(Quantity::Bool(false)));
}

#[test]
fn mistakes_in_quantities() {
    let message = |text: &str| parse_quantity(text).unwrap_err().to_string();
    assert_eq!(
        message("4 newtons"),
        "`newtons` is not a unit; did you mean `N`?"
    );
    assert_eq!(message("4 Nm"), "`Nm` is not a unit; did you mean `N*m`?");
    assert_eq!(message("4 hz"), "`hz` is not a unit; did you mean `Hz`?");
    assert_eq!(message("4 N*furlong"), "`furlong` is not a unit");
    assert_eq!(message("4 µm"), "`µm` is not a unit");
    assert_eq!(
        message("fast"),
        "`fast` is not a number with a unit, such as `0.4N`"
    );
    assert_eq!(
        message(""),
        "`` is not a number with a unit, such as `0.4N`"
    );
    assert_eq!(message("1e999 m"), "`1e999 m` is too large");
    assert_eq!(message("1e"), "`e` is not a unit");
}

#[test]
fn the_longest_unit_is_taken() {
    let length = |text: &str| longest_unit(text).map(|(n, _)| n);
    assert_eq!(length("N*s/m * x"), Some(5));
    assert_eq!(length("N*k"), Some(1));
    assert_eq!(length("m^2"), Some(3));
    assert_eq!(length("m^2.5"), Some(1));
    assert_eq!(length("m^2..3"), Some(3));
    assert_eq!(length("s^-1"), Some(4));
    assert_eq!(length("m^12"), Some(1));
    assert_eq!(length("mm"), Some(2));
    assert_eq!(length("metre"), None);
    assert_eq!(length("m_2"), None);
    assert_eq!(length(""), None);
    assert!(parse_unit("N*m*s/rad").is_some());
    assert!(parse_unit("N*").is_none());
}

#[test]
fn every_dimension_is_shown_in_its_own_unit() {
    for named in DIMENSIONS {
        let dim = if named.unit.is_empty() {
            Dim::NUMBER
        } else {
            parse_unit(named.unit).unwrap().dim
        };
        assert_eq!(dim, named.dim, "{}", named.name);
        let shown = named.dim.unit();
        let read = if shown.is_empty() {
            Unit::ONE
        } else {
            parse_unit(&shown).unwrap()
        };
        assert_eq!((read.dim, read.factor()), (named.dim, 1.0), "{shown}");
    }
}

#[test]
fn odd_dimensions_are_shown_in_units_that_read_back() {
    for dim in [
        Dim::new(1, 1, -3, 0),
        Dim::new(0, 0, -3, 0),
        Dim::new(-2, 0, 3, -1),
        Dim::new(0, -1, -1, 0),
    ] {
        assert_eq!(parse_unit(&dim.unit()).unwrap().dim, dim, "{dim}");
    }
    assert_eq!(Dim::new(1, 1, -3, 0).to_string(), "kg*m/s^3");
    assert_eq!(Dim::NUMBER.to_string(), "1");
}

#[test]
fn suffixes_of_columns() {
    let suffix = |name: &str| unit_suffix(&dimension(name).unwrap().unit());
    assert_eq!(suffix("length"), "m");
    assert_eq!(suffix("speed"), "m_per_s");
    assert_eq!(suffix("acceleration"), "m_per_s2");
    assert_eq!(suffix("force"), "n");
    assert_eq!(suffix("damping"), "n_s_per_m");
    assert_eq!(suffix("inertia"), "kg_m2");
    assert_eq!(suffix("angular_rate"), "rad_per_s");
    assert_eq!(suffix("angle"), "");
    assert_eq!(
        unit_suffix(&Dim::new(1, 0, -2, -1).unit()),
        "m_per_s2_per_a"
    );
    assert_eq!(unit_suffix(&Dim::new(0, 0, -3, 0).unit()), "per_s3");
}

#[test]
fn exponents_never_overflow() {
    let huge = (0..20).fold(Dim::LENGTH, |d, _| d.mul(d));
    assert_eq!(huge.length, i8::MAX);
    assert!(!huge.powi(-1).div(huge).unit().is_empty());
    assert_eq!(
        Dim::new(2, 0, -4, 0).pow_halves(1),
        Some(Dim::new(1, 0, -2, 0))
    );
    assert_eq!(Dim::LENGTH.pow_halves(3), None);
    assert_eq!(Dim::LENGTH.pow_halves(4), Some(Dim::new(2, 0, 0, 0)));
}

#[test]
fn names_are_unique_and_found() {
    for (i, unit) in UNITS.iter().enumerate() {
        assert!(
            UNITS[..i]
                .iter()
                .all(|u| u.name != unit.name && u.title != unit.title),
            "{}",
            unit.name
        );
        assert_eq!(nearest_unit(&format!("{}s", unit.title)), Some(unit.name));
    }
    assert_eq!(dimension("lenght"), None);
    assert_eq!(
        crate::diag::nearest("lenght", dimension_names()),
        Some("length")
    );
    assert_eq!(crate::diag::nearest("xyzzy", dimension_names()), None);
}

#[test]
fn units_that_are_usual_fit_what_is_declared() {
    let unit = |size, name, reach| usual_unit(size, dimension(name).unwrap(), reach);
    assert_eq!(unit(4.0, "length", None), "mm");
    assert_eq!(unit(4.0, "length", Some(0.01)), "mm");
    assert_eq!(unit(40.0, "length", Some(0.01)), "um");
    assert_eq!(unit(0.2, "force", Some(0.5)), "N");
    assert_eq!(unit(200.0, "force", Some(0.5)), "mN");
    assert_eq!(unit(20.0, "torque", Some(0.1)), "mN*m");
    assert_eq!(unit(1e9, "force", Some(0.5)), "N");
    assert_eq!(unit(80.0, "stiffness", None), "N/m");
    assert_eq!(unit(3.0, "angle", None), "");
}

#[test]
fn units_are_of_si_in_the_same_words() {
    let other = [
        ("deg/s", "rad/s"),
        ("mN*m", "N*m"),
        ("N*m/rad", "N*m/rad"),
        ("gf/cm", "N/m"),
        ("mm^2", "m^2"),
        ("s^-1", "s^-1"),
    ];
    for (text, of_si) in other {
        assert_eq!(si_unit(text), of_si);
    }
    for unit in UNITS {
        let of_si = parse_unit(&si_unit(unit.name)).unwrap();
        assert_eq!(
            (of_si.factor(), of_si.dim),
            (1.0, unit.dim),
            "{}",
            unit.name
        );
    }
    let names = ["kHz", "deg", "mJ", "g"].map(si_unit);
    assert_eq!(names, ["Hz", "rad", "J", "kg"]);
}
