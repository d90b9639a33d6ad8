//! Decimal commas in calls: `0,5 mm` reads as two arguments, and is told as the one number it is.
//!
//! Not here: decimal commas elsewhere, at which the grammar stops (`syntax::expected`).

use whippen_source::Span;

use crate::diag::{Advice, Code, Diagnostic};
use crate::syntax::ast::{Arg, ExprKind, Number, TypedName};
use crate::units::dimension;

/// Two arguments that are surely one number.
pub struct DecimalComma<'a> {
    whole: &'a str,
    part: &'a Number,
    /// Of the comma.
    span: Span,
}

impl<'a> DecimalComma<'a> {
    /// In a call of a function, whose arguments share a dimension: where the part alone has a unit,
    /// or there are more arguments than the function takes.
    pub fn in_function(count: usize, args: &'a [Arg]) -> Vec<DecimalComma<'a>> {
        let is_certain =
            |(_, comma): &(usize, DecimalComma)| comma.part.unit.is_some() || args.len() > count;
        let certain = commas(args).filter(is_certain);
        certain.map(|(_, comma)| comma).collect()
    }

    /// In a call of a term: where the whole would be no value for its parameter, or the part would
    /// be none for any.
    pub fn in_term(params: &[TypedName], args: &'a [Arg]) -> Vec<DecimalComma<'a>> {
        let is_certain = |(at, _): &(usize, DecimalComma)| {
            let name = args[*at].name.as_ref();
            let param = params.get(*at).filter(|_| name.is_none());
            let is_number = |param: &TypedName| {
                let dim = dimension(&param.ty.node);
                dim.is_some_and(|dim| dim.is_number())
            };
            args.len() > params.len() || !param.is_some_and(is_number)
        };
        let certain = commas(args).filter(is_certain);
        certain.map(|(_, comma)| comma).collect()
    }

    /// What is told of it.
    pub fn diagnostic(&self) -> Diagnostic {
        let (whole, part) = (self.whole, &self.part.text);
        let unit = self.part.unit.as_ref();
        let unit = unit.map_or(String::new(), |unit| format!(" {unit}"));
        let message = format!("`{whole},{part}{unit}` is written with a comma");
        let hint = format!("the decimal point is `.`: write `{whole}.{part}{unit}`");
        Diagnostic::new(Code::BadNumber, self.span, message, "not a decimal point")
            .hint(Advice::instead(hint, "."))
    }
}

/// Pairs of arguments that may be one number, with the place of the first: digits alone, a comma,
/// digits, and nothing between.
fn commas(args: &[Arg]) -> impl Iterator<Item = (usize, DecimalComma<'_>)> {
    args.windows(2).enumerate().filter_map(|(at, pair)| {
        let (whole, part) = (number(&pair[0])?, number(&pair[1])?);
        let digits = |number: &Number| number.text.bytes().all(|c| c.is_ascii_digit());
        let span = Span {
            start: pair[0].value.span.end,
            end: pair[1].value.span.start,
            ..pair[0].value.span
        };
        let is_one = span.end == span.start + 1
            && whole.unit.is_none()
            && digits(whole)
            && digits(part)
            && pair[1].name.is_none();
        let whole = &whole.text;
        is_one.then_some((at, DecimalComma { whole, part, span }))
    })
}

/// The number that an argument is, also behind a minus.
fn number(arg: &Arg) -> Option<&Number> {
    match &arg.value.kind {
        ExprKind::Number(number) => Some(number),
        ExprKind::Neg(inner) => match &inner.kind {
            ExprKind::Number(number) => Some(number),
            _ => None,
        },
        _ => None,
    }
}
