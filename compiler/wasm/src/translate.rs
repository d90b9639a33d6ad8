//! Regions as structured code: each value is a local, and a region hands out by setting those of
//! its results.

use std::collections::HashMap;

use wasm_encoder::{BlockType, Instruction, ValType};
use whippen_ids::IdMap;
use whippen_kernel::layout::{Layout, LinePlace};
use whippen_kernel::{Inst, Kernel, Range, Region, Type, Value, Walk};

use crate::body::{Body, Local, at};
use crate::memory_map::{MemoryMap, TICK};
use crate::start::{Fresh, restart};

/// Translates one region into one function.
pub(crate) struct Translator<'a> {
    pub kernel: &'a Kernel,
    pub layout: &'a Layout,
    pub map: &'a MemoryMap,
    pub body: Body,
    /// The local of each value that is translated.
    values: IdMap<Value, Option<Local>>,
    /// Whether anything is `assume`d, so that what could do harm must be looked at again.
    pub assumes: bool,
    /// The key, and where its words stand in a column that begins at 0, for words of 4 and 8 bytes.
    pub key: Local,
    pub words: [Local; 2],
    /// The first element of the row that was written so many ticks ago, by ring and ticks.
    pub rows: HashMap<(usize, u32), Local>,
}

/// The type of a local.
fn local_type(ty: Type) -> ValType {
    match ty {
        Type::I1 | Type::I32 => ValType::I32,
        Type::I64 => ValType::I64,
    }
}

