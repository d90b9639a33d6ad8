//! Where code comes from: the declaration it was made for, and the calls of terms around it.

use crate::Span;

/// Why there is code.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Origin {
    /// The declaration or transition it was made for: `force contact`, `let squeeze`, `contact:
    /// flying -> touching`, `state jack.held`, or `instrument grand_piano` for what belongs to all
    /// of it.
    pub item: String,
    /// What exactly was written there.
    pub span: Span,
    /// The calls of terms inside which that stands, innermost first; the last is in an instrument.
    pub calls: Vec<Span>,
}
