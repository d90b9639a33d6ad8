//! Cycles against counts derived on paper, program by program.

mod golden;
mod mutation;
mod random;

use whippen_isa::timing::{Core, Program, Rules, Timed, programs, rules};
use whippen_isa::{Arch, ItState, decode};

fn parse(text: &str, core: &Core) -> Vec<Program> {
    programs(text, core).unwrap_or_else(|error| panic!("{error}"))
}

/// The programs of a file, and how they come out on `core`.
fn check(core: &Core, text: &str) {
    let programs = parse(text, core);
    let wrong: Vec<String> = programs
        .iter()
        .filter_map(|p| difference(core, p))
        .collect();
    assert!(
        !programs.is_empty() && wrong.is_empty(),
        "{}",
        wrong.join("\n")
    );
}

fn difference(core: &Core, program: &Program) -> Option<String> {
    let run = program.run(core);
    (run.cycles != program.want).then(|| {
        format!(
            "{}: {} cycles, on paper {}\n{}",
            program.title, run.cycles, program.want, run.listing
        )
    })
}

const PUBLISHED_M33: &str = include_str!("published-m33.txt");
const RULES_M33: &str = rules(Arch::V8M);

#[test]
fn published_cortex_m33() {
    check(&Core::cortex_m33(), PUBLISHED_M33);
}

#[test]
fn rules_cortex_m33() {
    check(&Core::cortex_m33(), RULES_M33);
}

#[test]
fn disputed_cortex_m33() {
    let core = Core {
        rules: Rules {
            shifted_register_flags: 1,
            ..Rules::default()
        },
        ..Core::cortex_m33()
    };
    check(&core, include_str!("disputed-m33.txt"));
}

#[test]
fn every_number_of_cortex_m33_matters() {
    no_survivors(&Core::cortex_m33(), &[PUBLISHED_M33, RULES_M33]);
}

fn no_survivors(core: &Core, texts: &[&str]) {
    let programs: Vec<Program> = texts.iter().flat_map(|text| parse(text, core)).collect();
    let survivors = mutation::survivors(core, &programs);
    assert!(
        survivors.is_empty(),
        "changed by one, and nothing comes out otherwise:\n{}",
        survivors.join("\n")
    );
}

/// Numbers that no program shows which a core can execute alone, so that no self-test asks a chip
/// for them. `WHIPPEN_BLESS=1` writes the list instead.
#[test]
fn numbers_that_no_chip_is_asked_for() {
    let mut list = String::new();
    for core in [Core::cortex_m33(), Core::cortex_m4(), Core::cortex_m0plus()] {
        let alone = parse(rules(core.arch), &core).into_iter();
        let alone: Vec<Program> = alone.filter(|program| program.apart.is_none()).collect();
        list += &format!("{}\n", core.name);
        for unasked in mutation::survivors(&core, &alone) {
            list += &format!("  {unasked}\n");
        }
    }
    same_as_kept("unasked.txt", &list);
}

const RULES_M0PLUS: &str = rules(Arch::V6M);
const RULES_M4: &str = rules(Arch::V7EM);

#[test]
fn rules_cortex_m0plus() {
    check(&Core::cortex_m0plus(), RULES_M0PLUS);
}

#[test]
fn rules_cortex_m4() {
    check(&Core::cortex_m4(), RULES_M4);
}

/// What the sources leave open of a Cortex-M4, counted at its worst.
#[test]
fn worst_of_cortex_m4() {
    check(&Core::cortex_m4().at_worst(), include_str!("worst-m4.txt"));
}

#[test]
fn every_number_of_cortex_m0plus_matters() {
    no_survivors(&Core::cortex_m0plus(), &[RULES_M0PLUS]);
}

#[test]
fn every_number_of_cortex_m4_matters() {
    no_survivors(&Core::cortex_m4(), &[RULES_M4]);
}

/// `WHIPPEN_BLESS=1` writes the table instead.
#[test]
fn cycles_of_every_instruction() {
    same_as_kept("cycles.txt", &golden::table());
}

/// That a kept file beside this one has that text, or it is written.
fn same_as_kept(name: &str, text: &str) {
    let path = format!("{}/tests/timing/{name}", env!("CARGO_MANIFEST_DIR"));
    if std::env::var_os("WHIPPEN_BLESS").is_some() {
        std::fs::write(&path, text).expect("writable");
    }
    let kept = std::fs::read_to_string(&path).unwrap_or_default();
    let mut both = text.lines().zip(kept.lines());
    let differ = both.find(|(new, old)| new != old);
    assert!(
        kept == text,
        "isa/tests/timing/{name} is out of date (WHIPPEN_BLESS=1): {differ:?}"
    );
}

/// An instruction of the Cortex-M33 by its halfwords.
fn prepared(core: &Core, [hw1, hw2]: [u16; 2], it: ItState) -> Timed {
    core.prepare(&decode(hw1, hw2, Arch::V8M, it).expect("an instruction"))
}