impl<'a> Translator<'a> {
    pub fn new(kernel: &'a Kernel, layout: &'a Layout, map: &'a MemoryMap) -> Translator<'a> {
        let mut body = Body::new(0);
        let key = body.local(ValType::I32);
        let words = [(); 2].map(|()| body.local(ValType::I32));
        Translator {
            kernel,
            layout,
            map,
            body,
            values: IdMap::filled(None, kernel.values.len()),
            assumes: kernel.assumes(),
            key,
            words,
            rows: HashMap::new(),
        }
    }

    /// A function that runs a region for one key after the other: `init` in fresh memory, `tick`
    /// and then on to the next.
    pub fn function(mut self, region: &Region, is_tick: bool, fresh: &Fresh) -> Body {
        if !is_tick {
            fresh.write(&mut self.body);
            restart(&mut self.body, self.map);
        }
        self.find_rows(region);
        self.body.word(0);
        self.body.set(self.key);
        self.body.op(Instruction::Loop(BlockType::Empty));
        for (local, shift) in self.words.into_iter().zip([2, 3]) {
            self.body.get(self.key);
            self.body.word(shift);
            self.body.op(Instruction::I32Shl);
            self.body.set(local);
        }
        self.region(region);
        self.body.get(self.key);
        self.body.word(1);
        self.body.op(Instruction::I32Add);
        self.body.tee(self.key);
        self.body.word(self.layout.keys as i32);
        self.body.op(Instruction::I32LtU);
        self.body.op(Instruction::BrIf(0));
        self.body.op(Instruction::End);
        if is_tick {
            self.advance();
        }
        self.body
    }

    /// Goes to the next tick.
    fn advance(&mut self) {
        let clock = at(self.map.clock + TICK, 3);
        self.body.code([
            Instruction::I32Const(0),
            Instruction::I32Const(0),
            Instruction::I64Load(clock),
            Instruction::I64Const(1),
            Instruction::I64Add,
            Instruction::I64Store(clock),
        ]);
        for (ring, len) in self.layout.rings.iter().enumerate() {
            let place = at(self.map.rings + 4 * ring as u32, 2);
            let next = self.body.local(ValType::I32);
            self.body.code([
                Instruction::I32Const(0),
                Instruction::I32Const(0),
                Instruction::I32Const(0),
                Instruction::I32Load(place),
                Instruction::I32Const(1),
                Instruction::I32Add,
                Instruction::LocalTee(next),
                Instruction::LocalGet(next),
                Instruction::I32Const(*len as i32),
                Instruction::I32Eq,
                Instruction::Select,
                Instruction::I32Store(place),
            ]);
        }
    }

    /// Finds the rows of this tick that a region reads or writes.
    fn find_rows(&mut self, region: &Region) {
        for (line, ticks) in region.line_slots() {
            let place = self.layout.lines[line as usize];
            let ticks = ticks % place.len as u32;
            if self.rows.contains_key(&(place.ring, ticks)) {
                continue;
            }
            let row = self.body.local(ValType::I32);
            self.present_slot(place);
            self.body
                .code([Instruction::I32Const(ticks as i32), Instruction::I32Sub]);
            self.wrapped_row(place);
            self.body.set(row);
            self.rows.insert((place.ring, ticks), row);
        }
    }

    /// Puts the slot on the stack that is written in this tick.
    pub fn present_slot(&mut self, place: LinePlace) {
        self.body.word(0);
        let ring = self.map.rings + 4 * place.ring as u32;
        self.body.op(Instruction::I32Load(at(ring, 2)));
    }

    /// From a slot, which may be less than 0 and is then counted from the end, to the first element
    /// of its row.
    pub fn wrapped_row(&mut self, place: LinePlace) {
        let slot = self.body.local(ValType::I32);
        self.body.code([
            Instruction::LocalTee(slot),
            Instruction::I32Const(place.len as i32),
            Instruction::I32Add,
            Instruction::LocalGet(slot),
            Instruction::LocalGet(slot),
            Instruction::I32Const(0),
            Instruction::I32LtS,
            Instruction::Select,
            Instruction::I32Const(self.layout.keys as i32),
            Instruction::I32Mul,
        ]);
    }

    /// The local of a value that stands somewhere before.
    pub fn value(&self, value: Value) -> Local {
        // The kernel is verified: whatever is read has been defined.
        self.values[value].unwrap_or_default()
    }

    /// Puts a value on the stack.
    pub fn get(&mut self, value: Value) {
        let local = self.value(value);
        self.body.get(local);
    }

    /// The local of a value that is defined here.
    pub fn define(&mut self, value: Value) -> Local {
        let ty = local_type(self.ty(value));
        let local = self.body.local(ty);
        self.values[value] = Some(local);
        local
    }

    /// Type of a value.
    pub fn ty(&self, value: Value) -> Type {
        self.kernel.values[value].ty
    }

    /// Where a value stays.
    pub fn range(&self, value: Value) -> Range {
        self.kernel.values[value].range
    }

    /// Sets locals to values, all at once: one may be the other's new value.
    fn hand_out(&mut self, to: &[Local], from: &[Value]) {
        from.iter().for_each(|value| self.get(*value));
        to.iter().rev().for_each(|local| self.body.set(*local));
    }
}

impl Walk for Translator<'_> {
    fn if_else(&mut self, inst: &Inst, then: &Region, other: &Region) {
        let results: Vec<Local> = inst
            .results
            .iter()
            .map(|value| self.define(*value))
            .collect();
        self.get(inst.args[0]);
        self.body.op(Instruction::If(BlockType::Empty));
        self.region(then);
        self.hand_out(&results, &then.yields);
        self.body.op(Instruction::Else);
        self.region(other);
        self.hand_out(&results, &other.yields);
        self.body.op(Instruction::End);
    }

    fn repeat(&mut self, inst: &Inst, rounds: u32, body: &Region) {
        let params: Vec<Local> = body
            .params
            .iter()
            .map(|value| self.define(*value))
            .collect();
        let (round, carried) = (params[0], &params[1..]);
        self.body.word(0);
        self.body.set(round);
        self.hand_out(carried, &inst.args);
        self.body.op(Instruction::Loop(BlockType::Empty));
        self.region(body);
        self.hand_out(carried, &body.yields);
        self.body.get(round);
        self.body.word(1);
        self.body.op(Instruction::I32Add);
        self.body.tee(round);
        self.body.word(rounds as i32);
        self.body.op(Instruction::I32LtS);
        self.body.op(Instruction::BrIf(0));
        self.body.op(Instruction::End);
        let results: Vec<Local> = inst
            .results
            .iter()
            .map(|value| self.define(*value))
            .collect();
        for (result, carried) in results.into_iter().zip(carried) {
            self.body.get(*carried);
            self.body.set(result);
        }
    }

    fn plain(&mut self, inst: &Inst) {
        self.operator(inst);
    }
}
