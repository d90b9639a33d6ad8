//! The functions of the C text: the loop over keys around the instructions of one key.

use super::declare::rings;
use super::{Layout, Writer, c_type, helpers, literal};
use std::collections::BTreeSet;
use whippen_kernel::{Inst, Op, Region, Type, Value, Walk};

impl Writer<'_> {
    /// All functions.
    pub(super) fn whole(mut self) -> String {
        self.constants();
        self.defaults();
        if !emit_sites(&self.kernel.tick).is_empty() {
            self.emitter();
        }
        self.init();
        self.tick();
        let helpers = helpers::needed(&self.text);
        format!("{}{helpers}{}", helpers::PROLOGUE, self.text)
    }

    /// Tables, and constants of each key.
    fn constants(&mut self) {
        let (kernel, names, keys) = (self.kernel, self.names, self.options.keys);
        for (table, name) in kernel.tables.iter().zip(&names.tables) {
            self.array(name, table.values.clone());
        }
        for (keyed, name) in kernel.keyed.iter().zip(&names.keyed) {
            let value = |key| {
                keyed
                    .values
                    .get(key)
                    .or(keyed.values.last())
                    .copied()
                    .unwrap_or_default()
            };
            self.array(name, (0..keys).map(value).collect());
        }
    }

    fn array(&mut self, name: &str, values: Vec<i32>) {
        let all: Vec<String> = values
            .iter()
            .map(|value| literal(Type::I32, (*value).into()))
            .collect();
        let kernel = &self.names.kernel;
        self.line(format!(
            "static const int32_t {kernel}_{name}[{}] = {{ {} }};",
            values.len(),
            all.join(", ")
        ));
    }

    fn defaults(&mut self) {
        let name = self.names.kernel.clone();
        self.open(format!(
            "\n{}void {name}_defaults({name}_state *s)\n{{",
            self.linkage
        ));
        self.line("s->events = 0;");
        self.line("s->lost = 0;");
        for (live, field) in self.kernel.lives.iter().zip(&self.names.lives) {
            self.line(format!(
                "s->{field} = {};",
                literal(Type::I32, live.init.into())
            ));
        }
        self.close();
    }

    /// The function that keeps an event, or counts it as lost.
    fn emitter(&mut self) {
        let (name, capitals) = (self.names.kernel.clone(), &self.names.capitals);
        let text = format!(
            "\nstatic void {name}_emit({name}_state *s, uint32_t k, uint32_t event, uint32_t count, const int32_t *args)\n{{\n\
             \x20   if (s->events == {capitals}_EVENTS) {{ s->lost += 1; return; }}\n\
             \x20   {name}_event *kept = &s->event[s->events++];\n\
             \x20   kept->tick = s->tick;\n    kept->key = k;\n    kept->event = event;\n\
             \x20   for (uint32_t i = 0; i < count; i++) kept->args[i] = args[i];\n}}"
        );
        self.line(text);
    }

    fn init(&mut self) {
        let (kernel, name) = (self.kernel, self.names.kernel.clone());
        self.open(format!(
            "\n{}void {name}_init({name}_state *restrict s, const uint16_t *restrict in)\n{{",
            self.linkage
        ));
        self.line("(void)in;");
        self.line("s->tick = 0;");
        for len in rings(kernel) {
            self.line(format!("s->ring_{len} = 0;"));
        }
        self.slots(&kernel.init);
        self.keys();
        for (index, cell) in kernel.cells.iter().enumerate() {
            let each = if cell.len > 1 {
                format!("for (uint32_t i = 0; i < {}; i++) ", cell.len)
            } else {
                String::new()
            };
            let word = self.cell(index as u32, "i");
            self.line(format!("{each}{word} = {};", literal(cell.ty, cell.init)));
        }
        for (index, line) in kernel.lines.iter().enumerate() {
            let nearest = literal(Type::I32, line.first_value());
            let all = self.filled(index as u32, &nearest);
            self.line(format!("{all};"));
        }
        for probe in &self.names.probes {
            self.line(format!("s->probes[k][{probe}] = 0;"));
        }
        self.region(&kernel.init);
        self.close();
        self.close();
    }

    fn tick(&mut self) {
        let (kernel, name) = (self.kernel, self.names.kernel.clone());
        self.open(format!(
            "\n{}void {name}_tick({name}_state *restrict s, const uint16_t *restrict in, int16_t *restrict out)\n{{",
            self.linkage
        ));
        self.line("(void)in;");
        self.line("(void)out;");
        self.slots(&kernel.tick);
        if self.set_aside {
            self.room(&kernel.tick);
        }
        self.keys();
        self.region(&kernel.tick);
        self.close();
        if self.set_aside {
            self.collect();
        }
        for len in rings(kernel) {
            self.line(format!(
                "s->ring_{len} = s->ring_{len} + 1 == {len} ? 0 : s->ring_{len} + 1;"
            ));
        }
        self.line("s->tick += 1;");
        self.close();
    }

    /// Opens the loop over the keys.
    fn keys(&mut self) {
        let (name, capitals) = (&self.names.kernel, &self.names.capitals);
        let (head, key) = (
            format!("for (uint32_t k = 0; k < {capitals}_KEYS; k++) {{"),
            format!("{name}_key *restrict const key = &s->key[k]; (void)key;"),
        );
        if self.set_aside {
            self.line("#if defined __GNUC__ && !defined __clang__\n#pragma GCC ivdep\n#endif");
        }
        self.open(head);
        if self.options.layout == Layout::Records {
            self.line(key);
        }
    }

    /// Finds the slots of this tick that a region reads or writes.
    fn slots(&mut self, region: &Region) {
        let used: BTreeSet<(u32, u32)> = region
            .line_slots()
            .into_iter()
            .map(|(line, ticks)| {
                (
                    self.kernel.lines[line as usize].len,
                    ticks % self.kernel.lines[line as usize].len,
                )
            })
            .collect();
        for (len, ticks) in used {
            let ring = format!("s->ring_{len}");
            let slot = match ticks {
                0 => ring,
                _ => format!(
                    "{ring} < {ticks} ? {ring} + {} : {ring} - {ticks}",
                    len - ticks
                ),
            };
            self.line(format!("const uint32_t slot_{len}_{ticks} = {slot};"));
        }
    }

    fn arm(&mut self, inst: &Inst, region: &Region) {
        self.region(region);
        self.hand_out(inst, &region.yields);
    }

    fn hand_out(&mut self, inst: &Inst, yields: &[Value]) {
        for (result, yielded) in inst.results.iter().zip(yields) {
            let text = format!("v{} = {};", result.0, self.value(*yielded));
            self.line(text);
        }
    }

    /// An event: kept at once, or set aside.
    pub(super) fn emit(&mut self, event: u32, args: &[String]) {
        let (site, name) = (self.emits, self.names.kernel.clone());
        self.emits += 1;
        if self.set_aside {
            self.line(format!("emits_{site}[k] = 1;"));
            self.line("emits |= 1;");
            for (at, arg) in args.iter().enumerate() {
                self.line(format!("args_{site}[{at}][k] = {arg};"));
            }
            return;
        }
        let list = if args.is_empty() {
            "0".to_string()
        } else {
            format!("(const int32_t[]){{ {} }}", args.join(", "))
        };
        self.line(format!(
            "{name}_emit(s, k, {}, {}, {list});",
            self.names.events[event as usize],
            args.len()
        ));
    }

    /// Room for events set aside: for every place in the text that emits, a flag and the arguments
    /// of each key.
    fn room(&mut self, region: &Region) {
        let sites = emit_sites(region);
        if !sites.is_empty() {
            self.line("int32_t emits = 0;");
        }
        let keys = format!("{}_KEYS", self.names.capitals);
        for (site, event) in sites.into_iter().enumerate() {
            self.line(format!("int32_t emits_{site}[{keys}] = {{ 0 }};"));
            match self.kernel.events[event as usize].args {
                0 => {}
                args => self.line(format!("int32_t args_{site}[{args}][{keys}];")),
            }
        }
    }

    /// Keeps what was set aside, key by key in the order of the text.
    fn collect(&mut self) {
        let sites = emit_sites(&self.kernel.tick);
        if sites.is_empty() {
            return;
        }
        let name = self.names.kernel.clone();
        self.open(format!(
            "for (uint32_t k = 0; emits && k < {}_KEYS; k++) {{",
            self.names.capitals
        ));
        for (site, event) in sites.into_iter().enumerate() {
            let count = self.kernel.events[event as usize].args;
            let args: Vec<String> = (0..count)
                .map(|at| format!("args_{site}[{at}][k]"))
                .collect();
            let list = if args.is_empty() {
                "0".to_string()
            } else {
                format!("(const int32_t[]){{ {} }}", args.join(", "))
            };
            let event = &self.names.events[event as usize];
            self.line(format!(
                "if (emits_{site}[k]) {name}_emit(s, k, {event}, {count}, {list});"
            ));
        }
        self.close();
    }
}

