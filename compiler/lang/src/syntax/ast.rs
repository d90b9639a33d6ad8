//! The tree that the parser builds: what the text says, before any meaning is given to it.
//!
//! Every node that a diagnostic may point at carries a [`Span`]. Names are plain strings; numbers
//! keep the unit as written, because the formatter prints it back and because rule 8 of the manual
//! makes number and unit one token.

mod part;

pub use part::BodyPart;

use whippen_source::Span;

/// A value together with the place it was read from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spanned<T> {
    /// What was read.
    pub node: T,
    /// Where it stands.
    pub span: Span,
}

/// A name as written.
pub type Name = Spanned<String>;

/// One source file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct File {
    /// The items in the order of the text.
    pub items: Vec<Item>,
}

/// What stands at the top level of a file.
#[derive(Debug, Clone, PartialEq)]
pub enum Item {
    /// `instrument name { .. }`
    Instrument(Instrument),
    /// `term name(..) -> .. { .. }`
    Term(Term),
    /// `keyboard name { .. }`
    Keyboard(Keyboard),
}

/// `instrument name { .. }`: one touch profile.
#[derive(Debug, Clone, PartialEq)]
pub struct Instrument {
    /// The `///` lines before it, without the slashes, joined by newlines.
    pub doc: String,
    /// Its name.
    pub name: Name,
    /// Its declarations in the order of the text.
    pub decls: Vec<Decl>,
    /// From the keyword to the closing brace.
    pub span: Span,
}

/// `term name(params) -> results { .. }`: a reusable piece with memory of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct Term {
    /// The `///` lines before it.
    pub doc: String,
    /// Its name.
    pub name: Name,
    /// What it is given: name and type.
    pub params: Vec<TypedName>,
    /// What it gives back: name and type.
    pub results: Vec<TypedName>,
    /// Its declarations; a result is defined by [`DeclKind::Result`].
    pub decls: Vec<Decl>,
    /// From the keyword to the closing brace.
    pub span: Span,
}

/// `name: type`, where the type is the name of a dimension (`length`, `force`, ..) or `bool`.
#[derive(Debug, Clone, PartialEq)]
pub struct TypedName {
    /// The name.
    pub name: Name,
    /// The name of its dimension, or `bool`.
    pub ty: Name,
}

/// `keyboard name { .. }`: instruments on a device.
#[derive(Debug, Clone, PartialEq)]
pub struct Keyboard {
    /// The `///` lines before it.
    pub doc: String,
    /// Its name.
    pub name: Name,
    /// Its settings in the order of the text.
    pub settings: Vec<Setting>,
    /// From the keyword to the closing brace.
    pub span: Span,
}

/// One line of a keyboard.
#[derive(Debug, Clone, PartialEq)]
pub enum Setting {
    /// `board rp2350`
    Board(Name),
    /// `device mikey`
    Device(Name),
    /// `device "file"`, without the quotes.
    DeviceFile(Name),
    /// `rate 44100 Hz`
    Rate(Expr),
    /// `keys A0 .. C8`, by note names.
    Keys(Name, Name),
    /// `programs a, b`
    Programs(Vec<Name>),
    /// `zones split = { A0 .. B3: a, C4 .. C8: b }`: a program whose keys play different
    /// instruments.
    Zones {
        /// The program.
        name: Name,
        /// Its zones in the order of the text.
        zones: Vec<Zone>,
        /// From the keyword to the closing brace.
        span: Span,
    },
    /// `instrument.param = { A0: v, C8: v }`, linear between the given notes.
    PerKey {
        /// The instrument.
        instrument: Name,
        /// Its parameter.
        param: Name,
        /// Note name and value, in the order of the text.
        points: Vec<(Name, Expr)>,
    },
}

/// `A0 .. B3: hammond`
#[derive(Debug, Clone, PartialEq)]
pub struct Zone {
    /// Its lowest key, by note name.
    pub low: Name,
    /// Its highest key.
    pub high: Name,
    /// What its keys play.
    pub instrument: Name,
}