#[test]
fn a_cost_is_as_sure_as_its_least_sure_part() {
    use whippen_isa::timing::{Evidence, Outcome, Pipe, Reason};
    let core = Core::cortex_m33();
    let prepare = |hw1, hw2| prepared(&core, [hw1, hw2], ItState::OUTSIDE);
    let (load, add, divide) = (
        prepare(0x6808, 0),
        prepare(0x1840, 0),
        prepare(0xfbb0, 0xf0f1),
    );
    let (pipe, cost) = core.issue(Pipe::default(), &load, 0, &Outcome::NEXT);
    assert_eq!(core.evidence(&load, &cost), Evidence::Exact);
    let (_, cost) = core.issue(pipe, &add, 2, &Outcome::NEXT);
    assert_eq!(
        (cost.to_string().as_str(), core.evidence(&add, &cost)),
        ("2: 1 issue, 1 late r0", Evidence::Exact)
    );
    assert_eq!(core.source(&add, Reason::LateResult).source, "3.7.4.9.1");
    let (_, cost) = core.issue(pipe, &divide, 2, &Outcome::divided(100, 3, false));
    assert_eq!(
        (cost.cycles(), core.evidence(&divide, &cost)),
        (6, Evidence::Rule)
    );
}

/// What a cost says of itself, in words.
#[test]
fn a_cost_names_what_it_waited_for_and_its_source() {
    use whippen_isa::timing::{Evidence, Outcome, Pipe, Reason, Takers};
    let core = Core::cortex_m33();
    let prepare = |hw1, hw2| prepared(&core, [hw1, hw2], ItState::OUTSIDE);
    // `ldr r3, [r1]`, `adds r0, r3, r1`; `vmul.f32 s2, s0, s0`, `vadd.f32 s0, s2, s2`.
    for ([first, then], says, late) in [
        ([(0x680b, 0), (0x1858, 0)], "2: 1 issue, 1 late r3", [8, 0]),
        (
            [(0xee20, 0x1a00), (0xee31, 0x0a01)],
            "2: 1 issue, 1 late s2",
            [0, 4],
        ),
    ] {
        let [first, then] = [first, then].map(|(hw1, hw2)| prepare(hw1, hw2));
        let (pipe, _) = core.issue(Pipe::default(), &first, 0, &Outcome::NEXT);
        let (_, cost) = core.issue(pipe, &then, 4, &Outcome::NEXT);
        let of = cost.waited_for();
        let found = (
            cost.to_string(),
            [u32::from(of.core_bits()), of.single_bits()],
        );
        assert_eq!(found, (says.to_string(), late));
    }
    let [add, it, nop] = [0x1858, 0xbf08, 0xbf00].map(|hw1| prepare(hw1, 0));
    assert!(
        core.source(&add, Reason::Issue)
            .source
            .starts_with("3.7.4.9.2")
    );
    let [of_it, of_nop] = [it, nop].map(|own| core.source(&own, Reason::Folded).source);
    assert!(of_it.contains("names forwards only"), "{of_it}");
    assert!(!of_nop.contains("names forwards only"), "{of_nop}");
    let classes = [Evidence::Exact, Evidence::Rule, Evidence::Estimate];
    let classes = classes.map(|class| class.to_string());
    assert_eq!(classes, ["exact", "rule", "estimate"]);
    assert_eq!(Takers::ALL.and(Takers::ADDRESS), Takers::ALL);
}

/// POP {R4-R11, PC} leads nowhere where it returns from an exception: nine words are loaded all the
/// same. BX LR is a cycle, and a POP that is not executed the one of a branch that is not taken.
#[test]
fn a_return_from_an_exception_loads_all_its_words() {
    use whippen_isa::timing::{Outcome, Pipe};
    for core in [Core::cortex_m33(), Core::cortex_m4()] {
        let cycles = |words, it, outcome: &Outcome| {
            let timed = prepared(&core, words, it);
            core.issue(Pipe::default(), &timed, 0, outcome).1.cycles()
        };
        let outside = ItState::OUTSIDE;
        let [popped, kept] = [[0xe8bd, 0x8ff0], [0xe8bd, 0x4ff0]];
        let words = cycles(kept, outside, &Outcome::NEXT);
        assert_eq!(cycles(popped, outside, &Outcome::NEXT), words);
        assert!(words >= 9);
        assert_eq!(cycles([0x4770, 0], outside, &Outcome::NEXT), 1);
        let inside = ItState::after_it(0, 8).expect("IT EQ");
        assert_eq!(cycles(popped, inside, &Outcome::SKIPPED), 1);
    }
}

/// An instruction with a condition that is met costs what it costs without one.
#[test]
fn a_condition_that_is_met_costs_nothing() {
    use whippen_isa::timing::{Outcome, Pipe, Reason};
    let core = Core::cortex_m33();
    // `ldmia r0!, {r1-r7}`, in `it eq` and outside.
    let inside = ItState::after_it(0, 8).expect("a state");
    let costs = [ItState::OUTSIDE, inside].map(|it| {
        let load = prepared(&core, [0xc8fe, 0], it);
        let met = core.issue(Pipe::default(), &load, 0, &Outcome::NEXT);
        met.1.part(Reason::Issue)
    });
    assert!(costs[0] > 1 && costs[0] == costs[1], "{costs:?}");
}

