//! All code of a core in the order in which it lies: the tick's entry and end, modes, `init`, and
//! for a firmware's frame `begin`.

use super::CompiledCode;
use super::block_layout::{OffPath, lay_out_blocks};
use super::emit::{Item, Label};
use super::entry::{self, Labels};
use super::func::Allocated;
use super::names;
use super::state_layout::StateLayout;
use crate::features::Features;
use whippen_deterministic::parallel;
use whippen_ids::IdMap;
use whippen_isa::timing::Core;
use whippen_kernel::Kernel;
use whippen_modes::ModeId;

/// The labels of the code around the keys.
const LABELS: Labels = Labels {
    init_key: 0,
    init_next: 1,
    events: 2,
};

/// All code, and how many labels it has.
pub(super) struct Program {
    pub items: Vec<Item>,
    pub labels: usize,
}

/// Writes the code of a core whose symbols begin with `name`.
pub(super) fn write_program(
    layout: &StateLayout,
    core: &Core,
    kernel: &Kernel,
    name: &str,
    code: &CompiledCode,
    off_path: OffPath,
) -> Program {
    let modes = code.modes.ids();
    let mut writer = ProgramWriter {
        layout,
        features: Features::of(core.arch),
        core,
        name,
        next_codes: modes.map(|mode| names::mode(name, mode)).collect(),
        items: Vec::new(),
        labels: entry::LABELS,
        off_path,
    };
    writer.tick(code);
    // Behind the last key comes the end of the tick.
    writer.next_codes.push(names::end(name));
    writer.modes(&code.modes);
    writer.init(&code.init);
    if layout.caller.is_some() {
        writer.begin(kernel, &code.init);
    }
    Program {
        items: writer.items,
        labels: writer.labels,
    }
}

struct ProgramWriter<'a> {
    layout: &'a StateLayout,
    features: &'static Features,
    core: &'a Core,
    name: &'a str,
    /// Symbols of the code that a key may go on to.
    next_codes: Vec<String>,
    items: Vec<Item>,
    /// Labels so far.
    labels: Label,
    off_path: OffPath,
}

impl ProgramWriter<'_> {
    /// Entry and end of the tick, with what is computed once for all keys.
    fn tick(&mut self, code: &CompiledCode) {
        let funcs = code.modes.iter().chain(&code.shared);
        let slots = funcs.map(|func| func.slots).max().unwrap_or(0);
        let shared = code.shared.as_ref();
        let shared = shared.map_or_else(Vec::new, |shared| self.inside(shared));
        self.items.extend(entry::tick(
            self.layout,
            self.features,
            self.name,
            slots,
            shared,
            &self.next_codes,
            LABELS.events,
        ));
    }

    fn modes(&mut self, modes: &IdMap<ModeId, Allocated>) {
        let mut placed = Vec::new();
        for func in modes {
            placed.push((func, self.take_labels(func.blocks.len())));
        }
        let lay_out = |(func, base)| {
            let next = LABELS.init_next;
            lay_out_blocks(func, base, self.core, &self.next_codes, next, self.off_path)
        };
        let arranged = parallel::map(placed, lay_out);
        for (mode, arranged) in modes.ids().zip(arranged) {
            self.items.push(Item::Function {
                name: names::mode(self.name, mode),
                global: false,
            });
            self.items.extend(arranged);
        }
    }

    /// `init` of all keys.
    fn init(&mut self, init: &Allocated) {
        let around = entry::init(self.layout, self.features, self.name, init.slots, LABELS);
        self.items.extend(around);
        let base = self.take_labels(init.blocks.len());
        let next = LABELS.init_next;
        let codes = &self.next_codes;
        let code = lay_out_blocks(init, base, self.core, codes, next, self.off_path);
        self.items.extend(code);
    }

    /// `init` of one key: a copy, so that a key that begins costs what one key costs, and can be
    /// bounded as such.
    fn begin(&mut self, kernel: &Kernel, init: &Allocated) {
        let around = entry::begin(self.layout, self.features, kernel, self.name, init.slots);
        let [before, behind] = around;
        let code = self.inside(init);
        self.items.extend(before);
        self.items.extend(code);
        self.items.extend(behind);
    }

    /// Code that goes on behind its end; it has a label more than blocks, there.
    fn inside(&mut self, func: &Allocated) -> Vec<Item> {
        let base = self.take_labels(func.blocks.len() + 1);
        let done = base + func.blocks.len();
        let codes = &self.next_codes;
        let mut items = lay_out_blocks(func, base, self.core, codes, done, self.off_path);
        if matches!(items.last(), Some(Item::Branch { cond: None, to }) if *to == done) {
            items.pop();
        }
        items.push(Item::Label(done));
        items
    }

    /// So many new labels; gives the first.
    fn take_labels(&mut self, count: usize) -> Label {
        let base = self.labels;
        self.labels += count;
        base
    }
}