/// A declaration inside an instrument or a term.
#[derive(Debug, Clone, PartialEq)]
pub struct Decl {
    /// What is declared.
    pub kind: DeclKind,
    /// The whole declaration.
    pub span: Span,
}

/// `a .. b`
#[derive(Debug, Clone, PartialEq)]
pub struct RangeExpr {
    /// Lower end.
    pub low: Expr,
    /// Upper end.
    pub high: Expr,
    /// The whole range.
    pub span: Span,
}

/// The kinds of declaration, one per keyword.
#[derive(Debug, Clone, PartialEq)]
pub enum DeclKind {
    /// `sense x: length in a .. b [slew v] [over w]`
    Sense {
        /// Name of the sensed value.
        name: Name,
        /// Its dimension.
        ty: Name,
        /// The range the program accepts.
        range: RangeExpr,
        /// Largest speed that is let through.
        slew: Option<Expr>,
        /// Window of the differentiators.
        over: Option<Expr>,
    },
    /// `[live] param p = v [in a .. b]`
    Param {
        /// Whether it may change while playing.
        live: bool,
        /// Its name.
        name: Name,
        /// Its value.
        value: Expr,
        /// Its bounds.
        range: Option<RangeExpr>,
    },
    /// `let name = expr`
    Let {
        /// Its name.
        name: Name,
        /// Its value.
        value: Expr,
    },
    /// `states label { a -> b when guard { .. } .. }`
    States {
        /// The machine.
        name: Name,
        /// Its transitions in the order of the text.
        transitions: Vec<Transition>,
    },
    /// `state name: type in a .. b [= init]`
    State {
        /// Its name.
        name: Name,
        /// Its dimension.
        ty: Name,
        /// Its range.
        range: RangeExpr,
        /// Its first value; zero if absent.
        init: Option<Expr>,
    },
    /// `next name = expr`
    Next {
        /// The state.
        name: Name,
        /// Its value in the next tick.
        value: Expr,
    },
    /// `body name { angle phi in .., rate in ..  inertia I  torque t .. }`
    Body {
        /// The body.
        name: Name,
        /// Its lines in the order of the text.
        parts: Vec<BodyPart>,
    },
    /// `event name when guard { .. }`, `event name every t { .. }`
    Event {
        /// The event.
        name: Name,
        /// When it happens.
        trigger: Trigger,
        /// What it does.
        actions: Vec<Action>,
    },
    /// `pulse name: type in a .. b lasting t`
    Pulse {
        /// Its name; also the name of its present value.
        name: Name,
        /// Its dimension.
        ty: Name,
        /// Its range.
        range: RangeExpr,
        /// How long it lasts.
        lasting: Expr,
    },
    /// `hold body when guard`
    Hold {
        /// The body.
        body: Name,
        /// While this holds.
        guard: Expr,
    },
    /// `force name [on sense] = expr`, `torque name [on sense] = expr`
    Force {
        /// `torque`, for what turns.
        turning: bool,
        /// Label of the term.
        name: Name,
        /// What is pushed; the first sense if it is left away.
        on: Option<Name>,
        /// Its value; positive pushes the key up.
        value: Expr,
    },
    /// `name = expr`: defines a result of a term.
    Result {
        /// The result.
        name: Name,
        /// Its value.
        value: Expr,
    },
}

/// When an event happens.
#[derive(Debug, Clone, PartialEq)]
pub enum Trigger {
    /// `when guard`: at the instant the guard becomes true.
    When(Expr),
    /// `every t`: again and again.
    Every(Expr),
}

impl Trigger {
    /// The guard or the period.
    pub fn expr(&self) -> &Expr {
        match self {
            Trigger::When(expr) | Trigger::Every(expr) => expr,
        }
    }
}

