//! Parameters set by the caller: `k=9e3 N/m`, `grand_piano.weight=0.4N`.

use super::Options;
use super::diags::Diags;
use super::items::Items;
use super::settings::SetValue;
use crate::diag::{Advice, Code, Diagnostic, nearest};
use crate::syntax::ast::{DeclKind, Instrument};
use crate::units::{Quantity, parse_quantity};
use whippen_source::Span;

/// One setting.
#[derive(Debug)]
pub struct Set {
    /// The instrument, if only one is meant.
    pub instrument: Option<String>,
    /// The parameter.
    pub name: String,
    /// Its value; `None` if it cannot be read.
    pub value: Option<Quantity>,
    /// Whether a plain number is in SI.
    pub in_si: bool,
    /// Where the name stands.
    pub name_span: Span,
    /// Where the value stands.
    pub value_span: Span,
    /// Whether some instrument has such a parameter.
    pub used: bool,
}

impl Set {
    /// What it sets, if that could be read.
    pub fn set_value(&self) -> Option<SetValue> {
        Some(SetValue {
            value: self.value?,
            in_si: self.in_si,
            span: self.value_span,
        })
    }
}

/// Reads the settings; the k-th is file `first_file + k`, whose text is `name=value`.
pub fn read(options: &Options, first_file: usize, diags: &mut Diags) -> Vec<Set> {
    let mut sets = Vec::new();
    for (index, (name, value)) in options.sets.iter().enumerate() {
        let file = (first_file + index) as u32;
        let end = name.len() as u32;
        let name_span = Span {
            file,
            start: 0,
            end,
        };
        let value_span = Span {
            file,
            start: end + 1,
            end: end + 1 + value.len() as u32,
        };
        let in_si = options.in_si.contains(name);
        let (instrument, name) = match name.split_once('.') {
            Some((instrument, name)) => (Some(instrument.trim().to_string()), name),
            None => (None, name.as_str()),
        };
        let value = parse_quantity(value)
            .map_err(|error| {
                let diagnostic = Diagnostic::new(
                    Code::BadSetting,
                    value_span,
                    error.to_string(),
                    "cannot be read",
                );
                diags.push(diagnostic.hint("write a number with its unit, `on` or `off`"));
            })
            .ok();
        sets.push(Set {
            instrument,
            name: name.trim().to_string(),
            value,
            in_si,
            name_span,
            value_span,
            used: false,
        });
    }
    sets
}

/// Reports settings of parameters that no instrument has.
pub fn report_unused(sets: &[Set], items: &Items, diags: &mut Diags) {
    for set in sets.iter().filter(|s| !s.used) {
        let meant = set
            .instrument
            .as_ref()
            .map(|name| (name, items.instrument(name)));
        if let Some((name, None)) = meant {
            diags.push(unknown_instrument(name, set.name_span, items));
            continue;
        }
        let instruments = match meant {
            Some((_, Some(index))) => &items.instruments[index..=index],
            _ => &items.instruments[..],
        };
        diags.push(unknown_param(&set.name, set.name_span, instruments));
    }
}

/// An instrument that is not there.
pub fn unknown_instrument(name: &str, span: Span, items: &Items) -> Diagnostic {
    let hint = match items.nearest_instrument(name) {
        Some(near) => Advice::did_you_mean(near),
        None => "name an `instrument` of this program, or give the file that holds it to the same command".into(),
    };
    let message = format!("there is no instrument `{name}`");
    Diagnostic::new(Code::UnknownInstrument, span, message, "unknown instrument").hint(hint)
}

/// A parameter that none of the instruments has.
pub fn unknown_param(name: &str, span: Span, instruments: &[&Instrument]) -> Diagnostic {
    let params = instruments
        .iter()
        .flat_map(|i| &i.decls)
        .filter_map(|d| match &d.kind {
            DeclKind::Param { name, .. } => Some(name.node.as_str()),
            _ => None,
        });
    let hint = match nearest(name, params.clone()) {
        Some(near) => Advice::did_you_mean(near),
        None if params.clone().next().is_none() => "there are no parameters".into(),
        None => format!(
            "its parameters are {}",
            params.collect::<Vec<_>>().join(", ")
        )
        .into(),
    };
    let owner = match instruments {
        [one] => format!(
            "the instrument `{}` has no parameter `{name}`",
            one.name.node
        ),
        _ => format!("no instrument has a parameter `{name}`"),
    };
    Diagnostic::new(Code::UnknownParam, span, owner, "unknown parameter").hint(hint)
}
