//! What debuggers may show of the keys of a core: names, places and meanings of what lies in their
//! state.
//!
//! The tick has four registers that point at it (`thumb::registers`), so a place is an offset from
//! one of them. Not here: which of a program's names they are (the compiler's `variables`), how
//! debuggers are told (`dwarf`).

/// What a word means.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Meaning {
    /// A number without a unit.
    Unsigned,
    /// 0 or 1.
    Bool,
    /// The address of the code of the key's mode.
    Code,
    /// One of a machine's states, by number.
    States {
        /// The machine.
        machine: String,
        /// Names of its states.
        states: Vec<String>,
    },
    /// A real number.
    Real {
        /// Bytes of the integer: 2 without a sign or 4 with one; -2 is 2 with a sign.
        bytes: i8,
        /// What the integer is of it.
        scale: Scale,
        /// Its unit (SI), or the word `number`.
        unit: String,
    },
}

/// What an integer is of a real number. Nothing is computed with reals here: those that debuggers
/// compute with are bytes of `f64`, the lowest first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Scale {
    /// This power of two of it.
    PowerOfTwo(i32),
    /// `zero + integer * lsb`
    Linear {
        /// Value of one unit.
        lsb: [u8; 8],
        /// Value of 0.
        zero: [u8; 8],
        /// Both, in words.
        called: String,
    },
}

/// What is known of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Known {
    /// Its integer.
    pub integer: i64,
    /// The real number, where it is one, as in [`Scale`].
    pub real: [u8; 8],
}

/// Something with a name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Variable {
    /// Its name, as C can spell it.
    pub name: String,
    /// Offset in bytes.
    pub at: u32,
    /// What it means.
    pub meaning: Meaning,
    /// How many there are, row by row, where it is an array.
    pub array: Vec<u32>,
}

/// What lies where in the state of a core's keys.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Variables {
    /// Prefix of the symbols.
    pub name: String,
    /// Bytes of the state.
    pub state_bytes: u32,
    /// What all keys share, by offset in the state.
    pub shared: Vec<Variable>,
    /// Keys, offset of the first record in the state, and bytes from one to the next.
    pub records: (u32, u32, u32),
    /// What each key has, by offset in its record.
    pub key: Vec<Variable>,
    /// The key's words of a tick, by offset from its first.
    pub words: Vec<Variable>,
    /// What each mode knows of each of `key`, so that memory need not hold it.
    pub known: Vec<Vec<Option<Known>>>,
    /// What has a name in the program and no place: name and unit.
    pub nowhere: Vec<(String, String)>,
}

impl Variables {
    /// Whether memory holds something of a key in every mode.
    pub(super) fn is_always_held(&self, nth: usize) -> bool {
        let known = |mode: &Vec<Option<Known>>| mode.get(nth).copied().flatten().is_some();
        !self.known.iter().any(known)
    }

    /// The mode whose code has this name.
    pub(super) fn mode(&self, function: &str) -> Option<usize> {
        let number = function.strip_prefix(&self.name)?.strip_prefix(".mode.")?;
        number.parse().ok().filter(|mode| *mode < self.known.len())
    }
}
