//! Faults in the bytes of shipped images are not validated: what is put in, and what is found.
//!
//! `WHIPPEN_FAULTS=N` puts in about N faults instead of some hundred, and some of them where one
//! takes long; `WHIPPEN_SEED=N` other ones, `WHIPPEN_TARGET=N` those of one target alone.

mod none;
mod put;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::time::Instant;

use whippen_compiler::modes::ModeId;
use whippen_compiler::validate::{Code, Proven, Question, Routine, Symbols, Verdict, validate};
use whippen_compiler::validation::{Asked, code_of, questions};
use whippen_compiler::{Rng, parallel};
use whippen_isa::{Arch, Code as Halfwords, Flags, Op, parse, reg};
use whippen_runtime::image::ImageInstrument;

use crate::validated::{Built, built_of, built_of_keys};

use none::{ALL, Live, difference, live_behind};
use put::{Fault, KINDS, Kind, Whose, code_of_loop, faulty, instructions, name};
pub use put::{NOP, Placed, code_of_key};

/// Where faults are put: the code of which keys or part, or the entry or the end of their tick.
#[derive(Clone, Copy)]
struct Target {
    board: &'static str,
    file: &'static str,
    code: &'static str,
    /// The entry or the end of the tick, or a routine; the modes where there is none.
    whose: Option<Whose>,
    keys: u32,
    /// Whether it takes little time.
    is_quick: bool,
    /// How many of a thousand.
    share: usize,
}

const fn modes(file: &'static str, code: &'static str, share: usize) -> Target {
    Target {
        board: "rp2350",
        file,
        code,
        whose: None,
        keys: 2,
        is_quick: true,
        share,
    }
}

/// Besides plain instruments one that reads a delay line at an index, exact quotients in the entry
/// and in a part, and quotients for searches; the ring of events at the entry and the end, and
/// lines at the end; what prepares keys, of which each core has some; branches that join and
/// products that are called for, on a core without long ones; roots, in modes and in entries; modes
/// that are shown value by value.
const TARGETS: [Target; 26] = [
    modes("hammond.whip", "core0", 60),
    modes("celesta.whip", "core0", 220),
    modes("harpsichord.whip", "core0", 230),
    modes("clavichord-heard.whip", "core0", 100),
    Target {
        whose: Some(Whose::Entry),
        ..modes("snap-dome.whip", "core0", 30)
    },
    Target {
        board: "rp2040",
        ..modes("harpsichord.whip", "core0", 220)
    },
    Target {
        board: "stm32f4",
        ..modes("harpsichord.whip", "core0", 100)
    },
    Target {
        is_quick: false,
        ..modes("keytar.whip", "core1_part0", 30)
    },
    Target {
        is_quick: false,
        ..modes("rubbed-mouse.whip", "core0_part1", 10)
    },
    Target {
        board: "rp2040",
        whose: Some(Whose::Entry),
        ..modes("harpsichord.whip", "core0", 30)
    },
    Target {
        whose: Some(Whose::End),
        ..modes("clavichord-heard.whip", "core0", 40)
    },
    Target {
        board: "rp2040",
        whose: Some(Whose::End),
        ..modes("clavichord.whip", "core0", 40)
    },
    routine(Routine::Init, "rp2350", "clavichord-heard.whip"),
    routine(Routine::Begin, "rp2350", "clavichord-heard.whip"),
    routine(Routine::Init, "rp2040", "harpsichord.whip"),
    routine(Routine::Begin, "rp2040", "harpsichord.whip"),
    routine(Routine::Init, "stm32f4", "snap-dome.whip"),
    routine(Routine::Begin, "stm32f4", "snap-dome.whip"),
    slow("rp2040", None, "knob.whip"),
    slow("rp2040", None, "tracker-organ.whip"),
    slow("rp2040", None, "clavichord-heard.whip"),
    slow("rp2350", None, ROOTS),
    slow("rp2040", None, ROOTS),
    slow("rp2350", Some(Whose::Entry), ROOTS),
    slow("rp2040", Some(Whose::Entry), ROOTS),
    Target {
        is_quick: false,
        ..modes("grand-action.whip", "core0", 10)
    },
];

/// From where the bundled ones are.
const ROOTS: &str = "../tests/programs/roots.whip";

const fn slow(board: &'static str, whose: Option<Whose>, file: &'static str) -> Target {
    Target {
        board,
        whose,
        is_quick: false,
        ..modes(file, "core0", 30)
    }
}

