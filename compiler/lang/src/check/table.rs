//! `table`: a value over another one, given at knots; read by `t(x)`.
//!
//! Knots are constants, which may be made of parameters: a table is made when it is first asked
//! for.

use std::sync::Arc;

use super::elaborate::Elaborator;
use super::scope::{Made, ScopeId, Thing};
use super::table_file::{self, FileRow};
use super::types::{Ty, Value, counted};
use crate::diag::{Code, Diagnostic};
use crate::model::Node;
use crate::model::curve::Curve;
use crate::model::table::{Head, Table};
use crate::syntax::ast::{Arg, DeclKind, Expr, Knots, Name};
use crate::units::shown;
use whippen_ids::impl_id;
use whippen_source::Span;

/// Index of a [`TableInfo`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TableId(pub u32);

impl_id!(TableId);

/// What is known of a table while it is elaborated.
#[derive(Debug, Clone)]
pub struct TableInfo<'a> {
    scope: ScopeId,
    head: Head,
    cubic: bool,
    knots: &'a Knots,
    made: MadeTable,
}

#[derive(Debug, Clone)]
enum MadeTable {
    Waiting,
    Running,
    Done(Option<Arc<Table>>),
}

/// A knot, and where it stands: its place, and its line in a file.
struct Knot {
    x: f64,
    value: f64,
    span: Span,
    line: Option<usize>,
}

