//! The tree that the parser builds: what the text says, before any meaning is given to it.
//!
//! Every node that a diagnostic may point at carries a [`Span`]. Names are plain strings; numbers
//! keep the unit as written, because the formatter prints it back and because rule 8 of the manual
//! makes number and unit one token.

mod expr;
mod keyboard;
mod part;

pub use expr::{Arg, BinOp, Expr, ExprKind, Number};
pub use keyboard::{Keyboard, Setting, Zone};
pub use part::{BodyPart, StringPart};

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
    /// `[live] param p = v [in a .. b] [glide t]`
    Param {
        /// Whether it may change while playing.
        live: bool,
        /// Its name.
        name: Name,
        /// Its value.
        value: Expr,
        /// Its bounds.
        range: Option<RangeExpr>,
        /// How long it takes to move over its whole range.
        glide: Option<Expr>,
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
    /// `noise name`
    Noise {
        /// Its name.
        name: Name,
    },
    /// `delay name: type in a .. b lasting t`
    Delay {
        /// Its name; `name(t)` is what was fed `t` ago.
        name: Name,
        /// Dimension of what is fed.
        ty: Name,
        /// Range of what is fed.
        range: RangeExpr,
        /// The longest time ago.
        lasting: Expr,
    },
    /// `table name: type over type [cubic] { knot, .. }`, or `from "file.csv"`
    Table {
        /// Its name; `name(x)` is its value at `x`.
        name: Name,
        /// Dimension of its values.
        ty: Name,
        /// Dimension of what it is over.
        over: Name,
        /// Whether it is smooth.
        cubic: bool,
        /// What it goes through.
        knots: Knots,
    },
    /// `feed delay = expr`
    Feed {
        /// The delay.
        delay: Name,
        /// What goes into it in every tick.
        value: Expr,
    },
    /// `sound label [on left|right] = expr`
    Sound {
        /// Label of the term.
        name: Name,
        /// The channel; all if absent.
        side: Option<Name>,
        /// Its value: -1 .. 1 is full scale.
        value: Expr,
    },
    /// `string name along a .. b { position u in .., rate in ..  density r  load l .. }`
    String {
        /// The string.
        name: Name,
        /// Its ends, as places.
        along: RangeExpr,
        /// Its lines in the order of the text.
        parts: Vec<StringPart>,
    },
    /// `bank name over i in 0 .. n { .. }`: its declarations, once for each member.
    Bank {
        /// Its name.
        name: Name,
        /// The name of a member's number.
        index: Name,
        /// The numbers of its members.
        range: RangeExpr,
        /// What each member declares.
        decls: Vec<Decl>,
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

/// What a table goes through.
#[derive(Debug, Clone, PartialEq)]
pub enum Knots {
    /// `{ x: value, .. }`
    Listed(Vec<(Expr, Expr)>),
    /// `from "file.csv"`, the name without its quotes.
    File(Name),
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
            DeclKind::Noise { name } => ("noise", name),
            DeclKind::Delay { name, .. } => ("delay", name),
            DeclKind::Table { name, .. } => ("table", name),
            DeclKind::Feed { delay, .. } => ("feed", delay),
            DeclKind::Sound { name, .. } => ("sound", name),
            DeclKind::String { name, .. } => ("string", name),
            DeclKind::Bank { name, .. } => ("bank", name),
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