const fn routine(routine: Routine, board: &'static str, file: &'static str) -> Target {
    Target {
        board,
        whose: Some(Whose::Routine(routine)),
        keys: 6,
        ..modes(file, "core0", 30)
    }
}

/// Faults that are judged one after the other, with the same numbers.
const PIECE: usize = 16;

/// How often something is drawn that may not fit.
const TRIES: usize = 100;

/// What became of faults.
#[derive(Default, Clone, Copy)]
struct Count {
    /// Refuted with numbers.
    refuted: usize,
    unproven: usize,
    /// None: no path comes to it.
    aside: usize,
    /// None: the operands commute.
    commuted: usize,
    /// None: only what is not read is other.
    dead: usize,
    /// Validated all the same.
    survived: usize,
}

impl Count {
    /// All, then each.
    fn numbers(self) -> [usize; 7] {
        let Count {
            refuted,
            unproven,
            aside,
            commuted,
            dead,
            survived,
        } = self;
        let found = refuted + unproven;
        let all = found + aside + commuted + dead + survived;
        [all, refuted, unproven, aside, commuted, dead, survived]
    }

    fn line(self) -> String {
        let columns = self.numbers().map(|number| format!("{number:9}"));
        columns.concat()
    }
}

/// What the columns of a count are.
const COLUMNS: [&str; 7] = [
    "all", "refuted", "unproven", "aside", "commuted", "dead", "survived",
];

/// Code of keys, in which faults are put.
struct Site<'a> {
    target: Target,
    arch: Arch,
    code: Code,
    /// Where each symbol begins.
    begins: Vec<u32>,
    asked: &'a Asked<'a>,
    proven: Proven<'a>,
    symbols: &'a Symbols,
}

impl<'a> Site<'a> {
    fn new(target: Target, built: &Built, asked: &'a Asked<'a>, question: &Question<'a>) -> Self {
        let symbols = built.whole.image.symbols.iter();
        Site {
            target,
            arch: built.whole.image.arch,
            code: question.code.clone(),
            begins: symbols.map(|symbol| symbol.address).collect(),
            asked,
            proven: Proven::new(question).expect("what all modes begin with is validated"),
            symbols: question.symbols,
        }
    }

    /// Faults of all kinds alike, in all its modes alike, none twice.
    fn faults(&self, count: usize, seed: u64) -> Vec<Fault> {
        let modes = self.proven.modes().into_iter().map(Whose::Mode);
        let whose = self
            .target
            .whose
            .map_or_else(|| modes.collect(), |one| vec![one]);
        let share = |at: usize| count * (at + 1) / whose.len() - count * at / whose.len();
        let faults = whose.iter().enumerate().map(|(at, whose)| {
            let mut rng = Rng::new(seed.wrapping_mul(1 << 20).wrapping_add(at as u64));
            self.faults_of(*whose, share(at), &mut rng)
        });
        faults.flatten().collect()
    }

    fn faults_of(&self, whose: Whose, count: usize, rng: &mut Rng) -> Vec<Fault> {
        let (from, placed) = self.code_from(&self.code, whose);
        let (mut known, mut all) = (BTreeSet::new(), Vec::new());
        for _ in 0..TRIES * count {
            if all.len() == count {
                break;
            }
            let kind = rng.pick(&KINDS).0;
            let found = (0..TRIES).find_map(|_| {
                let own = rng.pick(&placed);
                Some((own, faulty(rng, &self.code, self.arch, own, kind)?))
            });
            let Some((placed, words)) = found else {
                continue;
            };
            if known.insert((placed.0, words.clone())) {
                all.push(Fault {
                    kind,
                    whose,
                    from,
                    placed,
                    words,
                });
            }
        }
        all
    }

    /// The instructions of a mode, or of the tick's entry or end, and where they begin.
    fn code_from(&self, code: &Code, whose: Whose) -> (u32, Vec<Placed>) {
        let from = match whose {
            Whose::Mode(mode) => self.asked.code_of_mode(mode),
            Whose::Entry => self.symbols.tick,
            Whose::End => self.symbols.end,
            Whose::Routine(Routine::Begin) => self.symbols.begin,
            Whose::Routine(Routine::Init) => self.symbols.init,
        };
        let of = match whose {
            Whose::Routine(Routine::Init) => code_of_loop,
            _ => code_of_key,
        };
        (from, of(code, self.arch, from, self.behind(from)))
    }

    /// Where the next piece of code begins.
    fn behind(&self, from: u32) -> u32 {
        let behind = self.begins.iter().filter(|at| **at > from).min();
        behind.copied().unwrap_or(from)
    }

