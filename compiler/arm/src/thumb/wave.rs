//! The tick of a string as a routine: straight-line code for cores that have saturation and top
//! words, a loop for the Cortex-M0+ (`v6m::string`).
//!
//! ```text
//!   k0 .. k3 | Q_l, P_(l+1), v_l, v_(l+1), W_(l+1), e_l, e_(l+1), what e_(l-1) is without v_l
//! ```
//!
//! A point takes 13 instructions. The coefficients stay in R0 to R3, and nine registers rotate by
//! name; the sum of a point is begun in the register of what the point before it does to its
//! neighbours, as soon as that one's own sum has it. No result is read by the instruction behind
//! it, since sums that saturate, products and loads come a cycle late: two points are in work at a
//! time.
//!
//! It is text, so that no pass that orders or allocates instructions ever sees the thousands of
//! them, and every string has its own, because how many points there are and where they lie is
//! part of it.

use super::object::append_code;
use super::registers::RECORD;
use super::routine::StringRoutine;
use super::state_layout::StateLayout;
use super::{Options, ThumbError, names, v6m};
use crate::features::Features;
use crate::image::Object;
use std::collections::BTreeSet;
use std::fmt::Write;
use whippen_kernel::{Kernel, Op, wave};

/// Where the points of a string lie in the record.
#[derive(Debug, Clone, Copy)]
pub(super) struct StringPlace {
    /// Offsets of the first slope and the first rate.
    pub at: [u32; 2],
    /// How many points there are.
    pub count: u32,
    /// Whether the ends are clamped, not pinned.
    pub clamped: [bool; 2],
}

/// Adds the routines that a kernel's strings call.
///
/// # Errors
/// A string further from the beginning of the record than loads reach; a bug.
pub(super) fn add_routines(
    object: &mut Object,
    kernel: &Kernel,
    layout: &StateLayout,
    options: &Options,
) -> Result<(), ThumbError> {
    let features = Features::of(options.arch);
    for routine in routines(kernel) {
        let [e, v] = routine.cells;
        let place = StringPlace {
            at: [e, v].map(|cell| layout.cells[cell as usize]),
            count: kernel.cells[v as usize].len,
            clamped: routine.clamped,
        };
        let text = if features.legal_as_selected {
            let [slopes, rates] = place.at;
            let end = (slopes + 4 * place.count).max(rates + 4 * (place.count - 1));
            if end > features.load_offset_max {
                return Err(ThumbError::Reach {
                    name: kernel.cells[e as usize].name.clone(),
                    end,
                    max: features.load_offset_max,
                });
            }
            straight_line(place, features.aligns_wide_instructions)
        } else {
            v6m::string_loop(place)
        };
        let name = names::string(&options.name, routine);
        let section = format!(".text.{name}");
        append_code(object, section, options.arch, &text, |label| {
            (label == LABEL).then(|| name.clone())
        })?;
    }
    Ok(())
}

/// The label of the routine in its text.
pub(super) const LABEL: &str = "string";

/// What a kernel's strings call, each once.
fn routines(kernel: &Kernel) -> BTreeSet<StringRoutine> {
    let routine = |inst: &whippen_kernel::Inst| match inst.op {
        Op::Wave(e, v) => Some(StringRoutine::new(
            [e, v],
            wave::ends(&kernel.values, &inst.args),
        )),
        _ => None,
    };
    kernel.all_insts().filter_map(routine).collect()
}

/// The text of a string's tick without loops. `wide`, as the Cortex-M4 wants it: in instructions of
/// 32 bits alone, and loads behind loads.
fn straight_line(place: StringPlace, wide: bool) -> String {
    let suffix = if wide { ".w" } else { "" };
    let mut w = Writer {
        place,
        suffix,
        pairs_loads: wide,
        text: format!(
            "\t.syntax unified\n\t.thumb\n\t.text\n\t.balign 4\n\t.type {LABEL}, %function\n{LABEL}:\n"
        ),
        free: REGISTERS.to_vec(),
    };
    let kept = "r4, r5, r6, r8, r9, r10, r11, r12";
    w.op(format_args!("push{suffix} {{{kept}, lr}}"));
    let mut window = w.enter();
    for point in 0..place.count - 1 {
        window = w.point(point, window);
    }
    w.last_point(window);
    w.op(format_args!("pop{suffix} {{{kept}, pc}}"));
    w.text + &format!("\t.size {LABEL}, . - {LABEL}\n")
}

/// A register, by its name.
type Register = &'static str;

/// Those that hold words of the string, in the order in which they are taken from the end.
const REGISTERS: [Register; 9] = ["lr", "r12", "r11", "r10", "r9", "r8", "r6", "r5", "r4"];

/// Where `k0` to `k3` are.
const K: [Register; 4] = ["r0", "r1", "r2", "r3"];

/// The cells of a string.
const SLOPES: usize = 0;
const RATES: usize = 1;

/// What is in registers where a point is finished, and the one behind it begun.
#[derive(Clone, Copy)]
struct Window {
    /// The sum of its products and what the point before does to it.
    q: Register,
    /// What it does to its neighbours.
    p: Register,
    v: Register,
    /// The rate of the point behind it, if there is one.
    v_next: Register,
    /// The slope before it, without its own new rate.
    pending: Register,
    /// The slope behind it.
    e: Register,
    /// The slope behind the next point.
    e_next: Register,
}

