//! Windows of differentiators that are too short for how often a port is measured.

use crate::scales::Scales;
use whippen_lang::diag::{Code, Diagnostic};
use whippen_lang::model::{Model, Node, Sense};

/// A line through fewer measurements says nothing of speed.
const UPDATES: f64 = 3.0;

/// Warnings about the senses whose primes are used, with windows shorter than three updates of
/// their ports.
pub fn warnings(model: &Model, scales: &[Scales]) -> Vec<Diagnostic> {
    let is_used = |sense: u32| {
        let wanted = [Node::Slope(sense), Node::Curvature(sense)];
        model.dag.nodes().any(|(_, node)| wanted.contains(node))
    };
    let mut found = Vec::new();
    for ((number, sense), scales) in (0..).zip(&model.senses).zip(scales) {
        if is_used(number) {
            found.extend(warning(model, sense, scales));
        }
    }
    found
}

fn warning(model: &Model, sense: &Sense, scales: &Scales) -> Option<Diagnostic> {
    let update_hz = scales.update_hz?;
    let rate_hz = f64::from(model.rate_hz);
    let window_s = f64::from(sense.window) / rate_hz;
    let needed_s = UPDATES / update_hz;
    // A window is rounded to ticks; half of one is no fault of the program.
    if update_hz >= rate_hz || window_s >= needed_s - 1.0 / rate_hz {
        return None;
    }
    let name = &sense.name;
    let message = format!(
        "`{name}` is measured {update_hz} times a second, and its window of {:.2} ms holds fewer \
         than three measurements",
        1e3 * window_s
    );
    let hint = format!(
        "with `over {} ms` or more `{name}'` is the slope of a line through three at least",
        (1e3 * needed_s).ceil()
    );
    Some(Diagnostic::new(Code::ShortWindow, sense.span, message, "too short a window").hint(hint))
}

#[cfg(test)]
mod tests {
    use super::*;
    use whippen_lang::check::Options;
    use whippen_lang::front::compile_front;
    use whippen_source::SourceMap;

    fn found(over: &str, update_hz: Option<f64>) -> usize {
        let mut map = SourceMap::default();
        let text = format!(
            "instrument i {{ sense x: length in 0 mm .. 10 mm {over} force f = 1 N*s/m * x' }}"
        );
        map.add("test.whip", text);
        let (program, _) = compile_front(&mut map, &Options::default());
        let model = &program.expect("it is correct").instruments[0];
        let scales = Scales {
            sensor_zero: 0.0,
            sensor_lsb: 1e-6,
            drive_lsb: 1e-3,
            update_hz,
        };
        warnings(model, &[scales]).len()
    }

    #[test]
    fn three_measurements_are_enough() {
        assert_eq!(found("over 3 ms", Some(1000.0)), 0);
        assert_eq!(found("over 2.9 ms", Some(1000.0)), 1);
        assert_eq!(found("", Some(1000.0)), 1);
        assert_eq!(found("", None), 0, "in every tick");
        assert_eq!(found("over 50 us", Some(44_100.0)), 0, "in every tick");
    }
}
