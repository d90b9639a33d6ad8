//! Identifiers. Every kind of thing has a prefix, so names meet no keyword and no name of another
//! kind; what C cannot spell becomes `_`, a prime becomes `_prime`, and of two names that would
//! then be one the later gets its number.

use whippen_kernel::Kernel;

/// What everything is called.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Names {
    /// Prefix of everything that leaves the file: the kernel's name.
    pub kernel: String,
    /// The same in capitals, for macros.
    pub capitals: String,
    /// Fields of the live values.
    pub lives: Vec<String>,
    /// Constants of each key.
    pub keyed: Vec<String>,
    /// Fields of the cells.
    pub cells: Vec<String>,
    /// Fields of the delay lines.
    pub lines: Vec<String>,
    /// Tables.
    pub tables: Vec<String>,
    /// Numbers of the events.
    pub events: Vec<String>,
    /// Numbers of the probes.
    pub probes: Vec<String>,
}

impl Names {
    /// Names for all that a kernel declares.
    pub fn new(kernel: &Kernel) -> Names {
        let name = spelled(&kernel.name);
        let name = if name.starts_with(|c: char| c.is_ascii_digit()) {
            format!("k{name}")
        } else {
            name
        };
        let capitals = name.to_uppercase();
        let macros = |kind: &str, names: &mut dyn Iterator<Item = &String>| {
            let all = unique(&format!("{capitals}_{kind}"), names);
            all.into_iter().map(|name| name.to_uppercase()).collect()
        };
        Names {
            lives: unique("live", &mut kernel.lives.iter().map(|live| &live.name)),
            keyed: unique("keyed", &mut kernel.keyed.iter().map(|keyed| &keyed.name)),
            cells: unique("cell", &mut kernel.cells.iter().map(|cell| &cell.name)),
            lines: unique("line", &mut kernel.lines.iter().map(|line| &line.name)),
            tables: unique("table", &mut kernel.tables.iter().map(|table| &table.name)),
            events: macros("event", &mut kernel.events.iter().map(|event| &event.name)),
            probes: macros("probe", &mut kernel.probes.iter().map(|probe| &probe.name)),
            kernel: name,
            capitals,
        }
    }
}

fn unique(prefix: &str, names: &mut dyn Iterator<Item = &String>) -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    for (index, name) in names.enumerate() {
        let wanted = format!("{prefix}_{}", spelled(name));
        let taken = all.iter().any(|other| other.eq_ignore_ascii_case(&wanted));
        all.push(if taken {
            format!("{wanted}_{index}_")
        } else {
            wanted
        });
    }
    all
}

/// A name as C and Rust can spell it.
pub fn spelled(name: &str) -> String {
    let letter = |c: char| match c {
        '\'' => "_prime".to_string(),
        c if c.is_ascii_alphanumeric() => c.to_string(),
        _ => "_".to_string(),
    };
    name.chars().map(letter).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use whippen_kernel::parse;

    #[test]
    fn names_that_c_cannot_spell_stay_apart() {
        let text = "kernel \"9 lives\" @1 { cell phi': i32 [0..1] = 0 cell phi_prime: i32 [0..1] = 0 cell int: i32 [0..1] = 0 }";
        let names = Names::new(&parse(text).expect("parses"));
        assert_eq!(names.kernel, "k9_lives");
        assert_eq!(
            names.cells,
            ["cell_phi_prime", "cell_phi_prime_1_", "cell_int"]
        );
    }
}