struct Writer {
    place: StringPlace,
    /// Of instructions that would be narrow.
    suffix: &'static str,
    /// Whether a load behind another one costs less than a load alone.
    pairs_loads: bool,
    text: String,
    free: Vec<Register>,
}

impl Writer {
    /// Begins the first point.
    fn enter(&mut self) -> Window {
        let pending = self.load(SLOPES, 0);
        let e = self.load(SLOPES, 1);
        let v = self.load(RATES, 0);
        let e_next = self.load(SLOPES, 2);
        let v_next = self.load(RATES, 1);
        let w = self.take();
        self.op(format_args!("qsub {w}, {e}, {pending}"));
        let end = self.place.clamped[0].then(|| {
            let bend = self.take();
            self.op(format_args!("qadd {bend}, {pending}, {pending}"));
            bend
        });
        let p = self.take();
        self.op(format_args!("smmulr {p}, {}, {v}", K[2]));
        if let Some(end) = end {
            self.op(format_args!("smmulr {end}, {}, {end}", K[1]));
        }
        self.op(format_args!("smmlar {p}, {}, {w}, {p}", K[1]));
        let q = match end {
            Some(end) => {
                self.op(format_args!("smmlar {end}, {}, {w}, {end}", K[0]));
                self.free.push(w);
                end
            }
            None => {
                self.op(format_args!("smmulr {w}, {}, {w}", K[0]));
                w
            }
        };
        self.op(format_args!("smmlar {q}, {}, {v}, {q}", K[3]));
        Window {
            q,
            p,
            v,
            v_next,
            pending,
            e,
            e_next,
        }
    }

    /// Finishes a point and begins the one behind it; gives that one's window.
    fn point(&mut self, point: u32, window: Window) -> Window {
        let Window {
            q, p, v, v_next, e, ..
        } = window;
        // What there is behind the next point: a rate, and a slope behind that.
        let is_followed = point + 2 < self.place.count;
        let w = self.take();
        self.op(format_args!("qsub {w}, {}, {e}", window.e_next));
        let p_next = self.take();
        self.op(format_args!("smmulr {p_next}, {}, {v_next}", K[2]));
        self.op(format_args!("smmlar {p}, {}, {w}, {p}", K[0]));
        self.op(format_args!("smmlar {p_next}, {}, {w}, {p_next}", K[1]));
        self.free.push(w);
        let early = (is_followed && !self.pairs_loads).then(|| self.load(RATES, point + 2));
        self.op(format_args!("qadd {q}, {q}, {p_next}"));
        self.op(format_args!("smmlar {p}, {}, {v_next}, {p}", K[3]));
        self.op(format_args!("qadd {v}, {v}, {q}"));
        self.free.push(q);
        let e_after = is_followed.then(|| self.load(SLOPES, point + 3));
        let late = (is_followed && self.pairs_loads).then(|| self.load(RATES, point + 2));
        let pending = self.move_slope(point, window);
        self.store(RATES, point, v);
        self.free.extend([v, e]);
        Window {
            q: p,
            p: p_next,
            v: v_next,
            v_next: early.or(late).unwrap_or(v_next),
            pending,
            e: window.e_next,
            e_next: e_after.unwrap_or(window.e_next),
        }
    }

    /// Finishes the last point, whose neighbour is the end.
    fn last_point(&mut self, window: Window) {
        let Window { q, v, e, .. } = window;
        if self.place.clamped[1] {
            let (p_end, suffix) = (self.take(), self.suffix);
            self.op(format_args!("mov{suffix} {p_end}, #0"));
            self.op(format_args!("qsub {p_end}, {p_end}, {e}"));
            self.op(format_args!("qadd {p_end}, {p_end}, {p_end}"));
            self.op(format_args!("smmulr {p_end}, {}, {p_end}", K[1]));
            self.op(format_args!("qadd {q}, {q}, {p_end}"));
        }
        self.op(format_args!("qadd {v}, {v}, {q}"));
        let last = self.place.count - 1;
        let slope = self.move_slope(last, window);
        self.store(RATES, last, v);
        self.store(SLOPES, last + 1, slope);
    }

    /// The slope before a point gets the point's new rate and is stored; gives the slope behind it,
    /// which waits for the rate that is next.
    fn move_slope(&mut self, point: u32, window: Window) -> Register {
        let (Window { v, pending, e, .. }, suffix) = (window, self.suffix);
        self.op(format_args!(
            "add{suffix} {pending}, {pending}, {v}, lsl #1"
        ));
        self.store(SLOPES, point, pending);
        self.op(format_args!("sub{suffix} {pending}, {e}, {v}, lsl #1"));
        pending
    }

    fn load(&mut self, cell: usize, word: u32) -> Register {
        let to = self.take();
        self.access("ldr", cell, word, to);
        to
    }

    fn store(&mut self, cell: usize, word: u32, from: Register) {
        self.access("str", cell, word, from);
    }

    fn access(&mut self, op: &str, cell: usize, word: u32, reg: Register) {
        let (offset, suffix) = (self.place.at[cell] + 4 * word, self.suffix);
        self.op(format_args!("{op}{suffix} {reg}, [r{RECORD}, #{offset}]"));
    }

    fn take(&mut self) -> Register {
        // The most that are alive are as many as there are.
        self.free.pop().unwrap_or(REGISTERS[0])
    }

    fn op(&mut self, text: std::fmt::Arguments) {
        let _ = writeln!(self.text, "\t{text}");
    }
}