impl DeclKind {
    /// What it is, in the words of the language, and its name.
    pub fn label(&self) -> (&'static str, &Name) {
        match self {
            DeclKind::Sense { name, .. } => ("sense", name),
            DeclKind::Param { name, .. } => ("param", name),
            DeclKind::Let { name, .. } => ("let", name),
            DeclKind::States { name, .. } => ("states", name),
            DeclKind::State { name, .. } => ("state", name),
            DeclKind::Next { name, .. } => ("next", name),
            DeclKind::Body { name, .. } => ("body", name),
            DeclKind::Event { name, .. } => ("event", name),
            DeclKind::Pulse { name, .. } => ("pulse", name),
            DeclKind::Hold { body, .. } => ("hold", body),
            DeclKind::Force {
                turning: true,
                name,
                ..
            } => ("torque", name),
            DeclKind::Force { name, .. } => ("force", name),
            DeclKind::Result { name, .. } => ("result", name),
        }
    }
}

/// `from -> to when guard { actions }`
#[derive(Debug, Clone, PartialEq)]
pub struct Transition {
    /// State left.
    pub from: Name,
    /// State entered.
    pub to: Name,
    /// When.
    pub guard: Expr,
    /// What else happens.
    pub actions: Vec<Action>,
    /// The whole transition.
    pub span: Span,
}

/// What an event or a transition does.
#[derive(Debug, Clone, PartialEq)]
pub struct Action {
    /// The action.
    pub kind: ActionKind,
    /// Where it stands.
    pub span: Span,
}

/// The kinds of action.
#[derive(Debug, Clone, PartialEq)]
pub enum ActionKind {
    /// `emit name(arg: value, ..)`
    Emit {
        /// The event.
        name: Name,
        /// Its arguments, all named.
        args: Vec<(Name, Expr)>,
    },
    /// `name := expr`, or `name' := expr` for the rate of a coordinate.
    Write {
        /// The variable.
        name: Name,
        /// Whether its rate is meant.
        rate: bool,
        /// Its new value.
        value: Expr,
    },
    /// `fire pulse at expr`
    Fire {
        /// The pulse.
        pulse: Name,
        /// How strongly.
        value: Expr,
    },
}

/// An expression.
#[derive(Debug, Clone, PartialEq)]
pub struct Expr {
    /// What it is.
    pub kind: ExprKind,
    /// Where it stands.
    pub span: Span,
}

/// The kinds of expression.
#[derive(Debug, Clone, PartialEq)]
pub enum ExprKind {
    /// A number with or without a unit.
    Number(Number),
    /// `on` or `off`.
    Bool(bool),
    /// A name.
    Name(String),
    /// `base.field`: a result of a term.
    Field(Box<Expr>, Name),
    /// `callee(a, b, name: c)`: a term, or `min`, `max`, `clamp`, `abs`.
    Call(Name, Vec<Arg>),
    /// `e'`
    Prime(Box<Expr>),
    /// `-e`
    Neg(Box<Expr>),
    /// `not e`
    Not(Box<Expr>),
    /// `a op b`
    Binary(BinOp, Box<Expr>, Box<Expr>),
    /// `machine is state` (`negated`: `machine is not state`)
    Is {
        /// The machine.
        machine: Name,
        /// The state asked for.
        state: Name,
        /// Whether `not` stands before it.
        negated: bool,
    },
    /// `if c then a else b`
    If(Box<Expr>, Box<Expr>, Box<Expr>),
    /// Something that could not be read; a diagnostic has been given already.
    Error,
}

/// An argument of a call.
#[derive(Debug, Clone, PartialEq)]
pub struct Arg {
    /// The parameter's name, where it is given.
    pub name: Option<Name>,
    /// Its value.
    pub value: Expr,
}

/// A number as written.
#[derive(Debug, Clone, PartialEq)]
pub struct Number {
    /// The digits as written (`8e3`).
    pub text: String,
    /// Their value, in the unit as written.
    pub value: f64,
    /// The unit as written (`N*s/m`), if any.
    pub unit: Option<String>,
}

/// Binary operators.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BinOp {
    /// `+`
    Add,
    /// `-`
    Sub,
    /// `*`
    Mul,
    /// `/`
    Div,
    /// `^`
    Pow,
    /// `<`
    Lt,
    /// `<=`
    Le,
    /// `>`
    Gt,
    /// `>=`
    Ge,
    /// `and`
    And,
    /// `or`
    Or,
}
