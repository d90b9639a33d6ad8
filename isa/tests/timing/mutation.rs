//! Every number of a table matters: changed by one, some program comes out otherwise.

use whippen_isa::timing::{Core, Fact, Kind, Line, Program, Takers};
use whippen_isa::{Arch, Class};

/// A changed core, and what was changed.
type Mutant = (String, Core);

/// The mutants that no program notices.
pub fn survivors(core: &Core, programs: &[Program]) -> Vec<String> {
    let before: Vec<u64> = programs.iter().map(|p| p.run(core).cycles).collect();
    let noticed = |mutant: &Core| {
        programs
            .iter()
            .zip(&before)
            .any(|(p, &cycles)| p.run(mutant).cycles != cycles)
    };
    mutants(core)
        .into_iter()
        .filter(|(_, mutant)| !noticed(mutant))
        .map(|(what, _)| what)
        .collect()
}

fn mutants(core: &Core) -> Vec<Mutant> {
    let lines = core.lines.iter().enumerate();
    let of_lines = lines.flat_map(|(at, line)| {
        line.classes
            .iter()
            .flat_map(move |&class| of_line(core, at, line, class))
    });
    of_lines.chain(of_numbers(core)).collect()
}

/// A line in front of line `at`, for one of its classes, changed in one column.
fn of_line(core: &Core, at: usize, line: &Line, class: Class) -> Vec<Mutant> {
    let classes: &'static [Class] = Box::leak(Box::new([class]));
    changes(line, class)
        .into_iter()
        // On a core where nothing is late it does not matter for whom.
        .filter(|(what, _)| core.late.cycles != 0 || !what.starts_with("late"))
        .map(|(what, changed)| {
            let mut lines = core.lines.to_vec();
            lines.insert(at, Line { classes, ..changed });
            (
                format!("{class:?} {:?}: {what}", line.kind),
                Core {
                    lines: Box::leak(lines.into()),
                    ..*core
                },
            )
        })
        .collect()
}

fn changes(line: &Line, class: Class) -> Vec<(&'static str, Line)> {
    let on_time = line.late_for.is_empty();
    let late_for = if on_time { Takers::ALL } else { Takers::NONE };
    let others = Takers::ALL.without(line.late_for);
    let float = line.float_hold != 0;
    let all = [
        (
            true,
            "cycles",
            Line {
                cycles: line.cycles + 1,
                ..*line
            },
        ),
        (
            line.each != 0,
            "each",
            Line {
                each: line.each + 1,
                ..*line
            },
        ),
        (
            !on_time || may_be_late(line.kind, class),
            "late",
            Line { late_for, ..*line },
        ),
        (
            !on_time && !others.is_empty(),
            "late for others",
            Line {
                late_for: Takers::ALL,
                ..*line
            },
        ),
        (
            !on_time && others.is_empty(),
            "late for sums",
            Line {
                late_for: Takers::ALL.without(Takers::ACCUMULATOR),
                ..*line
            },
        ),
        (
            line.late_base,
            "late base",
            Line {
                late_base: false,
                ..*line
            },
        ),
        (
            float,
            "float_hold",
            Line {
                float_hold: line.float_hold + 1,
                ..*line
            },
        ),
        (
            float && writes_float(class),
            "float_delay",
            Line {
                float_delay: line.float_delay + 1,
                ..*line
            },
        ),
    ];
    all.into_iter()
        .filter(|(applies, ..)| *applies)
        .map(|(_, what, line)| (what, line))
        .collect()
}

/// Whether instructions of the class have a result in a core register that somebody could wait for.
fn may_be_late(kind: Kind, class: Class) -> bool {
    use Class::*;
    matches!(class, Alu | Move | Shift | Bitfield | Extend | Bits) && kind != Kind::WritesPc
}

fn writes_float(class: Class) -> bool {
    use Class::*;
    matches!(
        class,
        FloatAlu
            | FloatMultiplyAdd
            | FloatDivide
            | FloatCompare
            | FloatConvert
            | FloatMove
            | FloatLoad
            | FloatLoadMultiple
    )
}

fn of_numbers(core: &Core) -> Vec<Mutant> {
    let down = |fact: Fact| Fact {
        cycles: fact.cycles.saturating_sub(1),
        ..fact
    };
    let up = |fact: Fact| Fact {
        cycles: fact.cycles + 1,
        ..fact
    };
    let (branches, divide) = (core.branches, core.divide);
    let named = |what: &str, core: Core| (what.to_string(), core);
    let mut all = vec![
        named(
            "branches.taken",
            Core {
                branches: with(branches, |b| b.taken = up(b.taken)),
                ..*core
            },
        ),
        named(
            "branches.not_taken",
            Core {
                branches: with(branches, |b| b.not_taken = up(b.not_taken)),
                ..*core
            },
        ),
        named(
            "branches.from_load",
            Core {
                branches: with(branches, |b| b.from_load = up(b.from_load)),
                ..*core
            },
        ),
        named(
            "branches.split_target",
            Core {
                branches: with(branches, |b| b.split_target = up(b.split_target)),
                ..*core
            },
        ),
        named(
            "branches.folded",
            Core {
                branches: with(branches, |b| b.folded = down(b.folded)),
                ..*core
            },
        ),
        named(
            "branches.folded_it",
            Core {
                branches: with(branches, |b| b.folded_it = down(b.folded_it)),
                ..*core
            },
        ),
        named(
            "late",
            Core {
                late: down(core.late),
                ..*core
            },
        ),
        named(
            "overlap",
            Core {
                overlap: down(core.overlap),
                ..*core
            },
        ),
        named(
            "near",
            Core {
                near: down(core.near),
                ..*core
            },
        ),
    ];
    if core.arch != Arch::V6M {
        all.push(named(
            "skipped",
            Core {
                skipped: up(core.skipped),
                ..*core
            },
        ));
    }
    if core
        .lines
        .iter()
        .any(|line| line.classes.contains(&Class::Divide))
    {
        all.push(named(
            "divide.start",
            Core {
                divide: with(divide, |d| d.start = up(d.start)),
                ..*core
            },
        ));
        let slower = with(divide, |d| d.bits_per_cycle = up(d.bits_per_cycle));
        all.push(named(
            "divide.bits_per_cycle",
            Core {
                divide: slower,
                ..*core
            },
        ));
    }
    // A saving that is zero is none.
    all.retain(|(_, mutant)| mutant != core);
    all
}

fn with<T>(mut value: T, change: impl Fn(&mut T)) -> T {
    change(&mut value);
    value
}