/// An access starts under the load before it, but for one to another memory; one whose address that
/// load makes does not, wherever it goes.
#[test]
fn an_access_to_another_memory_does_not_overlap() {
    use whippen_isa::timing::{Outcome, Pipe};
    let core = Core::cortex_m4();
    // `ldr r0, [r1]`, then `ldr r2, [r3]` or `ldr r2, [r0]`.
    let [first, other, dependent] = [0x6808, 0x681a, 0x6802]
        .map(|hw1| core.prepare(&decode(hw1, 0, Arch::V7EM, ItState::OUTSIDE).expect("a load")));
    let (pipe, _) = core.issue(Pipe::default(), &first, 0, &Outcome::NEXT);
    let cycles = |load: &Timed, apart| {
        let outcome = Outcome {
            apart,
            ..Outcome::NEXT
        };
        core.issue(pipe, load, 2, &outcome).1.cycles()
    };
    let found = [&other, &dependent].map(|load| [cycles(load, false), cycles(load, true)]);
    assert_eq!(found, [[1, 2], [2, 2]]);
}

/// Which instructions may delay what comes behind them, by core.
#[test]
fn what_delays_nobody() {
    use whippen_isa::timing::{Outcome, Pipe};
    let (m33, m4) = (Core::cortex_m33(), Core::cortex_m4());
    let disputed = Core {
        rules: Rules {
            shifted_register_flags: 1,
            ..Rules::default()
        },
        ..m33
    };
    let left = |core: &Core, [hw1, hw2]: [u16; 2]| {
        let inst = decode(hw1, hw2, core.arch, ItState::OUTSIDE).expect("an instruction");
        let pipe = core
            .issue(Pipe::default(), &core.prepare(&inst), 0, &Outcome::NEXT)
            .0;
        assert_eq!(Pipe::from_bits(pipe.to_bits()), pipe, "{inst}");
        pipe
    };
    // `mov.w`, `vmov.f32`: nothing is left of either, so both leave one state.
    let [moved, moved_float] = [[0xea4f, 0x0809], [0xeef0, 0x0a40]].map(|code| left(&m33, code));
    assert_eq!(moved.to_bits(), moved_float.to_bits());
    let behind = |core: &Core, code| left(core, code).delays_nobody();
    let (store, add, load) = ([0x6008, 0], [0x1840, 0], [0x6808, 0]);
    // `vadd.f32`, `vfma.f32`, `vcmp.f32`; `cmp.w` of a shifted register.
    let floats = [[0xee30, 0x0a01], [0xeea0, 0x0a81], [0xeeb4, 0x0a60]];
    let shifted = [0xebb0, 0x0fd1];
    assert!([store, add].iter().all(|&code| behind(&m33, code)));
    assert!(behind(&m33.at_worst(), store) && behind(&m4, store));
    assert!(!behind(&m4.at_worst(), store) && !behind(&m33, load));
    assert!(floats.iter().all(|&code| !behind(&m33, code)));
    assert!(behind(&m33, shifted) && !behind(&disputed, shifted));
}

/// What a program needs is in its text, and a text that lacks something, or says what cannot be
/// read, is refused.
#[test]
fn a_program_says_what_it_needs() {
    let core = Core::cortex_m33();
    let read = |text: &str| programs(&format!("\n== title\npaper\n{text}"), &core);
    let code = "20000000 1840      adds r0, r0, r1\n";
    let needs = "registers r6=20001001 lr=20000011 apsr=40000000\nmemory 20040000=11 20040008=c\n";
    let all = read(&format!("{needs}apart: why\n{code}= 1")).expect("a program");
    let program = &all[0];
    assert_eq!(
        [&program.title, &program.paper],
        ["title", "paper"],
        "as written"
    );
    let registers = [
        (6, 0x2000_1001),
        (14, 0x2000_0011),
        (whippen_isa::timing::APSR, 0x4000_0000),
    ];
    assert_eq!(program.registers, registers);
    assert_eq!(program.memory, [(0x2004_0000, 0x11), (0x2004_0008, 0xc)]);
    assert_eq!(program.apart.as_deref(), Some("why"));
    for wrong in [
        code,
        "= 1",
        "= one",
        "registers r6\n= 1",
        "registers r77=1\n= 1",
        "memory 2004000g=1\n= 1",
        "20000000 1840      subs r0, r0, r1\n= 1",
        "20000000 1840      adds r0, r0, r1 soon\n= 1",
        "20000000 184       adds r0, r0, r1\n= 1",
        "20000000 1840\n= 1",
        "20000000 fbb1      udiv r0, r1, r2\n= 1",
        "20000000 bf0f      itttt eq\n= 1",
    ] {
        assert!(read(&format!("{wrong}\n")).is_err(), "{wrong}");
    }
}

#[test]
fn random_instructions() {
    for core in [Core::cortex_m33(), Core::cortex_m4(), Core::cortex_m0plus()] {
        random::run(&core, 100_000);
    }
}
