//! Random strings: a tick of the one that is declared, if one is.

use super::Generator;
use crate::{Builder, Op, OpError};

impl Generator {
    /// One tick of the string.
    pub(super) fn wave(&mut self, b: &mut Builder) -> Result<(), OpError> {
        let mut cells = b.kernel().cells.iter();
        match cells.position(|cell| cell.name == "string.e") {
            Some(e) => self.write(b, Op::Wave(e as u32, e as u32 + 1)),
            None => Ok(()),
        }
    }
}
