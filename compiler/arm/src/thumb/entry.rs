//! Prologue and epilogue: entry and end of a tick, `init` of all keys, `begin` of one.
//!
//! ```text
//!   NAME_tick: save, what all keys share, STATE RECORD SAMPLES HISTORY, to the first key's code ... end: rings go on, pointers, tick + 1, restore
//!   NAME_init: save, STATE RECORD SAMPLES HISTORY, pointers, [init of a key]*, restore
//!   NAME_begin: STATE RECORD SAMPLES HISTORY of one key, its cells, [init of a key], restore
//! ```
//!
//! On ARMv6-M what it lacks (`small`) is made of what it has, with R4 and R5 for what must be in a
//! low register for a moment.
//!
//! As part of a firmware's frame all take the first key's word in R1 and keep no register but SP.
//! `NAME_begin` is there for it alone.

mod events;

use super::allocate::next_key_register;
use super::emit::{Item, Label};
use super::minst::template;
use super::promote::TickConstant;
use super::registers::{HISTORY, RECORD, SAMPLES, STATE};
use super::state_layout::{Pointer, ROW, StateLayout, TICK};
use super::v6m::{self, Step};
use super::{minst::Relocation, names};
use whippen_isa::reg::{LR, PC, SP};
use whippen_isa::{Arch, Cond, Encoding, Form, Inst, Op, ShiftType};
use whippen_kernel::{Kernel, Type};

/// R4 to R11 and LR.
const SAVED: u32 = 0x0ff0;
/// R4 and R5, which carry SAMPLES and HISTORY to and from the stack of ARMv6-M.
const HIGH: u32 = 0x0030;

/// Labels that this code needs.
#[derive(Debug, Clone, Copy)]
pub(super) struct Labels {
    pub init_key: Label,
    pub init_next: Label,
    /// Three, then two more.
    pub events: Label,
}

/// How many labels there are.
pub(super) const LABELS: Label = 7;

/// A list of instructions being written.
struct EntryWriter<'a> {
    layout: &'a StateLayout,
    items: Vec<Item>,
}

/// Entry and end of a tick, with labels from `events` on; `slots` words of the stack are for the
/// keys' code, and for what is computed for all of them before.
pub(super) fn tick(
    layout: &StateLayout,
    arch: Arch,
    name: &str,
    slots: usize,
    shared: Vec<Item>,
    modes: &[String],
    events: Label,
) -> Vec<Item> {
    let mut w = EntryWriter::new(layout);
    w.items.push(Item::Function {
        name: names::tick(name),
        global: true,
    });
    w.enter(slots);
    w.items.extend(shared);
    w.open_events(events);
    w.registers();
    w.load_promoted();
    let next = next_key_register(arch);
    w.op(Inst {
        t: next,
        n: RECORD,
        ..template(Op::LDR_immediate)
    });
    w.items.push(Item::Indirect {
        inst: Inst {
            m: next,
            ..template(Op::BX)
        },
        to: modes.to_vec(),
    });
    w.items.push(Item::Function {
        name: names::end(name),
        global: false,
    });
    w.close_events(events + 3);
    w.rings();
    w.pointers();
    w.load(0, TICK);
    w.plus_one(0);
    w.store(0, TICK);
    w.leave(slots);
    w.items
}

/// `init` of all keys; the code of one key follows at `init_key` and comes back to `init_next`.
pub(super) fn init(layout: &StateLayout, name: &str, slots: usize, labels: Labels) -> Vec<Item> {
    let mut w = EntryWriter::new(layout);
    w.items.push(Item::Function {
        name: names::init(name),
        global: true,
    });
    w.enter(slots);
    w.pointers();
    w.registers();
    w.items.push(Item::Loop {
        rounds: layout.keys,
    });
    w.items.push(Item::Branch {
        cond: None,
        to: labels.init_key,
    });
    w.items.push(Item::Label(labels.init_next));
    w.offset(0, layout.records + layout.keys * layout.record);
    w.add(0, STATE);
    w.op(Inst {
        n: RECORD,
        m: 0,
        ..template(Op::CMP_register)
    });
    w.items.push(Item::Branch {
        cond: Some(Cond::NE),
        to: labels.init_key,
    });
    w.leave(slots);
    w.items.push(Item::Label(labels.init_key));
    w.items
}

