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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_unknown_is_told_with_what_to_write() {
        let of = |fetch, section: Option<&str>, better: Option<&str>| {
            let access = UnknownTime {
                address: 0x100,
                fetch,
                what: Unknown::Memory {
                    memory: "flash".into(),
                    section: section.map(str::to_string),
                },
                better: better.map(str::to_string),
            };
            access.to_string()
        };
        let ends = ", where nobody can say how long that takes: `memory.flash.access` is no number \
                    of cycles in the board's file";
        assert_eq!(
            of(false, None, Some("sram")),
            format!("`what is accessed` may be accessed at 0x00000100 in `flash`{ends}")
        );
        assert_eq!(
            of(true, Some(".text.keys"), Some("sram")),
            format!(
                "`.text.keys` is fetched from `flash`{}; under [place], put it elsewhere, as in \
                 `\".text.keys*\" = \"sram\"`",
                ends.replace("access`", "fetch`")
            )
        );
    }
}
