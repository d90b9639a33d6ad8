//! The table of diagnostics. WH01xx text, WH02xx names, WH03xx types and dimensions, WH04xx motion and causality,
//! WH05xx ranges and numbers, WH06xx physics and keyboards.

/// How bad a diagnostic is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// Worth knowing.
    Note,
    /// Surely not meant.
    Warning,
    /// The program has no meaning.
    Error,
}

macro_rules! codes {
    ($($name:ident $number:literal $severity:ident $title:literal;)*) => {
        /// A diagnostic's code.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Code { $(#[doc = $title] $name,)* }

        impl Code {
            /// All codes, in the order of the table.
            pub const ALL: &'static [Code] = &[$(Code::$name,)*];

            /// The code as printed (`WH0101`).
            pub fn number(self) -> &'static str {
                match self { $(Code::$name => $number,)* }
            }

            /// How bad it is.
            pub fn severity(self) -> Severity {
                match self { $(Code::$name => Severity::$severity,)* }
            }

            /// What it is about, in a few words.
            pub fn title(self) -> &'static str {
                match self { $(Code::$name => $title,)* }
            }
        }
    };
}

codes! {
    // Text
    UnexpectedCharacter "WH0101" Error "a character that belongs to no token";
    UnexpectedToken     "WH0102" Error "something else was expected here";
    UnknownUnit         "WH0103" Error "a number is followed by a word that is no unit";
    MissingTimes        "WH0104" Error "a `*` is missing between a number and a name";
    BadNumber           "WH0105" Error "a number that cannot be read";
    UnclosedBlock       "WH0106" Error "a bracket that is never closed";
    TooDeep             "WH0107" Error "something nested too deeply to be read";
    // Names
    UnknownName         "WH0201" Error "a name that is declared nowhere";
    // Ranges and numbers
    Unbounded           "WH0501" Error "a value whose range cannot be bounded";
    DivisionByZero      "WH0502" Error "a division whose divisor may be zero";
    NegativePower       "WH0504" Error "a half-integer power of a value that may be negative";
    InitOutOfRange      "WH0503" Error "an initial value outside its range";
}
