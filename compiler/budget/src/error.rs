//! Why there is no bound: an address, and what is missing.

use std::fmt;

use whippen_isa::{NotDecoded, reg};

use super::unknown::UnknownTime;

/// Why code has no bound.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum NotBounded {
    /// A path leaves the bytes that were given.
    NoCode {
        /// Where it goes.
        address: u32,
    },
    /// A path runs into what is no instruction.
    NoInstruction {
        /// Where.
        address: u32,
        /// What the words are.
        why: NotDecoded,
    },
    /// The code waits, traps or leaves for the Secure state: how long is not its own decision.
    Waits {
        /// Where.
        address: u32,
        /// The instruction.
        text: String,
    },
    /// An indirect branch without known targets.
    NoTargets {
        /// Where.
        address: u32,
        /// The instruction.
        text: String,
    },
    /// A table branch whose index is not bounded on some path.
    NoTable {
        /// Where.
        address: u32,
        /// The instruction.
        text: String,
    },
    /// A loop without a bound.
    NoRounds {
        /// Its head.
        head: u32,
    },
    /// A loop that can be entered in more places than one.
    Irreducible {
        /// Two of them.
        entries: [u32; 2],
    },
    /// A function that calls itself.
    Recursive {
        /// The call that closes the circle.
        address: u32,
    },
    /// Paths that meet with the stack pointer in two places, or a stack pointer that cannot be
    /// followed.
    Stack {
        /// Where.
        address: u32,
    },
    /// A return that may not return to the caller.
    Return {
        /// Where.
        address: u32,
    },
    /// A piece of a tick ends while the floating-point unit is at work: pieces cannot be summed.
    Unsettled {
        /// Where the tick begins.
        address: u32,
    },
    /// A name that the firmware should have.
    NoSymbol {
        /// Which.
        name: String,
    },
    /// Something else than the tick may interrupt, and nobody said how often.
    Interrupts {
        /// Its handler.
        address: u32,
    },
    /// A core runs code of a section that is counted as another one's.
    Elsewhere {
        /// Where.
        address: u32,
        /// The section.
        section: String,
        /// Which core.
        core: usize,
    },
    /// What is fetched or accessed may be in memory whose time nobody knows.
    UnknownTime(UnknownTime),
    /// The stack of a core may grow into what lies below it.
    StackRoom {
        /// Bytes of stack, at most.
        needed: u32,
        /// Bytes down to what lies below.
        room: u32,
        /// Where the stack ends.
        end: u32,
    },
    /// What is interrupted uses the floating-point unit, so that an exception saves more.
    FloatingPoint {
        /// Where.
        address: u32,
    },
    /// A tick may read that it is too late to send.
    SendsLate {
        /// Cycles from the request until it has read how late it is, at most.
        cycles_max: u64,
        /// Cycles up to which it sends.
        until_cycles: u64,
    },
    /// A tick may look for words before they lie in memory.
    LooksEarly {
        /// Cycles from the handler's first instruction until it looks, at least.
        cycles_min: u64,
        /// Cycles until they are there.
        words_cycles: u64,
    },
    /// No path ends.
    Endless {
        /// Where it starts.
        entry: u32,
    },
    /// There are more instructions, calls written out, than this analysis is made for.
    TooLarge {
        /// Instructions, at most.
        instructions_max: usize,
    },
}

impl NotBounded {
    /// Whether another description of the board, or another placement in it, would mend it.
    pub fn is_the_boards(&self) -> bool {
        matches!(self, Self::UnknownTime(_) | Self::StackRoom { .. })
    }

    /// The address it is about, if there is one.
    pub fn address(&self) -> Option<u32> {
        match self {
            Self::NoCode { address }
            | Self::NoInstruction { address, .. }
            | Self::Waits { address, .. }
            | Self::NoTargets { address, .. }
            | Self::NoTable { address, .. }
            | Self::Recursive { address }
            | Self::Stack { address }
            | Self::Unsettled { address }
            | Self::Interrupts { address }
            | Self::FloatingPoint { address }
            | Self::Elsewhere { address, .. }
            | Self::Return { address } => Some(*address),
            Self::NoRounds { head } => Some(*head),
            Self::Irreducible { entries } => Some(entries[0]),
            Self::Endless { entry } => Some(*entry),
            Self::UnknownTime(access) => Some(access.address),
            Self::TooLarge { .. }
            | Self::NoSymbol { .. }
            | Self::StackRoom { .. }
            | Self::SendsLate { .. }
            | Self::LooksEarly { .. } => None,
        }
    }
}

