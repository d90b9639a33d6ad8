//! `bank b over i in 0 .. n { .. }`: declarations that stand once for each member.
//!
//! A member is a scope of its own inside of the scope around the bank: it sees what is around it
//! and what it declares, and the other members do not see it. From outside its values are read by
//! `b[2].x`, and those of all members together by `sum(b.x)`, `max(b.x)` and `min(b.x)`.

use super::builtin::Builtin;
use super::elaborate::Elaborator;
use super::scope::{Entry, Made, NameEntry, Scope, ScopeId, Thing};
use super::types::{Ty, Value, counted};
use crate::diag::{Advice, Code, Diagnostic, nearest};
use crate::model::{MachineId, Node};
use crate::syntax::ast::{Arg, Decl, DeclKind, Expr, ExprKind, Name, RangeExpr};
use crate::units::Dim;
use whippen_source::Span;

/// The most members of a bank.
const MEMBERS_MAX: usize = 64;

/// Index of a [`Bank`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BankId(usize);

/// A bank.
pub struct Bank {
    /// Its full name.
    name: String,
    /// Where it is declared.
    span: Span,
    /// The scopes of its members; empty if it is in error.
    members: Vec<ScopeId>,
}

/// What makes a scope a member of a bank.
#[derive(Debug, Clone, Copy)]
pub struct Member {
    /// The scope around the bank.
    pub outer: ScopeId,
    /// Which bank.
    pub bank: BankId,
    /// Which member.
    pub number: usize,
}

/// A value that is made of members of a bank, and where it reads them.
pub type BankRead = (BankId, Span);

/// How many members a bank with this range has.
pub fn count(range: &RangeExpr) -> Option<usize> {
    let whole = |expr: &Expr| match &expr.kind {
        ExprKind::Number(number) if number.unit.is_none() && number.value.fract() == 0.0 => {
            Some(number.value)
        }
        _ => None,
    };
    let last = whole(&range.high).filter(|_| whole(&range.low) == Some(0.0))?;
    (last < MEMBERS_MAX as f64).then_some(last as usize + 1)
}

