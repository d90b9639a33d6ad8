//! Ids of what a keyboard has.

use std::fmt;
use whippen_ids::impl_id;

macro_rules! ids {
    ($($(#[$doc:meta])* $name:ident;)*) => {$(
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $name(
            /// The number, counted from 0.
            pub u32,
        );

        impl_id!($name);

        impl $name {
            /// The number, for lists of those who know nothing of keyboards.
            pub fn index(self) -> usize {
                whippen_ids::Id::index(self)
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.fmt(f)
            }
        }
    )*};
}

ids! {
    /// An instrument, by its place in the list that comes with a [`Layout`](crate::Layout).
    InstrumentId;
    /// A program of a keyboard, by its place in the layout.
    ProgramId;
    /// A zone of a program, by rising key.
    ZoneId;
    /// A core of a board.
    CoreId;
}
