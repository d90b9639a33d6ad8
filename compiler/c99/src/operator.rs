//! Operators. What gives a result becomes an expression, what has an effect a statement.

use super::{Layout, Writer, literal};
use whippen_kernel::{Inst, Op, wave};

impl Writer<'_> {
    /// An operator without regions.
    pub(super) fn operator(&mut self, inst: &Inst) {
        match (inst.op, &inst.results[..]) {
            (Op::Const(value), [result]) => {
                self.values[result] = literal(self.ty(*result), value);
            }
            (Op::Emit(event), _) => {
                let args = inst.args.iter().map(|arg| self.value(*arg).to_string());
                self.emit(event, &args.collect::<Vec<_>>());
            }
            (_, [result]) => {
                let expression = self.text(inst);
                let ty = super::c_type(self.ty(*result));
                let name = self.define(*result);
                self.line(format!("const {ty} {name} = {expression};"));
            }
            _ => {
                let statement = self.text(inst);
                self.line(format!("{statement};"));
            }
        }
    }

    /// The expression of an operator that gives a result, else its assignment. Every operator is
    /// named, so that a new one does not compile before it has its line.
    fn text(&self, inst: &Inst) -> String {
        let [a, b, c] =
            std::array::from_fn(|at| inst.args.get(at).map_or("", |arg| self.value(*arg)));
        match inst.op {
            Op::Add => format!("{a} + {b}"),
            Op::Sub => format!("{a} - {b}"),
            Op::Mul => format!("{a} * {b}"),
            Op::MulWide => format!("(int64_t){a} * {b}"),
            Op::MacWide => format!("{a} + (int64_t){b} * {c}"),
            Op::MulTop => format!("(int32_t)(((int64_t){a} * {b} + 0x80000000) >> 32)"),
            Op::MacTop => format!("{a} + (int32_t)(((int64_t){b} * {c} + 0x80000000) >> 32)"),
            Op::Min => format!("{a} < {b} ? {a} : {b}"),
            Op::Max => format!("{a} > {b} ? {a} : {b}"),
            Op::Shl(n) => format!("whippen_shl{}({a}, {n})", self.ty(inst.args[0]).bits()),
            Op::Sar(n) => format!("{a} >> {n}"),
            Op::SarRound(n) => self.sar_round(inst, a, n),
            Op::DivRound(n) => format!("whippen_div_round(whippen_shl64({a}, {n}), {b})"),
            Op::Quot(n) => format!("whippen_quot({a}, {b}, {n})"),
            Op::Sqrt => format!("whippen_sqrt({a})"),
            Op::Widen | Op::Assume(..) => a.to_string(),
            Op::Narrow => format!("(int32_t){a}"),
            Op::Low => format!("(int32_t)(uint32_t){a}"),
            Op::AddWrap => format!("(int32_t)((uint32_t){a} + (uint32_t){b})"),
            Op::SubWrap => format!("(int32_t)((uint32_t){a} - (uint32_t){b})"),
            Op::MulWrap => format!("(int32_t)((uint32_t){a} * (uint32_t){b})"),
            Op::AddSat => format!("whippen_sat((int64_t){a} + {b})"),
            Op::SubSat => format!("whippen_sat((int64_t){a} - {b})"),
            Op::ShlWrap(n) => format!("(int32_t)((uint32_t){a} << {n})"),
            Op::Eq => format!("{a} == {b}"),
            Op::Lt => format!("{a} < {b}"),
            Op::Le => format!("{a} <= {b}"),
            Op::And => format!("{a} & {b}"),
            Op::Or => format!("{a} | {b}"),
            Op::Not => format!("!{a}"),
            Op::Select => format!("{a} ? {b} : {c}"),
            Op::In(port) => self.input(port),
            Op::Out(port) => self.output(port, a),
            Op::Live(live) => format!("s->{}", self.names.lives[live as usize]),
            Op::Tick(later) => format!("(int32_t)(uint32_t)(s->tick + {later}u)"),
            Op::Keyed(keyed) => self.keyed(keyed),
            Op::Get(cell) => self.cell(cell, "0"),
            Op::Set(cell) => format!("{} = {a}", self.cell(cell, "0")),
            Op::GetAt(cell) => self.cell_at(cell, a),
            Op::SetAt(cell) => format!("{} = {b}", self.cell_at(cell, a)),
            Op::Wave(e, v) => self.wave(inst, [e, v]),
            Op::Delay(line, ticks) => self.element(line, &self.slot(line, ticks)),
            Op::DelayAt(line) => self.element_at(line, a),
            Op::Push(line) => self.pushed(line, a),
            Op::Fill(line) => self.filled(line, a),
            Op::Lookup(table, column) => self.lookup(table, column, a),
            Op::Probe(probe) => self.probed(probe, a),
            // Constants are not written, events are several statements, and regions are blocks.
            Op::Const(_) | Op::Emit(_) | Op::If | Op::Loop(_) => String::new(),
        }
    }

    /// `floor(a / 2^n + 1/2)`; where the sum need not fit, what it carries into the result is the
    /// bit below.
    fn sar_round(&self, inst: &Inst, a: &str, n: u8) -> String {
        let (ty, range) = (
            self.ty(inst.args[0]),
            self.kernel.values[inst.args[0]].range,
        );
        match n.checked_sub(1) {
            None => a.to_string(),
            Some(below) if range.high <= ty.range().high - (1 << below) => {
                format!("({a} + {}) >> {n}", literal(ty, 1 << below))
            }
            Some(below) => format!("({a} >> {n}) + (({a} >> {below}) & 1)"),
        }
    }

    /// The word of an input port, clamped to the port's range.
    fn input(&self, port: u32) -> String {
        let range = self.kernel.inputs[port as usize].range;
        let word = format!("in[k * {} + {port}]", self.row_words[0]);
        let low = if range.low > 0 {
            format!("{word} < {0} ? {0} : ", range.low)
        } else {
            String::new()
        };
        let high = if range.high < 65_535 {
            format!("{word} > {0} ? {0} : ", range.high)
        } else {
            String::new()
        };
        format!("{low}{high}{word}")
    }

    fn output(&self, port: u32, value: &str) -> String {
        let outputs = self.row_words[1];
        format!("out[k * {outputs} + {port}] = (int16_t){value}")
    }

    fn keyed(&self, keyed: u32) -> String {
        let name = &self.names.keyed[keyed as usize];
        format!("{}_{name}[k]", self.names.kernel)
    }

    /// The word of a cell at an index.
    fn cell_at(&self, cell: u32, index: &str) -> String {
        let len = self.kernel.cells[cell as usize].len as usize;
        self.cell(cell, &self.inside(index, len))
    }

    /// One tick of a string: the function gets its first words and the words from one to the next.
    fn wave(&self, inst: &Inst, cells: [u32; 2]) -> String {
        let [e, v] = cells.map(|cell| self.cell(cell, "0"));
        let count = self.kernel.cells[cells[1] as usize].len;
        let step = match self.options.layout {
            Layout::Records => 1,
            Layout::Columns => self.options.keys,
        };
        let k: Vec<&str> = inst.args[..4].iter().map(|k| self.value(*k)).collect();
        let [left, right] = wave::ends(&self.kernel.values, &inst.args);
        let k = k.join(", ");
        format!("whippen_wave(&{e}, &{v}, {step}, {count}, {k}, {left}, {right})")
    }

    fn lookup(&self, table: u32, column: u32, row: &str) -> String {
        let own = &self.kernel.tables[table as usize];
        let name = &self.names.tables[table as usize];
        let row = self.inside(row, own.rows());
        let index = match own.columns {
            1 => row,
            columns => format!("({row}) * {columns} + {column}"),
        };
        format!("{}_{name}[{index}]", self.names.kernel)
    }

    fn pushed(&self, line: u32, value: &str) -> String {
        let element = self.element(line, &self.slot(line, 0));
        format!("{element} = {}", self.stored(line, value))
    }

    fn probed(&self, probe: u32, value: &str) -> String {
        let name = &self.names.probes[probe as usize];
        format!("s->probes[k][{name}] = {value}")
    }

    /// A word of a cell of this key.
    pub(super) fn cell(&self, cell: u32, index: &str) -> String {
        let field = &self.names.cells[cell as usize];
        let word = if self.kernel.cells[cell as usize].len > 1 {
            format!("[{index}]")
        } else {
            String::new()
        };
        self.of_key(field, &word)
    }

    /// An element of a line of this key.
    fn element(&self, line: u32, slot: &str) -> String {
        self.of_key(&self.names.lines[line as usize], &format!("[{slot}]"))
    }

    /// The element of a line that was pushed one tick more than that ago.
    fn element_at(&self, line: u32, before: &str) -> String {
        let len = self.kernel.lines[line as usize].len;
        let before = format!("(uint32_t)({})", self.inside(before, len as usize));
        let now = self.slot(line, 0);
        let around = format!("{now} > {before} ? 0 : {len}");
        self.element(line, &format!("{now} + ({around}) - 1 - {before}"))
    }

    /// Writes a value to every slot of a line.
    pub(super) fn filled(&self, line: u32, value: &str) -> String {
        let len = self.kernel.lines[line as usize].len;
        format!(
            "for (uint32_t i = 0; i < {len}; i++) {} = {}",
            self.element(line, "i"),
            self.stored(line, value)
        )
    }

    fn of_key(&self, field: &str, index: &str) -> String {
        match self.options.layout {
            Layout::Records => format!("key->{field}{index}"),
            Layout::Columns => format!("s->{field}{index}[k]"),
        }
    }

    /// The variable with the slot that was written so many ticks ago.
    pub(super) fn slot(&self, line: u32, ticks: u32) -> String {
        let len = self.kernel.lines[line as usize].len;
        format!("slot_{len}_{}", ticks % len)
    }

    fn stored(&self, line: u32, value: &str) -> String {
        let range = self.kernel.lines[line as usize].range;
        if range.low >= 0 && range.high <= 65_535 {
            format!("(uint16_t){value}")
        } else {
            value.to_string()
        }
    }

    /// The nearest index inside, should the proof rest on an assumption.
    fn inside(&self, index: &str, len: usize) -> String {
        let last = len - 1;
        if self.assumes {
            format!("{index} < 0 ? 0 : {index} > {last} ? {last} : {index}")
        } else {
            index.to_string()
        }
    }

    /// Gives a value a name.
    pub(super) fn define(&mut self, value: whippen_kernel::Value) -> String {
        let name = format!("v{}", value.0);
        self.values[value].clone_from(&name);
        name
    }
}
