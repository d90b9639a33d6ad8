//! Machine code and what belongs to it, before and after it has addresses; and the files that are
//! made of it.
//!
//! ```text
//!   thumb (the tick)  --.
//!                        Object --link (Board)--> Image --> elf, uf2, listing, map
//!   asm (the firmware) --'  `--relocatable--> ELF with relocations, bindings for C and Rust
//! ```
//!
//! | part | what it settles |
//! | --- | --- |
//! | `object` | sections, symbols and places to be filled in, without addresses |
//! | `link`, `linked` | addresses |
//! | `fixup` | an address, put into an instruction or a word |
//! | `boot` | what stands at the start of a stored image: the block or the checksum that a ROM looks for |
//! | `flow` | where the instructions of code lead |
//! | `unwind` | where the caller's stack and registers are, at every instruction |
//! | `variables`, `held` | what lies in the state of the keys; where a mode's code still points at it |
//! | `lines` | the source line that a debugger shows for an origin |
//! | `elf`, `dwarf`, `uf2` | files for debuggers, linkers and bootloaders |
//! | `listing`, `map` | files for people |
//! | `rows` | the listing as a table, for who shows it |
//!
//! Everything is a function of its arguments: the same program gives the same bytes. Not here:
//! files, instructions.

mod boot;
mod dwarf;
mod elf;
mod fixup;
mod flow;
mod held;
mod lines;
mod link;
mod linked;
mod listing;
mod map;
mod object;
mod rows;
mod uf2;
mod unwind;
mod variables;

pub use elf::{Executable, executable, relocatable};
pub use fixup::FixupError;
pub use lines::{Place, places};
pub use link::{Input, LinkError, link};
pub use linked::{Image, Linked, Named, Segment};
pub use listing::listing;
pub(crate) use listing::outcome;
pub use map::map;
pub use object::{
    Fixup, FixupKind, Hint, LineRow, Object, Section, SectionKind, Symbol, SymbolKind,
};
pub use rows::{CodeRow, code_rows};
pub use uf2::uf2;
pub use variables::{Known, Meaning, Scale, Variable, Variables};
pub use whippen_board::{Board, Memory, MemoryKind, Placement, Start, timing};
