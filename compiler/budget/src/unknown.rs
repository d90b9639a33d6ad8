//! Accesses whose time nobody knows: what there is to say about them.

use std::fmt;

/// What is accessed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Unknown {
    /// Memory whose access time the board's file gives as not bounded, or that has no such access.
    Memory {
        /// Its name.
        memory: String,
        /// The section that lies there, if it is one.
        section: Option<String>,
    },
    /// An address that is in no memory and on no bus of the board.
    Nothing {
        /// The address.
        target: u32,
    },
}

/// An access that may meet what has no known time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnknownTime {
    /// The instruction.
    pub address: u32,
    /// Whether it is the instruction itself that is fetched from there.
    pub fetch: bool,
    /// What.
    pub what: Unknown,
    /// A memory of the board where it would have a bound, if there is one.
    pub better: Option<String>,
}

impl fmt::Display for UnknownTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (address, key) = (self.address, if self.fetch { "fetch" } else { "access" });
        match &self.what {
            Unknown::Memory { memory, section } => {
                let what = section.as_deref().unwrap_or("what is accessed");
                let use_of = if self.fetch {
                    "is fetched from".to_string()
                } else {
                    format!("may be accessed at {address:#010x} in")
                };
                write!(
                    f,
                    "`{what}` {use_of} `{memory}`, where nobody can say how long that takes: \
                     `memory.{memory}.{key}` is no number of cycles in the board's file"
                )?;
                let (Some(section), Some(better)) = (section, &self.better) else {
                    return Ok(());
                };
                write!(
                    f,
                    "; under [place], put it elsewhere, as in `\"{section}*\" = \"{better}\"`"
                )
            }
            Unknown::Nothing { target } => {
                let does = if self.fetch { "fetches" } else { "accesses" };
                write!(
                    f,
                    "the code at {address:#010x} {does} {target:#010x}, which is in no memory and on \
                     no bus of the board's file: describe it under [memory.NAME] with base, size, \
                     kind, access, fetch and banks, or under [bus.NAME] with base, size, read and \
                     write"
                )
            }
        }
    }
}