/// One key of those that `init` prepares all: state in R0, its word in R1, its number in R2. Before
/// the code of a key's `init` and behind it.
pub(super) fn begin(
    layout: &StateLayout,
    kernel: &Kernel,
    name: &str,
    slots: usize,
) -> [Vec<Item>; 2] {
    let mut w = EntryWriter::new(layout);
    w.begin(kernel, name, slots);
    let before = std::mem::take(&mut w.items);
    w.leave(slots);
    [before, w.items]
}

impl<'a> EntryWriter<'a> {
    fn new(layout: &'a StateLayout) -> EntryWriter<'a> {
        EntryWriter {
            layout,
            items: Vec::new(),
        }
    }

    fn op(&mut self, inst: Inst) {
        self.items.push(Item::Inst {
            inst,
            origin: None,
            address: None::<Relocation>,
        });
    }

    fn enter(&mut self, slots: usize) {
        self.op(Inst {
            imm: self.saved() | 1 << LR,
            ..template(Op::PUSH)
        });
        if self.layout.small && self.saved() != 0 {
            self.mov(4, SAMPLES);
            self.mov(5, HISTORY);
            self.op(Inst {
                imm: HIGH,
                ..template(Op::PUSH)
            });
        }
        self.stack(Op::SUB_SP_minus_immediate, slots);
        self.op(Inst {
            d: STATE,
            m: 0,
            ..template(Op::MOV_register)
        });
        if let Some(caller) = self.layout.caller {
            self.op(Inst {
                d: SAMPLES,
                m: 1,
                ..template(Op::MOV_register)
            });
            self.store(1, caller.at);
        }
    }

    fn begin(&mut self, kernel: &Kernel, name: &str, slots: usize) {
        let layout = self.layout;
        self.items.push(Item::Function {
            name: names::begin(name),
            global: true,
        });
        self.op(Inst {
            imm: 1 << LR,
            ..template(Op::PUSH)
        });
        self.stack(Op::SUB_SP_minus_immediate, slots);
        self.op(Inst {
            d: STATE,
            m: 0,
            ..template(Op::MOV_register)
        });
        self.op(Inst {
            d: SAMPLES,
            m: 1,
            ..template(Op::MOV_register)
        });
        self.offset(0, layout.records);
        self.add(0, STATE);
        self.offset(1, layout.record);
        self.multiply_add(RECORD, 2, 1, 0);
        if let Some(first) = layout.first_line {
            // `init` fills lines from their first row on.
            let (line, shift) = (&layout.lines[first as usize], ShiftType::LSL);
            let amount = line.log2();
            let base = self.apart();
            self.offset(HISTORY, line.at);
            self.add(HISTORY, base);
            if self.layout.small {
                self.op(Inst {
                    d: 4,
                    m: 2,
                    amount,
                    s: true,
                    ..template(Op::LSL_immediate)
                });
                self.add(HISTORY, 4);
            } else {
                self.op(Inst {
                    d: HISTORY,
                    n: HISTORY,
                    m: 2,
                    shift,
                    amount,
                    ..template(Op::ADD_register)
                });
            }
        }
        self.cells(kernel);
    }

    /// The cells of the key at RECORD as they are before `init`, which writes some of them.
    fn cells(&mut self, kernel: &Kernel) {
        let words = kernel
            .cells
            .iter()
            .zip(&self.layout.cells)
            .flat_map(|(cell, &at)| {
                let words = if cell.ty == Type::I64 { 2 } else { 1 };
                let word = move |nth: u32| (cell.init >> (32 * (nth % words))) as u32;
                (0..words * cell.len).map(move |nth| (word(nth), at + 4 * nth))
            });
        let mut words: Vec<(u32, u32)> = words.collect();
        words.sort_unstable();
        let mut held = None;
        for (word, at) in words {
            if held.replace(word) != Some(word) {
                self.offset(0, word);
            }
            self.access(Op::STR_immediate, 0, RECORD, at);
        }
    }

    fn leave(&mut self, slots: usize) {
        self.stack(Op::ADD_SP_plus_immediate, slots);
        if self.layout.small && self.saved() != 0 {
            self.op(Inst {
                imm: HIGH,
                ..template(Op::POP)
            });
            self.mov(SAMPLES, 4);
            self.mov(HISTORY, 5);
        }
        self.op(Inst {
            imm: self.saved() | 1 << PC,
            ..template(Op::POP)
        });
    }

    /// A firmware's frame keeps what it needs itself.
    fn saved(&self) -> u32 {
        match (self.layout.caller, self.layout.small) {
            (Some(_), _) => 0,
            (None, true) => SAVED & 0xff,
            (None, false) => SAVED,
        }
    }

    fn stack(&mut self, op: Op, slots: usize) {
        let most = if self.layout.small { 127 } else { slots.max(1) };
        for from in (0..slots).step_by(most) {
            let imm = 4 * (slots - from).min(most) as u32;
            self.op(Inst {
                d: SP,
                n: SP,
                imm,
                ..template(op)
            });
        }
    }

    fn mov(&mut self, d: u8, m: u8) {
        self.op(Inst {
            d,
            m,
            ..template(Op::MOV_register)
        });
    }

    /// `d += m`
    fn add(&mut self, d: u8, m: u8) {
        self.op(Inst {
            d,
            n: d,
            m,
            ..template(Op::ADD_register)
        });
    }

    fn plus_one(&mut self, d: u8) {
        self.op(Inst {
            d,
            n: d,
            imm: 1,
            s: self.layout.small,
            ..template(Op::ADD_immediate)
        });
    }

    /// `d = n * m + a`; on ARMv6-M `n` or `m` may be `d` and all are low.
    fn multiply_add(&mut self, d: u8, n: u8, m: u8, a: u8) {
        if !self.layout.small {
            return self.op(Inst {
                d,
                n,
                m,
                a,
                ..template(Op::MLA)
            });
        }
        if d != m {
            self.mov(d, n);
        }
        self.op(Inst {
            d,
            n: if d == m { n } else { m },
            m: d,
            s: true,
            ..template(Op::MUL)
        });
        self.add(d, a);
    }

    /// An offset in a register.
    fn offset(&mut self, d: u8, offset: u32) {
        if self.layout.small {
            return self.steps(d, offset);
        }
        let low = Encoding::new(Op::MOV_immediate, Form::T3)
            .map_or_else(|| template(Op::MOV_immediate), Inst::new);
        self.op(Inst {
            d,
            imm: offset & 0xffff,
            ..low
        });
        if offset >> 16 != 0 {
            self.op(Inst {
                d,
                imm: offset >> 16,
                ..template(Op::MOVT)
            });
        }
    }

    /// RECORD, SAMPLES and HISTORY at the first key.
    fn registers(&mut self) {
        let words = self
            .layout
            .caller
            .is_none()
            .then_some((SAMPLES, self.layout.inputs));
        for (register, offset) in [Some((RECORD, self.layout.records)), words]
            .into_iter()
            .flatten()
        {
            self.offset(register, offset);
            self.add(register, STATE);
        }
        if self.layout.first_line.is_some() {
            let low = if self.layout.small { 4 } else { HISTORY };
            self.load(low, ROW);
            if low != HISTORY {
                self.mov(HISTORY, low);
            }
        }
    }

    /// What stays in registers from key to key.
    fn load_promoted(&mut self) {
        for (word, reg) in self.layout.promoted.iter() {
            match word {
                TickConstant::InState(offset) => self.load(reg, offset),
                TickConstant::Immediate(number) if number >> 16 == 0 => self.offset(reg, number),
                TickConstant::Immediate(number) => self.op(Inst {
                    d: reg,
                    imm: number,
                    ..template(Op::MOV_immediate)
                }),
            }
        }
    }

    /// Every ring index goes on.
    fn rings(&mut self) {
        for (at, len) in &self.layout.rings {
            self.load(0, *at);
            self.plus_one(0);
            self.offset(1, *len);
            if self.layout.small {
                // All bits where it is less than the length, none where it is that.
                self.op(Inst {
                    d: 1,
                    n: 0,
                    m: 1,
                    s: true,
                    ..template(Op::SUB_register)
                });
                self.op(Inst {
                    d: 1,
                    m: 1,
                    amount: 31,
                    s: true,
                    ..template(Op::ASR_immediate)
                });
                self.op(Inst {
                    d: 0,
                    n: 0,
                    m: 1,
                    s: true,
                    ..template(Op::AND_register)
                });
            } else {
                self.op(Inst {
                    n: 0,
                    m: 1,
                    ..template(Op::CMP_register)
                });
                self.op(it(Cond::EQ));
                self.op(Inst {
                    d: 0,
                    imm: 0,
                    cond: Some(Cond::EQ),
                    ..template(Op::MOV_immediate)
                });
            }
            self.store(0, *at);
        }
    }

    fn load(&mut self, t: u8, at: u32) {
        self.access(Op::LDR_immediate, t, STATE, at);
    }

    fn store(&mut self, t: u8, at: u32) {
        self.access(Op::STR_immediate, t, STATE, at);
    }

    /// A word at a distance from a register.
    fn access(&mut self, op: Op, t: u8, n: u8, at: u32) {
        if !self.layout.small || at < 128 {
            return self.op(Inst {
                t,
                n,
                imm: at,
                ..template(op)
            });
        }
        self.steps(5, at);
        let op = if op == Op::LDR_immediate {
            Op::LDR_register
        } else {
            Op::STR_register
        };
        self.op(Inst {
            t,
            n,
            m: 5,
            ..template(op)
        });
    }

    /// A word in a register of ARMv6-M.
    fn steps(&mut self, d: u8, word: u32) {
        let low = if d < 8 { d } else { 4 };
        for step in v6m::steps(word) {
            let inst = match step {
                Step::Byte(byte) => Inst {
                    imm: byte.into(),
                    ..template(Op::MOV_immediate)
                },
                Step::Shift(amount) => Inst {
                    m: low,
                    amount,
                    ..template(Op::LSL_immediate)
                },
                Step::Add(byte) => Inst {
                    n: low,
                    imm: byte.into(),
                    ..template(Op::ADD_immediate)
                },
                Step::Not => Inst {
                    m: low,
                    ..template(Op::MVN_register)
                },
                Step::Negate => Inst {
                    n: low,
                    ..template(Op::RSB_immediate)
                },
            };
            self.op(Inst {
                d: low,
                s: true,
                ..inst
            });
        }
        if low != d {
            self.mov(d, low);
        }
    }

    /// The row of the first line, and all pointers relative to it. R3 keeps the row.
    fn pointers(&mut self) {
        let layout = self.layout;
        let Some(first) = layout.first_line else {
            return;
        };
        let base = self.apart();
        self.row(base, 3, first, 0);
        self.store(3, ROW);
        for Pointer { line, ticks, at } in &layout.pointers {
            self.row(base, 0, *line, *ticks);
            let (scale, shift) = (layout.scale(*line), ShiftType::LSL);
            if self.layout.small && scale != 0 {
                self.op(Inst {
                    d: 4,
                    m: 3,
                    amount: scale,
                    s: true,
                    ..template(Op::LSL_immediate)
                });
                self.op(Inst {
                    d: 0,
                    n: 0,
                    m: 4,
                    s: true,
                    ..template(Op::SUB_register)
                });
            } else {
                self.op(Inst {
                    d: 0,
                    n: 0,
                    m: 3,
                    shift,
                    amount: scale,
                    s: self.layout.small,
                    ..template(Op::SUB_register)
                });
            }
            self.store(0, *at);
        }
    }

    /// The register from which histories are counted; R12 where they lie apart.
    fn apart(&mut self) -> u8 {
        let Some(at) = self.layout.apart else {
            return STATE;
        };
        if self.layout.small {
            self.load(4, at);
            self.mov(12, 4);
        } else {
            self.load(12, at);
        }
        12
    }

    /// The address of the row of a line that was written so many ticks ago, or is written now. Uses
    /// R1 and R2.
    fn row(&mut self, base: u8, d: u8, line: u32, ticks: u32) {
        let line = &self.layout.lines[line as usize];
        self.load(d, line.ring);
        if ticks != 0 {
            self.offset(1, ticks);
            self.op(Inst {
                d,
                n: d,
                m: 1,
                s: true,
                ..template(Op::SUB_register)
            });
            self.offset(1, line.len);
            if self.layout.small {
                // The length where it is negative, else nothing.
                self.op(Inst {
                    d: 2,
                    m: d,
                    amount: 31,
                    s: true,
                    ..template(Op::ASR_immediate)
                });
                self.op(Inst {
                    d: 1,
                    n: 1,
                    m: 2,
                    s: true,
                    ..template(Op::AND_register)
                });
                self.add(d, 1);
            } else {
                self.op(it(Cond::MI));
                self.op(Inst {
                    d,
                    n: d,
                    m: 1,
                    cond: Some(Cond::MI),
                    ..template(Op::ADD_register)
                });
            }
        }
        self.offset(1, line.row);
        self.offset(2, line.at);
        self.add(2, base);
        self.multiply_add(d, d, 1, 2);
    }
}

fn it(cond: Cond) -> Inst {
    Inst {
        imm: u32::from(cond.bits()) << 4 | 8,
        ..template(Op::IT)
    }
}