    /// What is live where a key's code goes on to the next key's, or to the end of the tick; where
    /// that or a routine returns, it is the stack.
    fn live_at_exit(&self) -> Live {
        if matches!(self.target.whose, Some(Whose::End | Whose::Routine(_))) {
            return Live {
                registers: 1 << reg::SP,
                ..Live::default()
            };
        }
        let modes = self.asked.modes().modes.ids();
        let all = modes.map(|mode| self.code_from(&self.code, Whose::Mode(mode)).1);
        let end = self.code_from(&self.code, Whose::End).1;
        let all: Vec<Vec<Placed>> = all.chain([end]).collect();
        let roles = [6, 7, 10, 11, reg::SP];
        let mut exit = Live {
            registers: roles.iter().fold(0, |all, register| all | 1 << register),
            flags: Flags::Q | Flags::GE,
            slots: 0,
        };
        loop {
            let first = all.iter().map(|code| match code.first() {
                Some((at, _, inst)) => live_behind(code, exit)[at].before(inst),
                None => ALL,
            });
            let more = first.fold(exit, Live::and);
            if more == exit {
                return exit;
            }
            exit = more;
        }
    }

    /// Whether the fault is other only in what nobody reads.
    fn is_dead(&self, fault: &Fault, exit: Live) -> bool {
        let (at, _, was) = fault.placed;
        let differs = fault.now(self.arch).and_then(|now| difference(&was, &now));
        let Some(differs) = differs else { return false };
        [self.code.clone(), fault.put(&self.code)]
            .iter()
            .all(|code| {
                let behind = live_behind(&self.code_from(code, fault.whose).1, exit);
                behind.get(&at).is_some_and(|live| !live.meets(differs))
            })
    }

    /// The verdict on each.
    fn judge(&self, faults: Vec<Fault>) -> Vec<(Fault, Verdict)> {
        let mut pieces: Vec<Vec<Fault>> = Vec::new();
        for fault in faults {
            match pieces.last_mut() {
                Some(last) if last.len() < PIECE && last[0].whose == fault.whose => {
                    last.push(fault)
                }
                _ => pieces.push(vec![fault]),
            }
        }
        let judged = parallel::map(pieces, |piece| {
            let mut ticks = self.proven.ticks(match piece[0].whose {
                Whose::Mode(mode) => mode,
                _ => ModeId(0),
            });
            let judged = piece.into_iter().map(|fault| {
                let at = fault.placed.0;
                let changed = at..at + 2 * fault.words.len() as u32;
                let verdict = self
                    .proven
                    .judge(&mut ticks, &fault.put(&self.code), &changed);
                (fault, verdict)
            });
            judged.collect::<Vec<_>>()
        });
        judged.into_iter().flatten().collect()
    }
}

/// Puts faults into a target; tells what became of them.
fn told(target: Target, count: usize, seed: u64) -> String {
    let built = built_of_keys(target.file, target.board, target.keys);
    let instruments = ImageInstrument::borrow_all(std::slice::from_ref(&built.instrument));
    let code = code_of(&built.whole);
    let all = questions(&built.whole, &instruments);
    let asked = all.iter().find(|asked| asked.name == target.code);
    let asked: &Asked = asked.expect("the image has that code");
    let question = asked.question(&built.whole, &code);
    let site = Site::new(target, &built, asked, &question);
    let exit = site.live_at_exit();
    let mut counts: BTreeMap<Kind, Count> = BTreeMap::new();
    let mut survivors = String::new();
    for (fault, verdict) in site.judge(site.faults(count, seed)) {
        let own = counts.entry(fault.kind).or_default();
        match verdict {
            Verdict::Refuted { .. } => own.refuted += 1,
            Verdict::Unproven { .. } => own.unproven += 1,
            Verdict::Validated { cases: 0 } => own.aside += 1,
            Verdict::Validated { .. } if fault.is_commuted(site.arch) => own.commuted += 1,
            Verdict::Validated { .. } if site.is_dead(&fault, exit) => own.dead += 1,
            Verdict::Validated { .. } => {
                own.survived += 1;
                let _ = writeln!(survivors, "  {}", fault.line(site.arch));
            }
        }
    }
    let Target {
        file, board, code, ..
    } = target;
    let whose = match target.whose {
        Some(Whose::Routine(routine)) => format!("{routine} of "),
        _ => String::new(),
    };
    let columns = COLUMNS.map(|column| format!("{column:>9}")).concat();
    let mut text = format!("{whose}{file}, {code} on {board}\n  {:28}{columns}\n", "");
    for (kind, count) in &counts {
        let _ = writeln!(text, "  {:28}{}", name(*kind), count.line());
    }
    text + &survivors
}