impl<'a> Elaborator<'a, '_> {
    /// Enters a table.
    pub fn declare_table(&mut self, scope: ScopeId, kind: &'a DeclKind) -> Made {
        let DeclKind::Table {
            name,
            ty,
            over,
            cubic,
            knots,
        } = kind
        else {
            return Made::Nothing;
        };
        let hint = "tabulate 0 and 1, and compare";
        let dim = self.real_type(ty, "a table", hint);
        let over = self.real_type(over, "what a table is over", "write an `if`");
        let (Some(dim), Some(over)) = (dim, over) else {
            self.enter(scope, name, Thing::Broken);
            return Made::Nothing;
        };
        let head = Head {
            name: self.scopes[scope.0].full(&name.node),
            over,
            dim,
            span: name.span,
        };
        let id = self.tables.push(TableInfo {
            scope,
            head,
            cubic: *cubic,
            knots,
            made: MadeTable::Waiting,
        });
        self.enter(scope, name, Thing::Table(id));
        Made::Table(id)
    }

    /// The table; `None` where its declaration is in error.
    pub fn table(&mut self, id: TableId) -> Option<Arc<Table>> {
        match &self.tables[id].made {
            MadeTable::Done(table) => return table.clone(),
            MadeTable::Running => {
                self.knot_of_itself(id);
                return None;
            }
            MadeTable::Waiting => {}
        }
        self.tables[id].made = MadeTable::Running;
        let table = self.made_table(id).map(Arc::new);
        self.tables[id].made = MadeTable::Done(table.clone());
        table
    }

    fn knot_of_itself(&mut self, id: TableId) {
        let Head { name, span, .. } = &self.tables[id].head;
        let message = format!("a knot of `{name}` is made of `{name}`");
        let diagnostic = Diagnostic::new(Code::Circle, *span, message, "needs its own value");
        self.report(diagnostic.hint("give its knots as numbers and parameters"));
    }

    fn made_table(&mut self, id: TableId) -> Option<Table> {
        let TableInfo {
            scope,
            head,
            cubic,
            knots,
            ..
        } = self.tables[id].clone();
        let knots = match knots {
            Knots::Listed(all) => self.listed(scope, &head, all)?,
            Knots::File(file) => self.read_rows(&head, file)?,
        };
        self.check_knots(&head, &knots)?;
        let pairs: Vec<(f64, f64)> = knots.iter().map(|knot| (knot.x, knot.value)).collect();
        let span = head.span;
        let table = Table::new(head, &pairs, cubic);
        if table.is_none() {
            let message = "two knots of this table are too near to each other for a slope";
            let diagnostic = Diagnostic::new(Code::TableKnots, span, message, "this table");
            self.report(diagnostic.hint("leave out one of them"));
        }
        table
    }

    fn listed(
        &mut self,
        scope: ScopeId,
        head: &Head,
        all: &'a [(Expr, Expr)],
    ) -> Option<Vec<Knot>> {
        let (place, what) = (
            format!("the place of a knot of `{}`", head.name),
            format!("the value of a knot of `{}`", head.name),
        );
        let mut knots = Vec::new();
        let mut lost = false;
        for (x, value) in all {
            let span = x.span.to(value.span);
            let x = self.constant(scope, x, head.over, &place);
            let value = self.constant(scope, value, head.dim, &what);
            let (Some(x), Some(value)) = (x, value) else {
                lost = true;
                continue;
            };
            let line = None;
            knots.push(Knot {
                x,
                value,
                span,
                line,
            });
        }
        (!lost).then_some(knots)
    }

    fn read_rows(&mut self, head: &Head, file: &Name) -> Option<Vec<Knot>> {
        let key = (file.span.file, file.node.clone());
        let read = self.items.table_files.get(&key);
        let rows = match read {
            Some(Ok(text)) => table_file::rows(text, head.over, head.dim),
            Some(Err(why)) => Err(format!("cannot be read: {why}")),
            None => Err("cannot be read".to_string()),
        };
        match rows {
            Ok(rows) => {
                let knot = |(line, x, value): FileRow| Knot {
                    x,
                    value,
                    span: file.span,
                    line: Some(line),
                };
                Some(rows.into_iter().map(knot).collect())
            }
            Err(why) => {
                let message = format!("`{}` {why}", file.node);
                let diagnostic = Diagnostic::new(Code::TableFile, file.span, message, "this file");
                self.report(diagnostic.hint(
                    "a table's file stands relative to the program; its first line holds titles \
                     with units, such as `x_mm,force_gf`, and each line below is a knot",
                ));
                None
            }
        }
    }

    /// At least two knots, rising.
    fn check_knots(&mut self, head: &Head, knots: &[Knot]) -> Option<()> {
        if !(Table::KNOTS_MIN..=Table::KNOTS_MAX).contains(&knots.len()) {
            let message = format!(
                "the table `{}` has {}, and it must have {} to {}",
                head.name,
                counted(knots.len(), "knot"),
                Table::KNOTS_MIN,
                Table::KNOTS_MAX
            );
            let diagnostic = Diagnostic::new(Code::TableKnots, head.span, message, "this table");
            self.report(diagnostic.hint("write `{ x: value, x: value }`"));
            return None;
        }
        let falls = |two: &&[Knot]| two[0].x >= two[1].x;
        let Some([before, knot]) = knots.windows(2).find(falls) else {
            return Some(());
        };
        let at = |knot: &Knot| {
            let line = knot
                .line
                .map_or(String::new(), |line| format!(" (line {line})"));
            format!("{}{line}", shown(knot.x, head.over))
        };
        let message = format!(
            "the knots of `{}` must rise: {} is not above {}",
            head.name,
            at(knot),
            at(before)
        );
        let mut diagnostic = Diagnostic::new(Code::TableKnots, knot.span, message, "does not rise");
        if knot.span != before.span {
            diagnostic = diagnostic.also(before.span, "the knot before");
        }
        self.report(diagnostic.hint("sort the knots, and keep one of those at the same place"));
        None
    }

    /// The table that a callee names.
    pub fn table_of(&self, scope: ScopeId, callee: &Name) -> Option<TableId> {
        match self.find(scope, &callee.node)?.thing {
            Thing::Table(table) => Some(table),
            _ => None,
        }
    }

    /// `t(x)`
    pub fn table_at(
        &mut self,
        scope: ScopeId,
        id: TableId,
        callee: &Name,
        args: &'a [Arg],
        span: Span,
    ) -> Option<Value> {
        let Head { over, dim, .. } = self.tables[id].head;
        let [Arg { name: None, value }] = args else {
            let message = format!(
                "`{}` is a table, which is read at one place, not with {}",
                callee.node,
                counted(args.len(), "argument")
            );
            let (label, hint) = ("where?", format!("write `{}(place)`", callee.node));
            self.report(Diagnostic::new(Code::MissingArgument, span, message, label).hint(hint));
            return None;
        };
        let found = self.expr(scope, value);
        let table = self.table(id);
        let x = self.expect(found?, value, Ty::Real(over), || {
            format!("where the table `{}` is read", callee.node)
        })?;
        let node = self.node(Node::Curve(Curve::of_table(table?), x), span);
        Some(Value::real(node, dim))
    }

    /// Reports a table that stands where a value does.
    pub fn table_as_value(&mut self, name: &str, span: Span) {
        let message = format!("`{name}` is a table, not a value");
        let diagnostic = Diagnostic::new(Code::WrongType, span, message, "where?");
        self.report(diagnostic.hint(format!("write `{name}(place)`: its value there")));
    }
}
