//! Types and how they are put into words.

use crate::model::NodeId;
use crate::units::Dim;

/// What a value is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ty {
    /// A number with a dimension.
    Real(Dim),
    /// `on` or `off`.
    Bool,
}

impl Ty {
    /// Its dimension; `None` for a bool.
    pub fn dim(self) -> Option<Dim> {
        match self {
            Ty::Real(dim) => Some(dim),
            Ty::Bool => None,
        }
    }

    /// In words, with its unit: `a length (m)`, `a plain number`, `a bool`.
    pub fn words(self) -> String {
        match self {
            Ty::Bool => "a bool".to_string(),
            Ty::Real(dim) if dim.is_number() => "a plain number".to_string(),
            Ty::Real(dim) => match dim.name() {
                Some(name) => format!("{} ({dim})", with_article(&name.replace('_', " "))),
                None => format!("a value in {dim}"),
            },
        }
    }

    /// A unit its numbers may be written with; empty for plain numbers and bools.
    pub fn unit(self) -> String {
        self.dim().map(Dim::unit).unwrap_or_default()
    }
}

/// `a length`, `an inertia`.
pub fn with_article(noun: &str) -> String {
    let article = if noun.starts_with(['a', 'e', 'i', 'o', 'u']) {
        "an"
    } else {
        "a"
    };
    format!("{article} {noun}")
}

/// `1 argument`, `2 arguments`.
pub fn counted(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

/// A typed value in the graph.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Value {
    /// Its node.
    pub node: NodeId,
    /// Its type.
    pub ty: Ty,
}

impl Value {
    /// A number.
    pub fn real(node: NodeId, dim: Dim) -> Value {
        Value {
            node,
            ty: Ty::Real(dim),
        }
    }

    /// A bool.
    pub fn bool(node: NodeId) -> Value {
        Value { node, ty: Ty::Bool }
    }
}