impl fmt::Display for NotBounded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoCode { address } => {
                write!(f, "execution reaches {address:#010x}, and there is no code")
            }
            Self::NoInstruction { address, .. } => {
                write!(
                    f,
                    "execution reaches {address:#010x}, which is no instruction"
                )
            }
            Self::Waits { address, text } => {
                write!(
                    f,
                    "`{text}` at {address:#010x} hands over to what is outside of the code: how long that takes is not known"
                )
            }
            Self::NoTargets { address, text } => {
                write!(
                    f,
                    "where `{text}` at {address:#010x} goes is not known: give its targets"
                )
            }
            Self::NoTable { address, text } => write!(
                f,
                "the index of `{text}` at {address:#010x} has no bound on some path: compare it before, or give the targets"
            ),
            Self::NoRounds { head } => {
                write!(
                    f,
                    "the loop at {head:#010x} has no bound: say how often its first instruction runs at most"
                )
            }
            Self::Irreducible { entries: [a, b] } => {
                write!(
                    f,
                    "the loop with {a:#010x} and {b:#010x} can be entered at both"
                )
            }
            Self::Recursive { address } => {
                write!(f, "the call at {address:#010x} closes a circle of calls")
            }
            Self::Stack { address } => write!(
                f,
                "at {address:#010x} {} is not at a fixed distance from where it was at the entry",
                reg::core_name(reg::SP)
            ),
            Self::Return { address } => {
                write!(
                    f,
                    "the return at {address:#010x} may not go to the caller: its address is not the one that came in"
                )
            }
            Self::Unsettled { address } => {
                write!(
                    f,
                    "the tick at {address:#010x} goes on to the next key while the floating-point unit is at work"
                )
            }
            Self::NoSymbol { name } => write!(f, "there is no `{name}` in the code"),
            Self::Interrupts { address } => {
                write!(
                    f,
                    "the handler at {address:#010x} may interrupt a tick, and how often is not known"
                )
            }
            Self::Elsewhere {
                address,
                section,
                core,
            } => write!(
                f,
                "core {core} runs the code at {address:#010x}, in `{section}`, whose fetches are \
                 counted as another core's or the start's: put what a tick calls into \
                 `.text.frame`, and what core 1 runs between ticks into `.text.core1.firmware`"
            ),
            Self::UnknownTime(access) => access.fmt(f),
            Self::StackRoom { needed, room, end } => write!(
                f,
                "a stack takes up to {needed} bytes, and the one that ends at {end:#010x} has {room}: \
                 give it an end further up, or put less below it"
            ),
            Self::FloatingPoint { address } => write!(
                f,
                "the instruction at {address:#010x} uses the floating-point unit between ticks: how \
                 much an interrupt saves then is not bounded"
            ),
            Self::SendsLate {
                cycles_max,
                until_cycles,
            } => write!(
                f,
                "a tick may need {cycles_max} cycles from its interrupt until it reads how late it is, \
                 and sends its words for the converters only up to {until_cycles}: ticks would be \
                 missed"
            ),
            Self::LooksEarly {
                cycles_min,
                words_cycles,
            } => write!(
                f,
                "a tick may look for words of the converters after {cycles_min} cycles, and they are \
                 there after {words_cycles}: ticks would be missed"
            ),
            Self::Endless { entry } => write!(f, "no path from {entry:#010x} ends"),
            Self::TooLarge { instructions_max } => {
                write!(
                    f,
                    "more than {instructions_max} instructions, calls written out, can be reached"
                )
            }
        }
    }
}

impl From<UnknownTime> for NotBounded {
    fn from(access: UnknownTime) -> Self {
        Self::UnknownTime(access)
    }
}

impl std::error::Error for NotBounded {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::unknown::Unknown;

    /// Of each its address, whether the board is to blame, and what is said of it.
    #[test]
    fn what_is_refused_is_told_with_its_address() {
        let access = UnknownTime {
            address: 0x108,
            fetch: false,
            what: Unknown::Nothing { target: 0x40 },
            better: None,
        };
        let room = NotBounded::StackRoom {
            needed: 90,
            room: 80,
            end: 0x200,
        };
        for (why, address, board, says) in [
            (
                NotBounded::NoCode { address: 0x100 },
                Some(0x100),
                false,
                "execution reaches 0x00000100",
            ),
            (
                NotBounded::NoRounds { head: 0x102 },
                Some(0x102),
                false,
                "the loop at 0x00000102 has no bound",
            ),
            (
                NotBounded::Irreducible {
                    entries: [0x104, 0x106],
                },
                Some(0x104),
                false,
                "the loop with 0x00000104 and 0x00000106",
            ),
            (
                NotBounded::Endless { entry: 0x10a },
                Some(0x10a),
                false,
                "no path from 0x0000010a ends",
            ),
            (
                access.into(),
                Some(0x108),
                true,
                "the code at 0x00000108 accesses 0x00000040",
            ),
            (room, None, true, "a stack takes up to 90 bytes"),
        ] {
            assert_eq!(
                (why.address(), why.is_the_boards()),
                (address, board),
                "{why}"
            );
            assert!(why.to_string().contains(says), "{why}");
        }
    }
}
