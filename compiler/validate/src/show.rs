//! Terms as text, as much as a message can hold.

use crate::term::{Base, Function, Kind, Term, Terms};

/// Characters of a term, about.
const LENGTH_MAX: usize = 160;

impl Terms {
    /// A term in a message.
    pub fn show(&self, term: Term) -> String {
        let mut text = String::new();
        self.write(term, &mut text);
        if text.len() > LENGTH_MAX {
            let end = text.floor_char_boundary(LENGTH_MAX);
            text.truncate(end);
            text.push_str(" ..");
        }
        text
    }

    fn write(&self, term: Term, text: &mut String) {
        let sum = self.sum(term);
        let mut first = true;
        for (atom, by) in &sum.parts {
            if text.len() > LENGTH_MAX {
                return;
            }
            match (first, *by) {
                (true, 1) => {}
                (true, by) => text.push_str(&format!("{by} ")),
                (false, 1) => text.push_str(" + "),
                (false, -1) => text.push_str(" - "),
                (false, by) if by < 0 => text.push_str(&format!(" - {} ", -by)),
                (false, by) => text.push_str(&format!(" + {by} ")),
            }
            first = false;
            self.write_atom(self.kind(*atom), text);
        }
        match sum.constant {
            0 if !first => {}
            constant if first => text.push_str(&constant.to_string()),
            constant => text.push_str(&format!(" {constant:+}")),
        }
    }

    fn write_atom(&self, kind: &Kind, text: &mut String) {
        let mut call = |name: &str, args: &[Term]| {
            text.push_str(name);
            text.push('(');
            for (at, arg) in args.iter().enumerate() {
                if at != 0 {
                    text.push_str(", ");
                }
                self.write(*arg, text);
            }
            text.push(')');
        };
        match kind {
            Kind::Base(base) => text.push_str(match base {
                Base::State => "STATE",
                Base::Record => "RECORD",
                Base::Samples => "SAMPLES",
                Base::History => "HISTORY",
                Base::Stack => "STACK",
            }),
            Kind::Register(register) => text.push_str(&format!("r{register}")),
            Kind::Unknown(number) => text.push_str(&format!("unknown{number}")),
            Kind::Integer => text.push_str("integer"),
            Kind::Key => text.push_str("KEY"),
            Kind::Load(address, 4) => call("word", &[*address]),
            Kind::Load(address, 2) => call("half", &[*address]),
            Kind::Load(address, _) => call("byte", &[*address]),
            Kind::Product(factors) => {
                for (at, factor) in factors.iter().enumerate() {
                    if at != 0 {
                        text.push_str(" * ");
                    }
                    self.write_atom(self.kind(*factor), text);
                }
            }
            Kind::Times(a, b) => call("times", &[*a, *b]),
            Kind::Floor(term, n) => call(&format!("floor{n}"), &[*term]),
            Kind::Positive(term) => call("positive", &[*term]),
            Kind::Gate(truth, term) => call(&self.name_of_gate(*truth), &[*term]),
            Kind::Apply(function, args) => call(&name(*function), args),
        }
    }

    fn name_of_gate(&self, truth: crate::truth::Truth) -> String {
        let Some((asks, ..)) = self.truths.split(truth) else {
            return "if".to_string();
        };
        format!("if[{} >= {}]", self.show(asks.primitive), asks.least)
    }
}

fn name(function: Function) -> String {
    match function {
        Function::And => "and".to_string(),
        Function::Or => "or".to_string(),
        Function::ExclusiveOr => "eor".to_string(),
        Function::LeadingZeros => "clz".to_string(),
        Function::DivideUnsigned => "udiv".to_string(),
        Function::DivideSigned => "sdiv".to_string(),
        Function::ShiftLeft => "lsl".to_string(),
        Function::ShiftRight => "lsr".to_string(),
        Function::ShiftRightSigned => "asr".to_string(),
        Function::DivideRound(n) => format!("div_round{n}"),
        Function::SquareRoot => "sqrt".to_string(),
        Function::Held => "held".to_string(),
    }
}
