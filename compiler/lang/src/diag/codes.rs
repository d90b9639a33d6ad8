//! The table of diagnostics. WH01xx text, WH02xx names, WH03xx types and dimensions, WH04xx motion
//! and causality, WH05xx ranges and numbers, WH06xx physics and keyboards, WH07xx budgets.

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

            /// Its page: what it means, a program that has the mistake, and the program without it
            /// (Markdown).
            pub fn page(self) -> &'static str {
                match self { $(Code::$name => include_str!(concat!("pages/", $number, ".md")),)* }
            }

            /// The name of its variant.
            pub(super) fn variant(self) -> &'static str {
                match self { $(Code::$name => stringify!($name),)* }
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
    DuplicateName       "WH0202" Error "a name that is declared twice";
    UnknownTerm         "WH0203" Error "a call of a term that is declared nowhere";
    UnknownType         "WH0204" Error "a type that is neither a dimension nor `bool`";
    UnknownMachine      "WH0205" Error "a machine that is declared nowhere";
    UnknownState        "WH0206" Error "a state its machine does not have";
    UnknownBody         "WH0207" Error "a body that is declared nowhere";
    UnknownResult       "WH0208" Error "a result its term does not have";
    UnknownArgument     "WH0209" Error "an argument that belongs to no parameter";
    MissingArgument     "WH0210" Error "a parameter without argument";
    ExtraArgument       "WH0211" Error "more arguments than parameters";
    RepeatedArgument    "WH0212" Error "two arguments for one parameter";
    MissingResult       "WH0213" Error "a result that its term never defines";
    NotAResult          "WH0214" Error "a definition without keyword that defines no result";
    NotInTerm           "WH0215" Error "a declaration that has no place in a term";
    RecursiveTerm       "WH0216" Error "a term that calls itself";
    TooManyCalls        "WH0217" Error "more calls of terms than can be followed";
    TooManySteps        "WH0218" Error "values that use each other through too many steps";
    HidesStd            "WH0219" Warning "a term that hides one of the standard library";
    UnknownInstrument   "WH0220" Error "an instrument that is declared nowhere";
    UnknownParam        "WH0221" Error "a parameter its instrument does not have";
    // Types and dimensions
    Mismatch            "WH0301" Error "operands of different dimensions";
    WrongType           "WH0302" Error "a value of another type than the place needs";
    MissingUnit         "WH0303" Error "a number without unit where a dimension is needed";
    SeveralResults      "WH0304" Error "a call with several results where one value is needed";
    NoResults           "WH0305" Error "a result asked of something that is no call";
    BadExponent         "WH0306" Error "an exponent other than 1, 1.5, 2, 2.5 and 3";
    FractionalDim       "WH0307" Error "a power whose dimension is not whole";
    NotConstant         "WH0308" Error "a value that changes where a constant is needed";
    NotFinite           "WH0309" Error "a constant that is not a finite number";
    DubiousUnit         "WH0310" Warning "a unit of the right dimension that is surely not meant";
    // Motion and causality
    Circle              "WH0401" Error "a value that depends on itself within one tick";
    NoPrime             "WH0402" Error "a value that has no time derivative";
    PrimeOfComparison   "WH0403" Error "the prime of a choice that compares values";
    JumpOfMode          "WH0404" Note "the prime of a choice by mode leaves out the jump";
    NotWritable         "WH0405" Error "a write to something that cannot be written";
    NextOfOther         "WH0406" Error "a next value of something that is no `state`";
    TwoNexts            "WH0407" Error "two next values of one `state`";
    FireOfOther         "WH0408" Error "something fired that is no pulse";
    TwoWriters          "WH0409" Warning "two writers of one variable in one tick";
    EmptyMachine        "WH0410" Error "a machine without transitions";
    UnreachableState    "WH0411" Warning "a state that is never entered";
    IdleStep            "WH0412" Warning "a step of a machine that does nothing";
    NeverHolds          "WH0413" Warning "a guard that never holds";
    AlwaysHolds         "WH0414" Warning "a guard that always holds";
    OverlappingGuards   "WH0415" Warning "two transitions of one state whose guards can hold together";
    Period              "WH0416" Error "an event with a period of less than two ticks, or of too many";
    FrictionSlope       "WH0417" Error "a friction whose law has no derivative by its slip";
    Feed                "WH0418" Error "a delay line that is not fed exactly once";
    DelayLine           "WH0419" Error "a delay line that is too short or too long";
    Glide               "WH0420" Error "a glide of something that nobody moves";
    StringPart          "WH0421" Error "a string that lacks or repeats one of its lines";
    StringLoad          "WH0422" Error "a load that is no sum of what bends and moves a string";
    StringPoints        "WH0423" Error "a number of points that no string has";
    StringEnds          "WH0424" Error "ends of a string that are neither pinned nor clamped";
    StringTuned         "WH0425" Error "a tension that a string cannot be tuned by";
    AllAlong            "WH0426" Error "what a string has all along where one value is needed";
    BankRange           "WH0427" Error "a bank whose members cannot be counted";
    InBank              "WH0428" Error "what a bank cannot hold, or its members cannot write";
    OtherMember         "WH0429" Error "a member of a bank that reads the members";
    // Ranges and numbers
    Unbounded           "WH0501" Error "a value whose range cannot be bounded";
    DivisionByZero      "WH0502" Error "a division whose divisor may be zero";
    NegativePower       "WH0504" Error "a half-integer power or square root of a value that may be negative";
    InitOutOfRange      "WH0503" Error "an initial value outside its range";
    EmptyRange          "WH0505" Error "a range whose ends leave nothing between them";
    MissingRange        "WH0506" Error "a live parameter without range";
    OutOfRange          "WH0507" Error "a parameter's value outside its range";
    PulseWithoutZero    "WH0508" Error "a pulse whose range does not hold zero";
    NotPositive         "WH0509" Error "a constant that must be above zero";
    WindowTooLong       "WH0510" Error "a differentiator's window that is too long";
    RangeTooSmall       "WH0511" Warning "a range that cuts off what is written to its state";
    LostUpdate          "WH0512" Warning "changes of what is kept that may be too small for its last bit";
    OutsideDomain       "WH0513" Error "a logarithm of a value that may be zero or negative";
    FrictionSign        "WH0514" Error "a friction that may push";
    OutsideDelay        "WH0515" Error "a time that a delay line may not hold";
    OutsideString       "WH0516" Error "a place outside of its string";
    StringSign          "WH0517" Error "a string with a tension, a stiffness, losses or a density that may be negative";
    UnstableString      "WH0518" Error "a string that its number of points makes unstable";
    BeyondKnots         "WH0530" Warning "a table that is read beyond its knots";
    TableKnots          "WH0531" Error "a table whose knots do not rise, or are too few or too many";
    TableFile           "WH0532" Error "a table's file that cannot be used";
    // Physics and keyboards
    WrongDrive          "WH0610" Error "a force or a torque on what it cannot push";
    BodyPart            "WH0601" Error "a body that lacks or repeats one of its lines";
    BodyMotion          "WH0602" Error "a line of a body that does not fit its coordinate";
    UnknownNote         "WH0603" Error "a note that does not exist";
    MissingSetting      "WH0604" Error "a setting that a keyboard needs";
    RepeatedSetting     "WH0605" Error "a setting that is given twice";
    BadRate             "WH0606" Error "a rate that is too low or too high";
    SenseMismatch       "WH0607" Error "programs of one keyboard that sense differently";
    TwoKeyboards        "WH0608" Note "an instrument that several keyboards list";
    BadSetting          "WH0609" Error "a value given to `--set` that cannot be read";
    NoForce             "WH0611" Warning "an instrument without any force";
    ZoneGap             "WH0612" Error "a key that is in no zone";
    ZoneOverlap         "WH0613" Error "a key that is in two zones";
    ZoneOutside         "WH0614" Error "a zone beyond the keys";
    ZonesName           "WH0615" Error "zones with the name of an instrument";
    UnusedZones         "WH0616" Warning "zones that are no program";
    NoPort              "WH0617" Error "ports that no key has";
    UnknownHardware     "WH0618" Error "a board or a device that is not bundled, or a number of chips that cannot be";
    ShortWindow         "WH0619" Warning "a window shorter than three measurements";
    Channel             "WH0620" Error "a sound on a side that is neither left nor right";
    NearEnd             "WH0621" Warning "a place nearer to an end of a string than its points tell";
    Each                "WH0622" Error "values for each member of a bank, and not as many as members";
    Member              "WH0623" Error "what a bank does not have";
    // Budgets
    DeadlineMissed      "WH0701" Error "a deadline that is missed";
    Unstable            "WH0702" Warning "a force that makes the loop of key, hand and program ring";
    TooStrong           "WH0703" Warning "more force for ever than the motor is rated for";
    NotProvenStable     "WH0704" Note "a force that is not proven stable, though nothing is seen to ring";
}
