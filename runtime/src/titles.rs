//! Titles of columns: a name and a unit, as tables spell them (`x_mm`, `f_n`, `speed_m_per_s`,
//! `k_n_per_m`).
//!
//! A suffix is a unit of the language in small letters, with `_` for `*`, `_per_` for `/` and
//! digits for powers. The compiler reads and writes suffixes (`units::title`).

pub use whippen_compiler::units::{split_title, unit_of_suffix};

/// The title of a name and a unit's suffix; a plain number has none.
pub fn join_title(name: &str, suffix: &str) -> String {
    if suffix.is_empty() {
        name.to_string()
    } else {
        format!("{name}_{suffix}")
    }
}

/// Words that a column cannot be called by: statements of Python or MATLAB that a program may use
/// as the name of a machine or a plain number.
const RESERVED: &[&str] = &[
    "and",
    "as",
    "assert",
    "break",
    "case",
    "catch",
    "class",
    "continue",
    "def",
    "del",
    "elif",
    "else",
    "elseif",
    "end",
    "except",
    "finally",
    "for",
    "from",
    "function",
    "global",
    "if",
    "import",
    "in",
    "is",
    "lambda",
    "not",
    "or",
    "otherwise",
    "parfor",
    "pass",
    "persistent",
    "raise",
    "return",
    "spmd",
    "switch",
    "try",
    "while",
    "with",
    "yield",
];

/// A name that Python and MATLAB take as one: letters, digits and `_`, a letter first. Primes are
/// `_dot` and `_ddot`, what belongs to a call is joined by `_` (`phi_dot`, `jack_out`), and a
/// point of a string is spelled out (`line_u_at_12_percent`).
pub fn identifier(name: &str) -> String {
    let name = name.replace("''", "_ddot").replace('\'', "_dot");
    let name = name.replace('@', "_at_").replace('%', "_percent");
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let name: String = name.chars().map(plain).collect();
    if RESERVED.contains(&name.as_str()) {
        return name + "_";
    }
    if name.starts_with(|c: char| c.is_ascii_alphabetic()) {
        name
    } else {
        format!("v{name}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn identifiers_are_those_of_python_and_matlab() {
        let cases = [
            ("x", "x"),
            ("phi'", "phi_dot"),
            ("x''", "x_ddot"),
            ("jack.held.t", "jack_held_t"),
            ("_a", "v_a"),
            ("lambda", "lambda_"),
            ("end", "end_"),
            ("ending", "ending"),
        ];
        for (name, expected) in cases {
            assert_eq!(identifier(name), expected);
        }
    }
}