impl<'a> Elaborator<'a, '_> {
    /// What a name stands for in a scope, or around the bank that it is a member of.
    pub fn find(&self, scope: ScopeId, name: &str) -> Option<Entry> {
        let here = &self.scopes[scope.0];
        let own = here.values.get(name).copied();
        own.or_else(|| self.find(here.member?.outer, name))
    }

    /// The machine of that name in a scope, or around the bank that it is a member of.
    pub fn machine(&self, scope: ScopeId, name: &str) -> Option<NameEntry<MachineId>> {
        let here = &self.scopes[scope.0];
        let own = here.machines.get(name).copied();
        own.or_else(|| self.machine(here.member?.outer, name))
    }

    /// What a name that is written stands for: a member of a bank writes what it declares itself.
    pub fn lookup_written(&mut self, scope: ScopeId, name: &Name) -> Option<Entry> {
        let entry = self.lookup(scope, &name.node, name.span)?;
        let here = &self.scopes[scope.0];
        if here.member.is_none() || here.values.contains_key(name.node.as_str()) {
            return Some(entry);
        }
        let message = format!("a member of a bank cannot write `{}`", name.node);
        self.report(
            Diagnostic::new(
                Code::InBank,
                name.span,
                message,
                "stands outside of the bank",
            )
            .also(entry.span, "declared here")
            .hint("declare it in the bank, or write it outside, from a value of the members"),
        );
        None
    }

    /// The innermost member of a bank that a scope belongs to, through the calls of terms.
    pub fn member_around(&self, scope: ScopeId) -> Option<Member> {
        let here = &self.scopes[scope.0];
        let around = || self.member_around(here.caller?.scope);
        here.member.or_else(around)
    }

    /// Reports what cannot stand in a bank; none where the scope is no member of one.
    pub fn not_in_a_bank(&mut self, scope: ScopeId, kind: &'a DeclKind) -> Option<Made> {
        self.scopes[scope.0].member?;
        let (word, name) = kind.label();
        let hint = match kind {
            DeclKind::Bank { .. } => "a bank stands in an instrument or a term",
            DeclKind::Sense { .. } => "sense it outside: all members see it",
            DeclKind::Result { .. } => "write `let` in the bank, and give back `sum(bank.value)`",
            DeclKind::Force { .. } | DeclKind::Sound { .. } => {
                "give its value a name with `let`, and add those of all members outside: `sum(bank.value)`"
            }
            _ => return None,
        };
        let message = format!("a `{word}` cannot be declared in a bank");
        let label = "belongs outside of the bank";
        self.report(Diagnostic::new(Code::InBank, name.span, message, label).hint(hint));
        if matches!(kind, DeclKind::Sense { .. } | DeclKind::Bank { .. }) {
            self.enter(scope, name, Thing::Broken);
        }
        Some(Made::Nothing)
    }

    /// Enters a bank.
    pub fn declare_bank(&mut self, scope: ScopeId, name: &'a Name) -> Made {
        if self.member_around(scope).is_some() {
            let message = "a bank cannot stand in a bank";
            let label = "belongs outside of the bank";
            self.report(
                Diagnostic::new(Code::InBank, name.span, message, label)
                    .hint("a term that is called in a bank has none of its own, either"),
            );
            self.enter(scope, name, Thing::Broken);
            return Made::Nothing;
        }
        let bank = BankId(self.banks.len());
        self.banks.push(Bank {
            name: self.scopes[scope.0].full(&name.node),
            span: name.span,
            members: Vec::new(),
        });
        self.enter(scope, name, Thing::Bank(bank));
        Made::Bank(bank)
    }

    /// Makes the scopes of its members.
    pub fn members(&mut self, scope: ScopeId, decl: &'a Decl, bank: BankId) -> Vec<ScopeId> {
        let DeclKind::Bank {
            index,
            range,
            decls,
            ..
        } = &decl.kind
        else {
            return Vec::new();
        };
        let Some(count) = count(range) else {
            self.not_counted(range);
            return Vec::new();
        };
        for number in 0..count {
            let member = Member {
                outer: scope,
                bank,
                number,
            };
            let made = self.instantiate_member(member, index, decls);
            self.banks[bank.0].members.push(made);
        }
        self.banks[bank.0].members.clone()
    }

    fn not_counted(&mut self, range: &RangeExpr) {
        let broken = |expr: &Expr| matches!(expr.kind, ExprKind::Error);
        if broken(&range.low) || broken(&range.high) {
            return;
        }
        let message = format!("a bank has 1 to {MEMBERS_MAX} members, counted from 0");
        let hint = "write two whole numbers, the first of them 0: `over i in 0 .. 3` for four";
        let label = "does not count them";
        self.report(Diagnostic::new(Code::BankRange, range.span, message, label).hint(hint));
    }

    fn instantiate_member(
        &mut self,
        member: Member,
        index: &'a Name,
        decls: &'a [Decl],
    ) -> ScopeId {
        let outer = &self.scopes[member.outer.0];
        let bank = &self.banks[member.bank.0].name;
        let path = format!("{bank}[{}].", member.number);
        let mut scope = Scope::new(path, decls, outer.term, outer.caller);
        scope.call = outer.call;
        scope.member = Some(member);
        let id = ScopeId(self.scopes.len());
        self.scopes.push(scope);
        let before = self.here.replace(id);
        let node = self.model.dag.constant(member.number as f64);
        self.mark(index.span);
        self.enter(id, index, Thing::Number(Value::real(node, Dim::NUMBER)));
        self.declare_all(id);
        self.here = before;
        id
    }

    /// Reports a declaration of a member that reads members of its bank.
    pub fn check_reads(&mut self, scope: ScopeId, decl: &Decl) {
        let reads = std::mem::take(&mut self.reads);
        let Some(member) = self.member_around(scope) else {
            return;
        };
        if let Some((_, span)) = reads.iter().find(|(bank, _)| *bank == member.bank) {
            let name = &self.banks[member.bank.0].name;
            let message = format!("the members of `{name}` do not see each other");
            let label = "read by a member";
            let diagnostic = Diagnostic::new(Code::OtherMember, *span, message, label);
            let diagnostic = match *span {
                span if span.start >= decl.span.start && span.end <= decl.span.end => diagnostic,
                _ => diagnostic.also(decl.span, "by way of this"),
            };
            self.report(diagnostic.hint(
                "a `state` outside of the bank keeps the value of the tick before, for all of them",
            ));
        }
    }

    /// `each(a, b, ..)`: the member's own.
    pub fn each(&mut self, scope: ScopeId, args: &'a [Arg], span: Span) -> Option<Value> {
        let Some(member) = self.scopes[scope.0].member else {
            let message = "`each` chooses a value for a member of a bank";
            let label = "stands in no bank";
            let hint = "write it in a `bank`; a term is given the value as a parameter";
            self.report(Diagnostic::new(Code::Each, span, message, label).hint(hint));
            return None;
        };
        if let Some(name) = args.iter().find_map(|arg| arg.name.as_ref()) {
            let message = "`each` takes its arguments by position";
            let diagnostic =
                Diagnostic::new(Code::UnknownArgument, name.span, message, "no names here");
            self.report(diagnostic.hint("write `each(a, b)`"));
            return None;
        }
        let members = self.banks[member.bank.0].members.len();
        if args.len() != members {
            let given = counted(args.len(), "value");
            let message = format!(
                "`each` needs a value for each of {}, and here {} {given}",
                counted(members, "member"),
                if args.len() == 1 { "is" } else { "are" },
            );
            let also = self.banks[member.bank.0].span;
            self.report(
                Diagnostic::new(Code::Each, span, message, given)
                    .also(also, "the bank")
                    .hint("give one for each member, in their order"),
            );
            return None;
        }
        let own = &args[member.number].value;
        let value = self.expr(scope, own)?;
        match self.eaches.get(&span) {
            None => drop(self.eaches.insert(span, (value.ty, own.span))),
            Some((ty, _)) if *ty == value.ty => {}
            Some((ty, first)) => {
                let message = format!(
                    "`each` gives {} to one member and {} to another",
                    ty.words(),
                    value.ty.words()
                );
                let diagnostic =
                    Diagnostic::new(Code::WrongType, own.span, message, value.ty.words())
                        .also(*first, ty.words())
                        .hint("give all members values of one type");
                self.report(diagnostic);
                return None;
            }
        }
        Some(value)
    }

    /// The bank that the argument of `sum`, `max` or `min` reads, with what it reads of each
    /// member.
    pub fn reduced_bank(&self, scope: ScopeId, args: &'a [Arg]) -> Option<(BankId, Vec<&'a Name>)> {
        let [Arg { name: None, value }] = args else {
            return None;
        };
        let (mut base, mut path) = (value, Vec::new());
        while let ExprKind::Field(inner, field) = &base.kind {
            path.insert(0, field);
            base = inner;
        }
        match (&base.kind, path.len()) {
            (ExprKind::Name(name), 1 | 2) => match self.find(scope, name)?.thing {
                Thing::Bank(bank) => Some((bank, path)),
                _ => None,
            },
            _ => None,
        }
    }

    /// `sum(b.x)`, `max(b.x)`, `min(b.x)`: in the order of the members.
    pub fn reduced(
        &mut self,
        function: Builtin,
        (bank, path): (BankId, Vec<&'a Name>),
        arg: &'a Expr,
    ) -> Option<Value> {
        self.reads.push((bank, arg.span));
        let mut values = Vec::new();
        for member in self.banks[bank.0].members.clone() {
            values.push((member, self.member_value(member, &path)?));
        }
        let dim = self.real(values.first()?.1, arg, "this needs")?;
        let mut values = values.into_iter().map(|(_, value)| value.node);
        let first = values.next()?;
        let node = values.fold(first, |all, own| {
            let node = match function {
                Builtin::Max => Node::Max(all, own),
                Builtin::Min => Node::Min(all, own),
                _ => Node::Add(all, own),
            };
            self.node(node, arg.span)
        });
        Some(Value::real(node, dim))
    }

    /// A `sum` of something else.
    pub fn nothing_to_add(&mut self, scope: ScopeId, args: &'a [Arg], span: Span) -> Option<Value> {
        let broken = |expr: &Expr| match &expr.kind {
            ExprKind::Error => true,
            ExprKind::Field(base, _) => match &base.kind {
                ExprKind::Name(name) => {
                    let thing = self.find(scope, name).map(|entry| entry.thing);
                    matches!(thing, Some(Thing::Broken))
                }
                _ => false,
            },
            _ => false,
        };
        if !args.iter().any(|arg| broken(&arg.value)) {
            let message = "`sum` adds a value of all members of a bank";
            let label = "no value of a bank";
            let hint = "write `sum(bank.value)`; other values are added with `+`";
            self.report(Diagnostic::new(Code::Member, span, message, label).hint(hint));
        }
        None
    }

    /// The member that `b[2]` means.
    pub fn member(&mut self, scope: ScopeId, base: &'a Expr, index: &'a Expr) -> Option<ScopeId> {
        let found = match &base.kind {
            ExprKind::Name(name) => self.find(scope, name).map(|entry| entry.thing),
            _ => None,
        };
        let bank = match found {
            Some(Thing::Bank(bank)) => bank,
            Some(Thing::Broken) => return None,
            _ => {
                self.expr(scope, base)?;
                let message = "only a bank has members";
                let hint = "declare `bank name over i in 0 .. 3 { .. }`";
                let diagnostic = Diagnostic::new(Code::Member, base.span, message, "no bank");
                self.report(diagnostic.hint(hint));
                return None;
            }
        };
        self.reads.push((bank, base.span.to(index.span)));
        let number = self.constant(scope, index, Dim::NUMBER, "the number of a member")?;
        let members = &self.banks[bank.0].members;
        let found = (number >= 0.0 && number.fract() == 0.0)
            .then(|| members.get(number as usize).copied())
            .flatten();
        if found.is_none() && !members.is_empty() {
            let (name, last) = (&self.banks[bank.0].name, members.len() - 1);
            let message = format!("the bank `{name}` has no member {number}");
            let label = "no such member";
            let also = self.banks[bank.0].span;
            self.report(
                Diagnostic::new(Code::Member, index.span, message, label)
                    .also(also, format!("its members are 0 to {last}"))
                    .hint("choose one of its members"),
            );
        }
        found
    }

    /// A value that a member declares, or a result of a call that it names.
    pub fn member_value(&mut self, member: ScopeId, path: &[&'a Name]) -> Option<Value> {
        let (name, result) = (path.first()?, path.get(1));
        let Some(entry) = self.scopes[member.0]
            .values
            .get(name.node.as_str())
            .copied()
        else {
            let Member { bank, .. } = self.scopes[member.0].member?;
            let bank = &self.banks[bank.0].name;
            let message = format!("the members of `{bank}` have no `{}`", name.node);
            let names = self.scopes[member.0].values.keys().copied();
            let hint: Advice = match nearest(&name.node, names) {
                Some(near) => Advice::did_you_mean(near),
                None => format!(
                    "declare it in the bank, for example `let {} = ..`",
                    name.node
                )
                .into(),
            };
            let diagnostic =
                Diagnostic::new(Code::Member, name.span, message, "not declared there");
            self.report(diagnostic.hint(hint));
            return None;
        };
        match result {
            None => self.name(member, &name.node, name.span),
            Some(field) => match self.result_of(entry.thing, field) {
                Some(value) => value,
                None => {
                    let message = format!("`{}` is {}", name.node, entry.thing.words());
                    let label = "has no results";
                    self.report(
                        Diagnostic::new(Code::NoResults, field.span, message, label)
                            .hint("only a call of a term has results"),
                    );
                    None
                }
            },
        }
    }

    /// A bank or a member where a value is needed.
    pub fn bank_as_value(&mut self, span: Span) -> Option<Value> {
        let message = "a bank is no value, and neither is a member of one";
        let label = "one of its values is needed";
        self.report(
            Diagnostic::new(Code::Member, span, message, label)
                .hint("write `bank[2].value` for one member, `sum(bank.value)` for all"),
        );
        None
    }

    /// The number of the member that emits.
    pub fn emitting_member(&mut self, scope: ScopeId, span: Span) -> Option<Value> {
        let member = self.member_around(scope)?;
        let node = self.model.dag.constant(member.number as f64);
        self.mark(span);
        Some(Value {
            node,
            ty: Ty::Real(Dim::NUMBER),
        })
    }
}
