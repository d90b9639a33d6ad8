//! Steps of a player, and instants: `wait 100 ms`, `to 10 mm in 60 ms`; `t2`, `t2 + 5 ms`, `0.3 s`.

use whippen_compiler::diag::nearest;
use whippen_compiler::units::Dim;

use crate::fields::{quantity, seconds};
use crate::gesture::Gesture;

/// A player's way, of places or forces: minimum jerk from value to value.
#[derive(Debug, Clone, PartialEq)]
pub struct Way {
    pub gesture: Gesture,
    /// The dimension of its values; none where it only waits.
    pub dim: Option<Dim>,
}

/// The longest way (s): what is longer is no experiment on one key.
pub(super) const LONGEST_S: f64 = 60.0;

impl Way {
    /// Reads the steps one after the other.
    ///
    /// # Errors
    /// The number of the step, and what is wrong in words.
    pub fn read<'t>(steps: impl Iterator<Item = &'t str>) -> Result<Way, (usize, String)> {
        let mut way = Way {
            gesture: Gesture::new(),
            dim: None,
        };
        for (number, step) in steps.enumerate() {
            way = way.then(step).map_err(|why| (number, why))?;
            if way.gesture.duration_s() > LONGEST_S {
                return Err((number, format!("the way is longer than {LONGEST_S} s")));
            }
        }
        Ok(way)
    }

    fn then(self, step: &str) -> Result<Way, String> {
        let wrong = || format!("`{step}` is no step: write `wait 100 ms` or `to 10 mm in 60 ms`");
        if let Some(time) = step.strip_prefix("wait ") {
            let gesture = self.gesture.hold(positive(time)?);
            return Ok(Way { gesture, ..self });
        }
        let rest = step.strip_prefix("to ").ok_or_else(wrong)?;
        let (value, time) = rest.split_once(" in ").ok_or_else(wrong)?;
        let (value, dim) = quantity(value.trim())?;
        // A plain 0 is any quantity's.
        if self.dim.is_some_and(|before| before != dim) {
            return Err(format!(
                "`{step}` has another kind of quantity than the steps before"
            ));
        }
        Ok(Way {
            gesture: self.gesture.to(value, positive(time)?),
            dim: Some(dim),
        })
    }
}

fn positive(text: &str) -> Result<f64, String> {
    let time = seconds(text.trim())?;
    let wrong = || format!("`{}` is no time above zero", text.trim());
    (time > 0.0).then_some(time).ok_or_else(wrong)
}

/// An instant: one with a name, or the beginning, and so long after it (s).
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// The number of the instant among those with names.
    pub named: Option<usize>,
    pub offset_s: f64,
    /// As it was written.
    pub text: String,
}

impl Moment {
    /// Reads one; `names` are those of the instants, in their order.
    ///
    /// # Errors
    /// In words.
    pub fn read(text: &str, names: &[String]) -> Result<Moment, String> {
        let moment = |named, offset_s| Moment {
            named,
            offset_s,
            text: text.to_string(),
        };
        if text.starts_with(|c: char| c.is_ascii_digit()) {
            return Ok(moment(None, seconds(text)?));
        }
        let (name, offset_s) = match text.split_once([' ', '+', '-']) {
            None => (text, 0.0),
            Some((name, _)) => {
                let rest = text[name.len()..].trim();
                let sign = if rest.starts_with('-') { -1.0 } else { 1.0 };
                let size = rest
                    .strip_prefix(['+', '-'])
                    .ok_or_else(|| format!("`{text}` is no instant, such as `t2 + 5 ms`"))?;
                (name, sign * seconds(size.trim())?)
            }
        };
        let named = names
            .iter()
            .position(|known| known == name)
            .ok_or_else(|| {
                let near = nearest(name, names.iter().map(String::as_str));
                let hint = near.map_or_else(
                    || {
                        format!(
                            "; there are {}",
                            if names.is_empty() {
                                "none".into()
                            } else {
                                names.join(", ")
                            }
                        )
                    },
                    |near| format!("; did you mean `{near}`?"),
                );
                format!("there is no instant `{name}`{hint}")
            })?;
        Ok(moment(Some(named), offset_s))
    }
}
