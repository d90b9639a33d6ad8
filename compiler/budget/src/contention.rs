//! A result by contention: for a core alone, and with everybody else at the banks.

/// One of each.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ByContention<T> {
    /// With nobody else at the bus.
    pub alone: T,
    /// With the other core at work, and with its own fetches in the way of its data.
    pub contended: T,
}

impl<T> ByContention<T> {
    /// Something made of each.
    pub fn map<U>(self, mut make: impl FnMut(T) -> U) -> ByContention<U> {
        ByContention {
            alone: make(self.alone),
            contended: make(self.contended),
        }
    }

    /// Each with the other's of the same contention.
    pub fn zip<U>(self, other: ByContention<U>) -> ByContention<(T, U)> {
        ByContention {
            alone: (self.alone, other.alone),
            contended: (self.contended, other.contended),
        }
    }
}

impl<T, E> ByContention<Result<T, E>> {
    /// Both.
    ///
    /// # Errors
    /// The first that failed.
    pub fn both(self) -> Result<ByContention<T>, E> {
        Ok(ByContention {
            alone: self.alone?,
            contended: self.contended?,
        })
    }
}
