//! The verifier: a kernel that passes cannot overflow, cannot leave a cell, a line or a table, and
//! gives one word per port.
//!
//! Every value's declared range must hold what the table's transfer makes of its operands' declared
//! ranges; by induction over the instructions every value then stays in its range, whatever the
//! inputs. Around loops the declared ranges of the carried values are the induction hypothesis.
//! Memory is covered the same way: what is stored lies in the range that the cell or line declares,
//! and what it holds at the start does too.
//!
//! Also checked: types, single definition, dominance, where effects may stand, that sizes and work
//! per tick are sane. A failure is a bug of whoever made the kernel, not of the user's program.

mod body;
mod declared;

use super::Kernel;
use std::fmt;

/// How many words a cell, a line, a table or the per-key constants may have.
pub const WORDS_MAX: u32 = 1 << 20;

/// How many instructions a tick of one key may run through.
pub const WORK_MAX: u64 = 1 << 24;

/// How deep regions may nest.
pub const DEPTH_MAX: usize = 64;

/// What is wrong with a kernel, and where.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VerifyError {
    /// The declaration or instruction as text.
    pub place: String,
    /// What is wrong.
    pub message: String,
}

impl fmt::Display for VerifyError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}: {}", self.place, self.message)
    }
}

impl std::error::Error for VerifyError {}

/// A kernel that passed the verifier.
#[derive(Debug, Clone, Copy)]
pub struct Verified<'a>(&'a Kernel);

impl<'a> Verified<'a> {
    /// The kernel.
    pub fn kernel(self) -> &'a Kernel {
        self.0
    }
}

/// Checks everything.
///
/// # Errors
/// All that is wrong, in the order of the text.
pub fn verify(kernel: &Kernel) -> Result<Verified<'_>, Vec<VerifyError>> {
    let mut errors = Vec::new();
    declared::check(kernel, &mut errors);
    body::check(kernel, &mut errors);
    if errors.is_empty() {
        Ok(Verified(kernel))
    } else {
        Err(errors)
    }
}
