//! The tick of a string as a routine: straight-line code for cores that have saturation and top
//! words, a loop for the Cortex-M0+ (`v6m::string`).
//!
//! ```text
//!   U_l  U_(l+1)  U_(l+2)  e_l  W_(l-1)  W_l  v_(l-1)  v_l      eleven registers, whose names rotate
//! ```
//!
//! A point takes 14 instructions and two loads of coefficients, for which registers do not reach:
//! `k1` and `k2` stay, `k0` and `k3` are on the stack. No result is read by the instruction behind
//! it, since sums that saturate, products and loads come a cycle late: the first two loads of a
//! point stand between the last instructions of the one before.
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
    /// Offsets of the first words.
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
        let [u, v] = routine.cells;
        let place = StringPlace {
            at: [u, v].map(|cell| layout.cells[cell as usize]),
            count: kernel.cells[u as usize].len,
            clamped: routine.clamped,
        };
        let text = if features.legal_as_selected {
            let end = place.at[0].max(place.at[1]) + 4 * (place.count - 1);
            if end > features.load_offset_max {
                return Err(ThumbError::Reach {
                    name: kernel.cells[u as usize].name.clone(),
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
        Op::Wave(u, v) => Some(StringRoutine::new(
            [u, v],
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
    w.op(format_args!("push{suffix} {{r0, r3, {kept}, lr}}"));
    let mut window = w.enter();
    for point in 0..place.count {
        window = w.point(point, window);
    }
    w.op(format_args!("add{suffix} sp, sp, #8"));
    w.op(format_args!("pop{suffix} {{{kept}, pc}}"));
    w.text + &format!("\t.size {LABEL}, . - {LABEL}\n")
}

/// A register, by its name.
type Register = &'static str;

/// Those that hold words and `k0` or `k3`, in the order in which they are taken from the end.
const REGISTERS: [Register; 11] = [
    "lr", "r12", "r11", "r10", "r9", "r8", "r6", "r5", "r4", "r3", "r0",
];

/// The grids of a string.
const U: usize = 0;
const V: usize = 1;

/// Where the coefficients that are loaded lie on the stack.
const K0: u32 = 0;
const K3: u32 = 4;

/// What is in registers where a point begins.
#[derive(Clone, Copy)]
struct Window {
    u: Register,
    /// None at the last point.
    u_next: Option<Register>,
    /// None at the last two points.
    u_after: Option<Register>,
    e: Register,
    /// None where it is 0.
    w_before: Option<Register>,
    w: Register,
    /// None where it is 0.
    v_before: Option<Register>,
    v: Register,
    k0: Register,
}

struct Writer {
    place: StringPlace,
    /// Of instructions that would be narrow.
    suffix: &'static str,
    /// Whether a load behind another one costs less than the cycle that a sum comes late.
    pairs_loads: bool,
    text: String,
    free: Vec<Register>,
}

impl Writer {
    /// The window of the first point.
    fn enter(&mut self) -> Window {
        let [u, u_next, u_after] = [0, 1, 2].map(|point| self.load(U, point));
        let v = self.load(V, 0);
        let k0 = self.coefficient(K0);
        let e = self.take();
        let suffix = self.suffix;
        self.op(format_args!("sub{suffix} {e}, {u_next}, {u}"));
        let w_before = self.place.clamped[0].then(|| self.doubled(u));
        let w = self.take();
        self.op(format_args!("qsub {w}, {e}, {u}"));
        Window {
            u,
            u_next: Some(u_next),
            u_after: Some(u_after),
            e,
            w_before,
            w,
            v_before: None,
            v,
            k0,
        }
    }

    /// One point; gives the next one's window.
    fn point(&mut self, point: u32, window: Window) -> Window {
        let (is_last, suffix) = (window.u_next.is_none(), self.suffix);
        let Window {
            u, e, w, v, k0: a, ..
        } = window;
        let e_after = window
            .u_next
            .map(|next| self.difference(window.u_after, next));
        self.op(format_args!("smmulr {a}, {a}, {w}"));
        let w_after = match e_after {
            Some(after) => {
                self.op(format_args!("qsub {e}, {after}, {e}"));
                Some(e)
            }
            None => self.place.clamped[1].then(|| self.doubled(u)),
        };
        let v_after = (!is_last).then(|| self.load(V, point + 1));
        let bends = self.sum(window.w_before, w_after);
        let rates = self.sum(window.v_before, v_after);
        self.product(a, "r1", bends);
        self.free.extend(window.w_before);
        let k3 = self.coefficient(K3);
        self.product(a, "r2", rates);
        self.free.extend(window.v_before);
        self.op(format_args!("smmlar {a}, {k3}, {v}, {a}"));
        self.free.push(k3);
        let ahead = point + 3;
        let u_behind = (ahead < self.place.count).then(|| self.load(U, ahead));
        let early = (self.pairs_loads && !is_last).then(|| self.coefficient(K0));
        self.op(format_args!("qadd {a}, {v}, {a}"));
        let k0 = match early {
            Some(k0) => k0,
            None if is_last => a,
            None => self.coefficient(K0),
        };
        self.op(format_args!("add{suffix} {u}, {u}, {a}, lsl #1"));
        self.store(V, point, a);
        self.store(U, point, u);
        self.free.extend([u, a]);
        Window {
            u: window.u_next.unwrap_or(u),
            u_next: window.u_after,
            u_after: u_behind,
            e: e_after.unwrap_or(e),
            w_before: Some(w),
            w: w_after.unwrap_or(w),
            v_before: Some(v),
            v: v_after.unwrap_or(v),
            k0,
        }
    }

    /// The difference of a point and the one behind it, which may be the end.
    fn difference(&mut self, after: Option<Register>, of: Register) -> Register {
        let (e, suffix) = (self.take(), self.suffix);
        match after {
            Some(after) => self.op(format_args!("sub{suffix} {e}, {after}, {of}")),
            None => self.op(format_args!("rsb{suffix} {e}, {of}, #0")),
        }
        e
    }

    /// The sum of two neighbours' words in the register of the first, or the one that there is.
    fn sum(&mut self, before: Option<Register>, after: Option<Register>) -> Option<Register> {
        if let (Some(before), Some(after)) = (before, after) {
            self.op(format_args!("qadd {before}, {before}, {after}"));
        }
        before.or(after)
    }

    /// Adds the top word of a coefficient and a sum.
    fn product(&mut self, a: Register, k: Register, of: Option<Register>) {
        if let Some(of) = of {
            self.op(format_args!("smmlar {a}, {k}, {of}, {a}"));
        }
    }

    /// The bend of a clamped end.
    fn doubled(&mut self, u: Register) -> Register {
        let w = self.take();
        self.op(format_args!("qadd {w}, {u}, {u}"));
        w
    }

    fn load(&mut self, grid: usize, point: u32) -> Register {
        let to = self.take();
        self.access("ldr", grid, point, to);
        to
    }

    fn store(&mut self, grid: usize, point: u32, from: Register) {
        self.access("str", grid, point, from);
    }

    fn access(&mut self, op: &str, grid: usize, point: u32, reg: Register) {
        let (offset, suffix) = (self.place.at[grid] + 4 * point, self.suffix);
        self.op(format_args!("{op}{suffix} {reg}, [r{RECORD}, #{offset}]"));
    }

    fn coefficient(&mut self, at: u32) -> Register {
        let (to, suffix) = (self.take(), self.suffix);
        self.op(format_args!("ldr{suffix} {to}, [sp, #{at}]"));
        to
    }

    fn take(&mut self) -> Register {
        // The most that are alive are as many as there are.
        self.free.pop().unwrap_or(REGISTERS[0])
    }

    fn op(&mut self, text: std::fmt::Arguments) {
        let _ = writeln!(self.text, "\t{text}");
    }
}