#[test]
fn faults_are_not_validated() {
    let wanted = whippen_need::asked("WHIPPEN_FAULTS");
    let count: usize = wanted.unwrap_or(240);
    let seed = whippen_need::count("WHIPPEN_SEED", 7);
    let mut text = String::new();
    let only: Option<usize> = whippen_need::asked("WHIPPEN_TARGET");
    let is_asked = |(at, target): &(usize, &Target)| {
        only.is_none_or(|only| only == *at) && (wanted.is_some() || target.is_quick)
    };
    for (at, target) in TARGETS.iter().enumerate().filter(is_asked) {
        let begun = Instant::now();
        let seed = Rng::new(seed).next().wrapping_add(at as u64);
        let told = told(*target, count * target.share / 1000, seed);
        if wanted.is_some() {
            println!("{told}  in {:.1} s", begun.elapsed().as_secs_f64());
        }
        text += &told;
    }
    if wanted.is_none() && only.is_none() {
        insta::assert_snapshot!(text);
    }
}

/// A tick that does not go back to where it was called from, with the stack as it was.
#[test]
fn a_tick_that_does_not_return_is_not_validated() {
    let built = built_of("snap-dome.whip", "rp2350");
    let instruments = ImageInstrument::borrow_all(std::slice::from_ref(&built.instrument));
    let code = code_of(&built.whole);
    let all = questions(&built.whole, &instruments);
    let question = all[0].question(&built.whole, &code);
    let arch = built.whole.image.arch;
    let find = |from: u32, text: &str| {
        let mut all = instructions(&code, arch, from, from + 400).into_iter();
        let found = all.find(|(.., inst)| inst.to_string().starts_with(text));
        found.unwrap_or_else(|| panic!("no `{text}`")).0
    };
    let [tick, end] = [question.symbols.tick, question.symbols.end];
    let cases = [
        ("push", find(tick, "push {lr}"), "nop"),
        ("push", find(tick, "push {lr}"), "push {r0, lr}"),
        ("what is pushed", find(tick, "push {lr}"), "push {r0}"),
        ("taken", find(tick, "sub sp"), "sub sp, #4"),
        ("taken back", find(end, "add sp"), "nop"),
        ("popped", find(end, "pop {pc}"), "pop {r0, pc}"),
    ];
    assert!(validate(&question).modes[0].is_validated());
    for (what, at, text) in cases {
        let inst = parse(text, arch, None).expect("an instruction");
        let Ok(Halfwords::Narrow(word)) = inst.encode(arch) else {
            panic!("{text} is wide");
        };
        let mut faulty = code.clone();
        faulty.put(at, word);
        let question = Question {
            code: &faulty,
            ..question.clone()
        };
        let report = validate(&question);
        assert!(!report.entry.is_validated(), "{what}: {text}");
        assert!(!report.modes[0].is_validated(), "{what}: {text}");
    }
}

/// A register that the tick's entry leaves to all modes is changed by one: no mode by itself does
/// anything wrong.
#[test]
fn a_register_of_all_modes_is_not_changed() {
    let target = modes("harpsichord.whip", "core0", 0);
    let built = built_of(target.file, target.board);
    let instruments = ImageInstrument::borrow_all(std::slice::from_ref(&built.instrument));
    let code = code_of(&built.whole);
    let all = questions(&built.whole, &instruments);
    let question = all[0].question(&built.whole, &code);
    let site = Site::new(target, &built, &all[0], &question);
    let verdict = |mode: ModeId, at: u32, half: u16| {
        let mut faulty = site.code.clone();
        faulty.put(at, half);
        let mut ticks = site.proven.ticks(mode);
        site.proven.judge(&mut ticks, &faulty, &(at..at + 2))
    };
    // A constant that is there already.
    let idle = site.proven.modes().into_iter().find_map(|mode| {
        let all = site.code_from(&site.code, Whose::Mode(mode)).1;
        let idle = all.iter().find(|(at, _, inst)| {
            let is_move = inst.op() == Op::MOV_immediate && inst.size() == 2;
            is_move && verdict(mode, *at, NOP).is_validated()
        });
        idle.map(|(at, ..)| (mode, *at))
    });
    let (mode, at) = idle.expect("a move that does nothing");
    for register in [8, 9, 12] {
        // MOV of R0 to a high register.
        let told = verdict(mode, at, 0x4680 | (register & 7)).to_string();
        let why = format!("unproven (entry): it changes r{register}, which a mode reads");
        assert_eq!(told, why);
    }
}
