//! The calls that stand in a declaration, in the order of the text.

use crate::syntax::ast::{
    Action, ActionKind, BodyPart, Decl, DeclKind, Expr, ExprKind, Knots, RangeExpr, StringPart,
};

/// Every call in the declaration, of terms and of functions; of the arguments of `each` the one of
/// the member. The walk keeps its own stack: depth
/// costs nothing.
pub fn calls(decl: &Decl, member: Option<usize>) -> Vec<&Expr> {
    let mut waiting = expressions(&decl.kind);
    let mut found = Vec::new();
    while let Some(expr) = waiting.pop() {
        match &expr.kind {
            ExprKind::Call(callee, args) => {
                found.push(expr);
                let own = member.filter(|_| callee.node == "each");
                let args = match own {
                    Some(own) => args.get(own..=own).unwrap_or_default(),
                    None => args,
                };
                waiting.extend(args.iter().map(|a| &a.value));
            }
            ExprKind::Field(a, _) | ExprKind::Prime(a) | ExprKind::Neg(a) | ExprKind::Not(a) => {
                waiting.push(a)
            }
            ExprKind::Binary(_, a, b) | ExprKind::Member(a, b) => waiting.extend([&**a, &**b]),
            ExprKind::If(c, a, b) => waiting.extend([&**c, &**a, &**b]),
            ExprKind::Number(_)
            | ExprKind::Bool(_)
            | ExprKind::Name(_)
            | ExprKind::Is { .. }
            | ExprKind::Error => {}
        }
    }
    found.sort_by_key(|call| (call.span.start, std::cmp::Reverse(call.span.end)));
    found
}

fn expressions(kind: &DeclKind) -> Vec<&Expr> {
    match kind {
        DeclKind::Sense {
            range, slew, over, ..
        } => ends(range).chain(slew).chain(over).collect(),
        DeclKind::Param {
            value,
            range,
            glide,
            ..
        } => std::iter::once(value)
            .chain(range.iter().flat_map(ends))
            .chain(glide)
            .collect(),
        DeclKind::Noise { .. } | DeclKind::Bank { .. } => vec![],
        DeclKind::Let { value, .. }
        | DeclKind::Next { value, .. }
        | DeclKind::Feed { value, .. }
        | DeclKind::Sound { value, .. }
        | DeclKind::Force { value, .. }
        | DeclKind::Result { value, .. } => vec![value],
        DeclKind::States { transitions, .. } => transitions
            .iter()
            .flat_map(|t| std::iter::once(&t.guard).chain(in_actions(&t.actions)))
            .collect(),
        DeclKind::State { range, init, .. } => ends(range).chain(init).collect(),
        DeclKind::Body { parts, .. } => parts.iter().flat_map(in_part).collect(),
        DeclKind::Event {
            trigger, actions, ..
        } => std::iter::once(trigger.expr())
            .chain(in_actions(actions))
            .collect(),
        DeclKind::Pulse { range, lasting, .. } | DeclKind::Delay { range, lasting, .. } => {
            ends(range).chain([lasting]).collect()
        }
        DeclKind::Table { knots, .. } => match knots {
            Knots::Listed(all) => all.iter().flat_map(|(x, value)| [x, value]).collect(),
            Knots::File(_) => vec![],
        },
        DeclKind::String { along, parts, .. } => ends(along)
            .chain(parts.iter().flat_map(in_string_part))
            .collect(),
        DeclKind::Hold { guard, .. } => vec![guard],
    }
}

fn ends(range: &RangeExpr) -> impl Iterator<Item = &Expr> {
    [&range.low, &range.high].into_iter()
}

fn in_actions(actions: &[Action]) -> impl Iterator<Item = &Expr> {
    actions.iter().flat_map(|action| match &action.kind {
        ActionKind::Emit { args, .. } => args.iter().map(|(_, value)| value).collect(),
        ActionKind::Write { value, .. } | ActionKind::Fire { value, .. } => vec![value],
    })
}

fn in_part(part: &BodyPart) -> Vec<&Expr> {
    match part {
        BodyPart::Coordinate {
            range,
            init,
            rate_range,
            rate_init,
            ..
        } => ends(range)
            .chain(init)
            .chain(ends(rate_range))
            .chain(rate_init)
            .collect(),
        BodyPart::Inertia { value, .. } | BodyPart::Torque { value, .. } => vec![value],
        BodyPart::Friction { against, law, .. } => vec![against, law],
    }
}

fn in_string_part(part: &StringPart) -> Vec<&Expr> {
    match part {
        StringPart::Coordinate {
            range, rate_range, ..
        } => ends(range).chain(ends(rate_range)).collect(),
        StringPart::Density { value, .. }
        | StringPart::Load { value, .. }
        | StringPart::Tuned { pitch: value, .. }
        | StringPart::Points { value, .. } => vec![value],
        StringPart::Force { value, place, .. } => vec![value, place],
        StringPart::Friction {
            place,
            against,
            law,
            ..
        } => vec![place, against, law],
        StringPart::Ends { .. } => vec![],
    }
}
