//! Random strings: a tick of the one that is declared, if one is.

use super::Generator;
use crate::{Builder, Op, OpError};

impl Generator {
    /// One tick of the string.
    pub(super) fn wave(&mut self, b: &mut Builder) -> Result<(), OpError> {
        let mut cells = b.kernel().cells.iter();
        match cells.position(|cell| cell.name == "string.u") {
            Some(u) => self.write(b, Op::Wave(u as u32, u as u32 + 1)),
            None => Ok(()),
        }
    }
}
