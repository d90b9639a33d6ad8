//! Selection of memory operators: loads and stores at constant offsets from the registers with a
//! role.

use super::shift::with_shift;
use super::{Binding, Element, KnownPlace, Select, TableRow};
use crate::thumb::func::Terminator;
use crate::thumb::literal::Literal;
use crate::thumb::minst::{
    Access, AliasClass, MInst, Other, Reg, Relocation, Role, RowPlace, VReg,
};
use crate::thumb::registers::{RECORD, SAMPLES, STATE};
use crate::thumb::routine::{OF_STRINGS, StringRoutine};
use crate::thumb::state_layout::TICK;
use whippen_isa::{Op as Isa, ShiftType};
use whippen_kernel::layout::words;
use whippen_kernel::{Op, Range, Type, Value, wave};
use whippen_modes::ModeId;

/// Places that are neither cells nor lines.
pub(in crate::thumb) const WORDS_OUT: AliasClass = AliasClass::Other(Other::Drive);
pub(super) const PROBES: AliasClass = AliasClass::Other(Other::Probes);
pub(super) const EVENTS: AliasClass = AliasClass::Other(Other::Events);
pub(super) const MODE: AliasClass = AliasClass::Other(Other::Mode);

impl Select<'_> {
    /// An address: a register and an offset that every load and store can hold.
    fn split_address(&mut self, base: Reg, offset: i64) -> (Reg, i64) {
        if (-255..4096).contains(&offset) {
            return (base, offset);
        }
        let distance = self.load_constant(offset as i32);
        let sum = self.result(
            MInst::new(Isa::ADD_register)
                .with(Role::N, base)
                .reg(Role::M, distance),
        );
        (Reg::Virtual(sum), 0)
    }

    /// A load or store at an offset.
    fn access_at(&mut self, op: Isa, base: Reg, offset: i64) -> MInst {
        let (base, offset) = self.split_address(base, offset);
        let mut code = MInst::new(op)
            .with(Role::N, base)
            .imm(offset.unsigned_abs() as u32);
        code.inst.add = offset >= 0;
        code
    }

    pub(super) fn load(&mut self, op: Isa, base: Reg, offset: i64, place: AliasClass) -> VReg {
        let t = self.func.fresh();
        let code = self
            .access_at(op, base, offset)
            .reg(Role::T, t)
            .access(Access::Read(place));
        self.emit(code);
        t
    }

    pub(super) fn store(&mut self, op: Isa, base: Reg, offset: i64, place: AliasClass, word: VReg) {
        let code = self
            .access_at(op, base, offset)
            .reg(Role::T, word)
            .access(Access::Write(place));
        self.emit(code);
    }

    /// A word that nothing writes while keys are computed.
    fn load_tick_constant(&mut self, base: u8, offset: u32) -> VReg {
        self.load(
            Isa::LDR_immediate,
            Self::fixed(base),
            offset.into(),
            AliasClass::Constant,
        )
    }

    pub(super) fn read_live(&mut self, live: u32) -> VReg {
        self.load_tick_constant(STATE, self.layout.live_params[live as usize])
    }

    /// The number of the tick that comes so many ticks later.
    pub(super) fn read_tick(&mut self, later: u32) -> VReg {
        let now = self.load_tick_constant(STATE, TICK);
        self.add_constant(now, later.into())
    }

    pub(super) fn read_keyed(&mut self, keyed: u32) -> VReg {
        self.load_tick_constant(RECORD, self.layout.keyed[keyed as usize])
    }

    pub(super) fn read_cell(&mut self, cell: u32) -> Binding {
        let offset = self.layout.cells[cell as usize];
        self.load_cell(cell, Self::fixed(RECORD), offset.into())
    }

    /// A word of a cell, by its index.
    pub(super) fn read_element(&mut self, cell: u32, index: Value) -> Binding {
        let (base, offset) = self.element_address(cell, index);
        self.load_cell(cell, base, offset)
    }

    fn load_cell(&mut self, cell: u32, base: Reg, offset: i64) -> Binding {
        let low = self.load(Isa::LDR_immediate, base, offset, AliasClass::Cell(cell));
        match self.kernel.cells[cell as usize].ty {
            Type::I64 => Binding::Pair(
                low,
                self.load(Isa::LDR_immediate, base, offset + 4, AliasClass::Cell(cell)),
            ),
            _ => Binding::Word(low),
        }
    }

    /// Stores word 0 of a cell; a choice that waited for it may leave the old word.
    pub(super) fn write_cell(&mut self, cell: u32, value: Value) {
        if let Binding::Choice(choice) = self.binding(value) {
            return self.store_conditionally(cell, choice);
        }
        let offset = self.layout.cells[cell as usize].into();
        self.store_words(AliasClass::Cell(cell), Self::fixed(RECORD), offset, value);
    }

    pub(super) fn write_element(&mut self, cell: u32, index: Value, value: Value) {
        let (base, offset) = self.element_address(cell, index);
        self.store_words(AliasClass::Cell(cell), base, offset, value);
    }

    /// One tick of a string, which is a call.
    pub(super) fn call_string(&mut self, cells: [u32; 2], args: &[Value]) {
        let routine = StringRoutine::new(cells, wave::ends(self.values, args));
        let mut call = MInst {
            address: Some(Relocation::String(routine)),
            ..MInst::new(Isa::BL)
        };
        for (role, k) in OF_STRINGS.reads.iter().zip(args) {
            call = call.reg(*role, self.reg(*k));
        }
        self.emit(call.access(Access::Update(cells)));
    }

    pub(super) fn write_probe(&mut self, probe: u32, value: Value) {
        if let Some(probes) = &self.layout.probes {
            let offset = probes[probe as usize].into();
            self.store_words(PROBES, Self::fixed(RECORD), offset, value);
        }
    }

    fn store_words(&mut self, place: AliasClass, base: Reg, offset: i64, value: Value) {
        if self.info(value).ty == Type::I64 {
            let (low, high) = self.pair(value);
            self.store(Isa::STR_immediate, base, offset, place, low);
            return self.store(Isa::STR_immediate, base, offset + 4, place, high);
        }
        let word = self.reg(value);
        self.store(Isa::STR_immediate, base, offset, place, word);
    }

    /// The address of a word of a cell.
    fn element_address(&mut self, cell: u32, index: Value) -> (Reg, i64) {
        let (found, at) = (
            &self.kernel.cells[cell as usize],
            i64::from(self.layout.cells[cell as usize]),
        );
        let size = 4 * words(found.ty) as i64;
        if let Some(k) = self.constant(index) {
            return (
                Self::fixed(RECORD),
                at + size * k.clamp(0, i64::from(found.len) - 1),
            );
        }
        if let Some((part, k)) = self.plan[index].index {
            return (
                Reg::Virtual(self.element_base(part, None, size)),
                at + size * k,
            );
        }
        let held = (!self.is_inside(index, found.len)).then_some(found.len);
        (Reg::Virtual(self.element_base(index, held, size)), at)
    }

    /// The record's address and so many times an index.
    fn element_base(&mut self, index: Value, held: Option<u32>, size: i64) -> VReg {
        let wanted = (index, held, size, self.at);
        let mut known = self.elements.iter();
        if let Some(known) = known.find(|e| (e.index, e.held, e.size, e.block) == wanted) {
            return known.address;
        }
        let word = match held {
            Some(len) => self.clamp_index(index, len),
            None => self.reg(index),
        };
        let sum = MInst::new(Isa::ADD_register)
            .with(Role::N, Self::fixed(RECORD))
            .reg(Role::M, word);
        let address = self.result(with_shift(sum, ShiftType::LSL, size.trailing_zeros() as u8));
        self.elements.push(Element {
            index,
            held,
            size,
            block: self.at,
            address,
        });
        address
    }

    /// An index, held inside where it is not proven beyond doubt.
    pub(super) fn clamp_index(&mut self, index: Value, len: u32) -> VReg {
        let word = self.reg(index);
        match self.is_inside(index, len) {
            true => word,
            false => {
                let inside = Range::new(0, i64::from(len) - 1);
                self.clamp_word(word, inside, Type::I32.range())
            }
        }
    }

    /// What a row is besides a constant, held so that the row is one of the table.
    fn part_of_row(&mut self, row: Value, (part, k): (Value, i64), rows: u32) -> VReg {
        let word = self.reg(part);
        let inside = Range::new(-k, i64::from(rows) - 1 - k);
        let is_row = Range::new(0, i64::from(rows) - 1).contains(self.plan[row].proven);
        if is_row || self.is_held_in(part, inside) {
            return word;
        }
        self.clamp_word(word, inside, Type::I32.range())
    }

    fn is_inside(&self, index: Value, len: u32) -> bool {
        let inside = Range::new(0, i64::from(len) - 1);
        inside.contains(self.plan[index].proven) || self.is_held_in(index, inside)
    }

    /// Whether the instruction that made a value holds it there.
    fn is_held_in(&self, value: Value, inside: Range) -> bool {
        let held = self.state[value].held;
        held.is_some_and(|held| inside.contains(held))
    }

    /// Where the result of an operator lies because its operand was held by an instruction.
    pub(super) fn held_by(&self, op: Op, [a, b]: [Value; 2]) -> Option<Range> {
        let Range { low, high } = self.state[a].held?;
        let moved = |by: fn(i64, i64) -> i64| {
            let k = self.constant(b)?;
            Some(Range::new(by(low, k), by(high, k)))
        };
        let found = match op {
            Op::Add => moved(|a, k| a + k)?,
            Op::Sub => moved(|a, k| a - k)?,
            Op::Sar(n) => Range::new(low >> n, high >> n),
            Op::SarRound(n) => {
                let half = 1_i64 << n >> 1;
                Range::new((low + half) >> n, (high + half) >> n)
            }
            _ => return None,
        };
        Type::I32.range().contains(found).then_some(found)
    }

    /// A word held in a range, known to lie in another.
    fn clamp_word(&mut self, word: VReg, to: Range, from: Range) -> VReg {
        use whippen_isa::Cond;
        let mut held = word;
        for (k, beyond, needed) in [
            (to.low, Cond::LT, from.low < to.low),
            (to.high, Cond::GT, from.high > to.high),
        ] {
            if needed {
                let bound = self.load_constant(k as i32);
                self.emit(
                    MInst::new(Isa::CMP_register)
                        .reg(Role::N, held)
                        .reg(Role::M, bound),
                );
                held = self.move_if(beyond, Binding::Word(bound), held);
            }
        }
        held
    }

    /// Reads the first word in and goes on to the next key's.
    pub(super) fn load_input(&mut self) {
        let t = self.func.fresh();
        let code = MInst::new(Isa::LDRH_immediate)
            .reg(Role::T, t)
            .access(Access::Read(AliasClass::Constant));
        self.emit(post_increment(code, self.layout.stride).with(Role::N, Self::fixed(SAMPLES)));
        self.first_input = Some(t);
    }

    pub(super) fn read_input(&mut self, port: u32) -> VReg {
        let offset = 2 * i64::from(port) - i64::from(self.layout.stride);
        let word = match self.first_input {
            Some(word) if port == 0 => word,
            _ => self.load(
                Isa::LDRH_immediate,
                Self::fixed(SAMPLES),
                offset,
                AliasClass::Constant,
            ),
        };
        let range = self.kernel.inputs[port as usize].range;
        self.clamp_word(word, range, Range::new(0, u16::MAX.into()))
    }

    /// The drive word; its gain has 16 fraction bits and is at most 1, so the product is a word
    /// again.
    pub(super) fn write_output(&mut self, port: u32, value: Value) {
        let mut word = self.reg(value);
        if let Some(gain) = self.layout.gain {
            let gain = self.load(
                Isa::LDR_immediate,
                Self::fixed(RECORD),
                gain.into(),
                AliasClass::Constant,
            );
            word = self.emit_rrr(Isa::SMULWy, gain, word);
        }
        let distance = i64::from(self.layout.outputs) - i64::from(self.layout.inputs);
        let offset = distance + 2 * i64::from(port) - i64::from(self.layout.stride);
        self.store(
            Isa::STRH_immediate,
            Self::fixed(SAMPLES),
            offset,
            WORDS_OUT,
            word,
        );
    }

    pub(super) fn read_table(&mut self, table: u32, column: u32, row: Value) -> VReg {
        let columns = self.kernel.tables[table as usize].columns;
        if columns == 1 {
            let (base, row) = self.table_row(table, row);
            let t = self.func.fresh();
            let code = MInst::new(Isa::LDR_register)
                .reg(Role::N, base)
                .reg(Role::M, row)
                .reg(Role::T, t);
            let read = Access::Read(AliasClass::Constant);
            self.emit(with_shift(code, ShiftType::LSL, 2).access(read));
            return t;
        }
        let address = self.row_address(table, row);
        let offset = i64::from(4 * column);
        self.load(
            Isa::LDR_immediate,
            Reg::Virtual(address),
            offset,
            AliasClass::Constant,
        )
    }

    /// Where a row of a table begins, one register for all its columns.
    fn row_address(&mut self, table: u32, row: Value) -> VReg {
        let known = self
            .rows
            .iter()
            .find(|known| (known.table, known.row, known.block) == (table, row, self.at));
        if let Some(known) = known {
            return known.address;
        }
        let columns = self.kernel.tables[table as usize].columns;
        let (base, word) = self.table_row(table, row);
        let bytes = 4 * columns;
        let code = if bytes.is_power_of_two() {
            let code = MInst::new(Isa::ADD_register)
                .reg(Role::N, base)
                .reg(Role::M, word);
            with_shift(code, ShiftType::LSL, bytes.trailing_zeros() as u8)
        } else {
            let bytes = self.load_constant(bytes as i32);
            MInst::new(Isa::MLA)
                .reg(Role::N, word)
                .reg(Role::M, bytes)
                .reg(Role::A, base)
        };
        let address = self.result(code);
        self.rows.push(TableRow {
            table,
            row,
            block: self.at,
            address,
        });
        address
    }

    /// The address of a row, and how many rows behind it the wanted one is.
    fn table_row(&mut self, table: u32, row: Value) -> (VReg, VReg) {
        let found = &self.kernel.tables[table as usize];
        let (rows, bytes) = (found.rows() as u32, 4 * found.columns as i32);
        // A constant that is added is a part of the address.
        let parts = self.plan[row].index;
        let offset = parts.map_or(0, |(_, k)| k as i32 * bytes);
        let address = self.table_address(RowPlace { table, offset });
        let index = match parts {
            Some(parts) => self.part_of_row(row, parts, rows),
            None => self.clamp_index(row, rows),
        };
        (address, index)
    }

    /// Where a row of a table is.
    fn table_address(&mut self, row: RowPlace) -> VReg {
        let here = self.func.blocks[self.at].code.len();
        let reach = self.remat_reach.addresses;
        let mut known = self.row_places.iter_mut().rev();
        if let Some(known) = known
            .find(|known| (known.place, known.block) == (row, self.at) && here - known.used < reach)
        {
            known.used = here;
            return known.address;
        }
        let low = self.result(MInst {
            address: Some(Relocation::Low(row)),
            ..MInst::new(Isa::MOV_immediate).imm(0xffff)
        });
        let address = self.func.fresh();
        let high = MInst {
            address: Some(Relocation::High(row)),
            ..MInst::new(Isa::MOVT).imm(0xffff)
        };
        self.emit(high.both(Role::D, address, low));
        self.row_places.push(KnownPlace {
            place: row,
            block: self.at,
            used: here,
            address,
        });
        address
    }

    /// Live values behind those of the kernel. Only keys read them, and they come later.
    pub(super) fn store_shared(&mut self, results: &[Value]) {
        for (result, at) in results
            .iter()
            .zip(&self.layout.live_params[self.kernel.lives.len()..])
        {
            let word = self.reg(*result);
            self.store(
                Isa::STR_immediate,
                Self::fixed(STATE),
                i64::from(*at),
                AliasClass::Constant,
                word,
            );
        }
        self.func.blocks[self.at].end = Terminator::FallThrough;
    }

    /// Another mode from the next tick on.
    pub(super) fn change_mode(&mut self, mode: ModeId) {
        // There is room for every mode: their number is held to that of the literals.
        let place = self.literals.place(Literal::Mode(mode)).unwrap_or(0);
        let offset = i64::from(self.layout.literals + 4 * place);
        let address = self.load(
            Isa::LDR_immediate,
            Self::fixed(STATE),
            offset,
            AliasClass::Constant,
        );
        self.store(Isa::STR_immediate, Self::fixed(RECORD), 0, MODE, address);
    }
}

/// The access at the base alone, which then goes on by so many bytes.
pub(super) fn post_increment(mut code: MInst, bytes: u32) -> MInst {
    code = code.imm(bytes);
    (code.inst.index, code.inst.add, code.inst.wback) = (false, true, true);
    code
}
