//! Whether two orders of the same instructions compute the same, found without dependences:
//! everyone who reads a register, flags or memory must find there what the same instruction left.

use std::collections::BTreeMap;

/// An instruction by what it is, as text, and the places that it reads and writes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Step {
    pub name: String,
    pub reads: Vec<String>,
    pub writes: Vec<String>,
}

/// What one instruction finds: itself, and who left what it reads.
type Found = (String, Vec<(String, Option<String>)>);

pub(super) fn computes_same(one: &[Step], other: &[Step]) -> bool {
    trace_sources(one) == trace_sources(other)
}

/// What each instruction finds, sorted, and what is left at the end.
fn trace_sources(steps: &[Step]) -> (Vec<Found>, BTreeMap<String, String>) {
    let mut left: BTreeMap<String, String> = BTreeMap::new();
    let mut all = Vec::new();
    for step in steps {
        let seen = step
            .reads
            .iter()
            .map(|place| (place.clone(), left.get(place).cloned()))
            .collect();
        for place in &step.writes {
            left.insert(place.clone(), step.name.clone());
        }
        all.push((step.name.clone(), seen));
    }
    all.sort();
    (all, left)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(name: &str, reads: &[&str], writes: &[&str]) -> Step {
        let all = |places: &[&str]| places.iter().map(ToString::to_string).collect();
        Step {
            name: name.to_string(),
            reads: all(reads),
            writes: all(writes),
        }
    }

    #[test]
    fn only_what_nobody_can_tell_may_change_places() {
        let code = [
            step("a", &[], &["x"]),
            step("b", &["x"], &["y"]),
            step("c", &[], &["z"]),
            step("d", &["y"], &["x"]),
        ];
        let order = |places: [usize; 4]| places.map(|at| code[at].clone());
        assert!(computes_same(&code, &order([2, 0, 1, 3])));
        assert!(
            !computes_same(&code, &order([1, 0, 2, 3])),
            "b would find another x"
        );
        assert!(!computes_same(&code, &order([0, 1, 2, 2])), "d is missing");
        assert!(
            !computes_same(&code[..1], &[step("a", &[], &["y"])]),
            "what is left is another"
        );
    }
}