impl Walk for Writer<'_> {
    fn if_else(&mut self, inst: &Inst, then: &Region, other: &Region) {
        for result in &inst.results {
            let (ty, name) = (self.ty(*result), self.define(*result));
            self.line(format!("{} {name};", c_type(ty)));
        }
        let condition = self.value(inst.args[0]).to_string();
        self.open(format!("if ({condition}) {{"));
        self.arm(inst, then);
        if other.insts.is_empty() && other.yields.is_empty() {
            return self.close();
        }
        self.depth -= 1;
        self.open("} else {");
        self.arm(inst, other);
        self.close();
    }

    /// The results are what is carried from round to round; the body works on copies.
    fn repeat(&mut self, inst: &Inst, rounds: u32, body: &Region) {
        for (result, start) in inst.results.iter().zip(&inst.args) {
            let (ty, start) = (self.ty(*result), self.value(*start).to_string());
            let name = self.define(*result);
            self.line(format!("{} {name} = {start};", c_type(ty)));
        }
        let round = self.define(body.params[0]);
        self.open(format!(
            "for (int32_t {round} = 0; {round} < {rounds}; {round}++) {{"
        ));
        for (param, result) in body.params[1..].iter().zip(&inst.results) {
            let (ty, name) = (self.ty(*param), self.define(*param));
            self.line(format!("const {} {name} = v{};", c_type(ty), result.0));
        }
        self.region(body);
        self.hand_out(inst, &body.yields);
        self.close();
    }

    fn plain(&mut self, inst: &Inst) {
        self.operator(inst);
    }
}

/// The event of every `emit`, in the order of the text.
fn emit_sites(region: &Region) -> Vec<u32> {
    let event = |inst: &Inst| match inst.op {
        Op::Emit(event) => Some(event),
        _ => None,
    };
    region.all_insts().filter_map(event).collect()
}
