//! Calls: arguments are bound to parameters; functions become nodes, terms were made scopes before.

use super::builtin::{Builtin, Signature};
use super::decimal_comma::DecimalComma;
use super::elaborate::Elaborator;
use super::elsewhere;
use super::items::TermItem;
use super::scope::ScopeId;
use super::slot::Source;
use super::types::{Ty, Value, counted};
use crate::diag::{Advice, Code, Diagnostic, nearest};
use crate::model::Node;
use crate::syntax::ast::{Arg, Expr, Name, TypedName};
use crate::units::{Dim, shown};
use whippen_source::Span;

impl<'a> Elaborator<'a, '_> {
    /// The value of a call.
    pub fn call(
        &mut self,
        scope: ScopeId,
        call: &'a Expr,
        callee: &'a Name,
        args: &'a [Arg],
    ) -> Option<Value> {
        if let Some(delay) = self.delay_of(scope, callee) {
            return self.tap(scope, delay, callee, args, call.span);
        }
        if let Some(id) = self.table_of(scope, callee) {
            return self.table_at(scope, id, callee, args, call.span);
        }
        if let Some(id) = self.displacement_of(scope, callee) {
            return self.displacement_at(scope, id, callee, args, call.span);
        }
        if let Some(id) = self.derivative_of(scope, callee, args) {
            return self.derivative_at(scope, id, callee, args, call.span);
        }
        let from_std = self.scopes[scope.0].in_std();
        if let Some(function) = self.items.function(&callee.node, from_std) {
            return self.function(scope, function, args, call.span);
        }
        match self.scopes[scope.0].calls.get(&call.span).copied() {
            Some(child) => {
                let slot = self.only_result(child, call.span)?;
                self.slot(slot)
            }
            None => {
                for arg in args {
                    self.expr(scope, &arg.value);
                }
                None
            }
        }
    }

    fn function(
        &mut self,
        scope: ScopeId,
        signature: &Signature,
        args: &'a [Arg],
        span: Span,
    ) -> Option<Value> {
        match signature.function {
            Builtin::Each => return self.each(scope, args, span),
            Builtin::Sum | Builtin::Max | Builtin::Min => {
                if let Some(bank) = self.reduced_bank(scope, args) {
                    return self.reduced(signature.function, bank, &args[0].value);
                }
                if signature.function == Builtin::Sum {
                    return self.nothing_to_add(scope, args, span);
                }
            }
            _ => {}
        }
        let commas = DecimalComma::in_function(signature.args.len(), args);
        if !commas.is_empty() {
            commas.iter().for_each(|one| self.report(one.diagnostic()));
            return None;
        }
        if signature.function == Builtin::Tuned {
            self.check_count(signature, args, span)?;
            return self.tuned(scope, args, span);
        }
        let values: Vec<Option<Value>> = args
            .iter()
            .map(|arg| self.expr(scope, &arg.value))
            .collect();
        self.check_count(signature, args, span)?;
        let values: Vec<Value> = values.into_iter().collect::<Option<_>>()?;
        match (signature.function, &values[..]) {
            (Builtin::Sqrt, [a]) => return self.square_root(*a, &args[0].value, span),
            (Builtin::Of(function), [a]) => {
                let operand = || format!("the operand of `{}`", signature.name);
                let number = Ty::Real(Dim::NUMBER);
                let a = self.expect(*a, &args[0].value, number, operand)?;
                let node = self.node(Node::Function(function, a), span);
                return Some(Value::real(node, Dim::NUMBER));
            }
            _ => {}
        }
        let dim = self.shared_dim(signature, args, &values)?;
        let node = match (signature.function, &values[..]) {
            (Builtin::Abs, [a]) => Node::Abs(a.node),
            (Builtin::Min, [a, b]) => Node::Min(a.node, b.node),
            (Builtin::Max, [a, b]) => Node::Max(a.node, b.node),
            (Builtin::Clamp, [value, low, high]) => {
                self.check_order([*low, *high], dim, args)?;
                let raised = self.node(Node::Max(value.node, low.node), span);
                Node::Min(raised, high.node)
            }
            _ => return None,
        };
        Some(Value::real(self.node(node, span), dim))
    }

    /// The square root, whose dimension must be whole.
    fn square_root(&mut self, a: Value, expr: &Expr, span: Span) -> Option<Value> {
        let dim = self.real(a, expr, "`sqrt` needs")?;
        let Some(root) = dim.pow_halves(1) else {
            let words = a.ty.words();
            let message = format!("the square root of {words} has no whole dimension");
            let hint = format!(
                "divide it by a value in {dim} before the root, and give the result its unit again"
            );
            let diagnostic = Diagnostic::new(Code::FractionalDim, expr.span, message, words);
            self.report(diagnostic.hint(hint));
            return None;
        };
        Some(Value::real(self.node(Node::Power(a.node, 1), span), root))
    }

    fn check_count(&mut self, signature: &Signature, args: &[Arg], span: Span) -> Option<()> {
        let usage = format!("write `{}({})`", signature.name, signature.args.join(", "));
        if let Some(name) = args.iter().find_map(|arg| arg.name.as_ref()) {
            let message = format!("`{}` takes its arguments by position", signature.name);
            let diagnostic =
                Diagnostic::new(Code::UnknownArgument, name.span, message, "no names here");
            self.report(diagnostic.hint(usage));
            return None;
        }
        let (wanted, given) = (signature.args.len(), args.len());
        let code = match given.cmp(&wanted) {
            std::cmp::Ordering::Equal => return Some(()),
            std::cmp::Ordering::Less => Code::MissingArgument,
            std::cmp::Ordering::Greater => Code::ExtraArgument,
        };
        let message = format!(
            "`{}` takes {}, not {given}",
            signature.name,
            counted(wanted, "argument")
        );
        self.report(Diagnostic::new(code, span, message, counted(given, "argument")).hint(usage));
        None
    }

    fn shared_dim(&mut self, signature: &Signature, args: &[Arg], values: &[Value]) -> Option<Dim> {
        let (first, rest) = values.split_first()?;
        let mut shared = self.real(
            *first,
            &args[0].value,
            &format!("`{}` needs", signature.name),
        );
        for (arg, value) in args[1..].iter().zip(rest) {
            let problem =
                |a: &str, b: &str| format!("`{}` cannot be taken of {a} and {b}", signature.name);
            shared =
                shared.and(self.alike(problem, (&args[0].value, *first), (&arg.value, *value)));
        }
        shared
    }

    /// The ends of `clamp`, where they are constants.
    fn check_order(&mut self, ends: [Value; 2], dim: Dim, args: &[Arg]) -> Option<()> {
        let [low, high] = ends.map(|end| self.model.dag.real(end.node));
        match (low, high) {
            (Some(low), Some(high)) if low > high => {
                let message = format!(
                    "this clamps to nothing: {} is above {}",
                    shown(low, dim),
                    shown(high, dim)
                );
                self.report(
                    Diagnostic::new(
                        Code::EmptyRange,
                        args[1].value.span.to(args[2].value.span),
                        message,
                        "empty",
                    )
                    .hint("the low end comes first: `clamp(value, low, high)`"),
                );
                None
            }
            _ => Some(()),
        }
    }

    /// Reports a call of something that is no term.
    pub fn unknown_term(&mut self, callee: &Name) {
        let name = callee.node.as_str();
        let hint = match (elsewhere::function(name), self.items.nearest_function(name)) {
            (Some(instead), _) => instead,
            (None, Some(near)) => Advice::did_you_mean(near),
            (None, None) => format!(
                "declare it, `term {name}(..) -> .. {{ .. }}`, here or in a file of this folder"
            )
            .into(),
        };
        let message = format!("there is no term `{}`", callee.node);
        self.report(
            Diagnostic::new(Code::UnknownTerm, callee.span, message, "unknown term").hint(hint),
        );
    }

    /// The sources of a term's parameters in one call.
    pub fn bind(
        &mut self,
        scope: ScopeId,
        call: &Expr,
        term: TermItem<'a>,
        args: &'a [Arg],
    ) -> Vec<Source<'a>> {
        let params = &term.ast.params;
        let commas = DecimalComma::in_term(params, args);
        if !commas.is_empty() {
            commas.iter().for_each(|one| self.report(one.diagnostic()));
            return params.iter().map(|_| Source::Missing).collect();
        }
        let mut bound: Vec<Option<&'a Arg>> = vec![None; params.len()];
        let mut lost = false;
        for (position, arg) in args.iter().enumerate() {
            let index = match &arg.name {
                Some(name) => self.named_parameter(term, name),
                None => self.positional_parameter(term, args, position),
            };
            match index {
                None => lost = true,
                Some(index) => match bound[index] {
                    None => bound[index] = Some(arg),
                    Some(first) => self.repeated(&params[index].name, arg, first),
                },
            }
        }
        if !lost {
            self.report_missing(term, &bound, call);
        }
        bound
            .iter()
            .map(|arg| arg.map_or(Source::Missing, |arg| Source::Expr(scope, &arg.value)))
            .collect()
    }

    fn named_parameter(&mut self, term: TermItem, name: &Name) -> Option<usize> {
        let params = &term.ast.params;
        let found = params.iter().position(|p| p.name.node == name.node);
        if found.is_none() {
            let names = params.iter().map(|p| p.name.node.as_str());
            let hint = match nearest(&name.node, names.clone()) {
                Some(near) => Advice::did_you_mean(near),
                None => format!("its parameters are {}", typed_names(params)).into(),
            };
            let message = format!(
                "the term `{}` has no parameter `{}`",
                term.ast.name.node, name.node
            );
            let diagnostic = Diagnostic::new(
                Code::UnknownArgument,
                name.span,
                message,
                "no such parameter",
            );
            self.report(diagnostic.hint(hint));
        }
        found
    }

    fn positional_parameter(
        &mut self,
        term: TermItem,
        args: &[Arg],
        position: usize,
    ) -> Option<usize> {
        let name = &term.ast.name.node;
        let (count, span) = (term.ast.params.len(), args[position].value.span);
        if args[..position].iter().any(|arg| arg.name.is_some()) {
            args[position - 1].name.as_ref()?; // one message for all that follow
            let message =
                format!("in the call of `{name}` an argument without name follows one with a name");
            let diagnostic = Diagnostic::new(
                Code::UnknownArgument,
                span,
                message,
                "which parameter is this?",
            );
            self.report(diagnostic.hint("name it: `parameter: value`"));
            return None;
        }
        if position >= count {
            let message = format!(
                "the term `{name}` has {}, and here are more arguments",
                counted(count, "parameter")
            );
            let label = "one too many";
            self.report(
                Diagnostic::new(Code::ExtraArgument, span, message, label).hint("take it away"),
            );
            return None;
        }
        Some(position)
    }

    fn repeated(&mut self, param: &Name, arg: &Arg, first: &Arg) {
        let message = format!("the parameter `{}` is given twice", param.node);
        self.report(
            Diagnostic::new(
                Code::RepeatedArgument,
                arg.value.span,
                message,
                "the second value",
            )
            .also(first.value.span, "the first value")
            .hint("take one of them away"),
        );
    }

    fn report_missing(&mut self, term: TermItem, bound: &[Option<&Arg>], call: &Expr) {
        let unbound = term
            .ast
            .params
            .iter()
            .zip(bound)
            .filter(|(_, arg)| arg.is_none());
        let missing: Vec<String> = unbound
            .map(|(p, _)| format!("{}: {}", p.name.node, p.ty.node))
            .collect();
        if missing.is_empty() {
            return;
        }
        let message = format!(
            "the call of `{}` leaves out {}",
            term.ast.name.node,
            missing.join(", ")
        );
        let diagnostic = Diagnostic::new(
            Code::MissingArgument,
            call.span,
            message,
            "arguments are missing",
        );
        self.report(diagnostic.hint(format!("add {}", missing.join(", "))));
    }
}

/// Parameters as their term declares them: `x: length, k: stiffness`.
fn typed_names(params: &[TypedName]) -> String {
    let typed = |param: &TypedName| format!("{}: {}", param.name.node, param.ty.node);
    let all: Vec<String> = params.iter().map(typed).collect();
    all.join(", ")
}
