//! `delay` and `feed`: what was, for a while; read by `d(t)` and `tuned(d, t)`.

use super::elaborate::Elaborator;
use super::scope::{Made, ScopeId, Thing};
use super::types::{Ty, Value, counted};
use crate::diag::{Code, Diagnostic};
use crate::model::{Delay, DelayId, Interval, Node, NodeId};
use crate::syntax::ast::{Arg, Expr, ExprKind, Name, RangeExpr};
use crate::units::{Dim, shown};
use whippen_source::Span;

/// Ticks of the longest line: 23 s at 44.1 kHz, 4 MiB.
const TICKS_MAX: f64 = 1_048_576.0;

impl<'a> Elaborator<'a, '_> {
    /// Enters a delay line.
    pub fn declare_delay(&mut self, scope: ScopeId, name: &'a Name, ty: &Name) -> Made {
        let Some(dim) = self.real_type(ty, "a delay line", "feed 0 or 1, and compare") else {
            self.enter(scope, name, Thing::Broken);
            return Made::Nothing;
        };
        let range = Interval::point(0.0);
        let delay = self.model.delays.push(Delay {
            name: self.scopes[scope.0].full(&name.node),
            dim,
            range,
            ticks: 1,
            feed: NodeId(0),
            span: name.span,
        });
        self.model.delays[delay].feed = self.model.dag.constant(0.0);
        self.mark(name.span);
        self.feed_spans.push(None);
        self.enter(scope, name, Thing::Delay(delay));
        Made::Delay(delay)
    }

    /// Its range and its length.
    pub fn delay(
        &mut self,
        scope: ScopeId,
        delay: DelayId,
        range: &'a RangeExpr,
        lasting: &'a Expr,
    ) {
        let Delay { name, dim, .. } = self.model.delays[delay].clone();
        if let Some(bounds) = self.range(scope, range, dim, &format!("the range of `{name}`")) {
            self.model.delays[delay].range = bounds;
        }
        let what = format!("the length of `{name}`");
        let Some(seconds) = self.positive(scope, lasting, Dim::TIME, &what) else {
            return;
        };
        // A length that is whole but for rounding is whole.
        let ticks = (seconds * f64::from(self.model.rate_hz) - 1e-9).ceil();
        if (1.0..=TICKS_MAX).contains(&ticks) {
            self.model.delays[delay].ticks = ticks as u32;
            return;
        }
        let rate_hz = self.model.rate_hz;
        let message = format!("{what} is {ticks} ticks, and it must be 1 to {TICKS_MAX}");
        let label = format!("{} at {rate_hz} Hz", shown(seconds, Dim::TIME));
        self.report(
            Diagnostic::new(Code::DelayLine, lasting.span, message, label)
                .hint("what lasts longer is a `state`, written in an event now and then"),
        );
    }

    /// `feed delay = value`
    pub fn feed(&mut self, scope: ScopeId, name: &'a Name, value: &'a Expr) {
        let found = self.expr(scope, value);
        let Some(entry) = self.lookup_written(scope, name) else {
            return;
        };
        let Thing::Delay(delay) = entry.thing else {
            if !matches!(entry.thing, Thing::Broken) {
                let words = entry.thing.words();
                let message = format!("`{}` is {words} and cannot be fed", name.node);
                let hint = "declare `delay name: type in low .. high lasting time`";
                self.report(
                    Diagnostic::new(Code::Feed, name.span, message, "not a delay line")
                        .also(entry.span, format!("declared here as {words}"))
                        .hint(hint),
                );
            }
            return;
        };
        let dim = self.model.delays[delay].dim;
        let what = || format!("what is fed to `{}`", name.node);
        let node = found.and_then(|found| self.expect(found, value, Ty::Real(dim), what));
        if let Some(first) = self.feed_spans[delay] {
            let message = format!("`{}` is fed twice", name.node);
            self.report(
                Diagnostic::new(Code::Feed, name.span, message, "the second time")
                    .also(first, "the first time")
                    .hint("add both: a delay line is fed once in every tick"),
            );
            return;
        }
        self.feed_spans[delay] = Some(name.span);
        if let Some(node) = node {
            self.model.delays[delay].feed = node;
        }
    }

    /// Reports delay lines that nothing is fed to.
    pub fn unfed(&mut self) {
        self.here = None;
        for (id, delay) in self.model.delays.clone().enumerated() {
            if self.feed_spans[id].is_none() {
                let message = format!("nothing is fed to `{}`", delay.name);
                let own = delay.name.rsplit('.').next().unwrap_or(&delay.name);
                let hint = format!("add `feed {own} = ..`");
                self.diags.push(
                    Diagnostic::new(Code::Feed, delay.span, message, "is empty for ever")
                        .hint(hint),
                );
            }
        }
    }

    /// The delay line that a callee names.
    pub fn delay_of(&self, scope: ScopeId, callee: &Name) -> Option<DelayId> {
        match self.find(scope, &callee.node)?.thing {
            Thing::Delay(delay) => Some(delay),
            _ => None,
        }
    }

    /// `d(t)`
    pub fn tap(
        &mut self,
        scope: ScopeId,
        delay: DelayId,
        callee: &Name,
        args: &'a [Arg],
        span: Span,
    ) -> Option<Value> {
        let [Arg { name: None, value }] = args else {
            let message = format!(
                "`{}` is a delay line, which is read with one time, not with {}",
                callee.node,
                counted(args.len(), "argument")
            );
            let (label, hint) = ("how long ago?", format!("write `{}(time)`", callee.node));
            self.report(Diagnostic::new(Code::MissingArgument, span, message, label).hint(hint));
            return None;
        };
        let ticks = self.ticks_ago(scope, value)?;
        let dim = self.model.delays[delay].dim;
        Some(Value::real(self.node(Node::Tap(delay, ticks), span), dim))
    }

    /// `tuned(d, t)`, which remembers its last value.
    pub fn tuned(&mut self, scope: ScopeId, args: &'a [Arg], span: Span) -> Option<Value> {
        let [line, time] = args else { return None };
        let delay = match &line.value.kind {
            ExprKind::Name(name) => {
                let entry = self.lookup(scope, name, line.value.span)?;
                match entry.thing {
                    Thing::Broken => return None,
                    Thing::Delay(delay) => Some(delay),
                    _ => None,
                }
            }
            _ => None,
        };
        let Some(delay) = delay else {
            let (message, label) = ("`tuned` reads a delay line", "not a delay line");
            let hint = "declare `delay name: type in low .. high lasting time` and write \
                        `tuned(name, time)`";
            let diagnostic = Diagnostic::new(Code::WrongType, line.value.span, message, label);
            self.report(diagnostic.hint(hint));
            return None;
        };
        let ticks = self.ticks_ago(scope, &time.value)?;
        let dim = self.model.delays[delay].dim;
        let use_of_it = self.model.tuned.push(delay);
        let node = self.node(Node::Tuned(delay, ticks, use_of_it), span);
        Some(Value::real(node, dim))
    }

    /// A time as ticks, not rounded.
    fn ticks_ago(&mut self, scope: ScopeId, time: &'a Expr) -> Option<NodeId> {
        let value = self.expr(scope, time)?;
        let seconds = self.expect(value, time, Ty::Real(Dim::TIME), || {
            "how long ago a delay line is read".to_string()
        })?;
        let rate_hz = self.model.dag.constant(self.model.rate_hz.into());
        Some(self.node(Node::Mul(seconds, rate_hz), time.span))
    }

    /// Reports a delay line that stands where a value does.
    pub fn delay_as_value(&mut self, name: &str, span: Span) {
        let message = format!("`{name}` is a delay line, not a value");
        let diagnostic = Diagnostic::new(Code::WrongType, span, message, "as of when?");
        self.report(diagnostic.hint(format!("write `{name}(time)`: what was fed that time ago")));
    }
}
