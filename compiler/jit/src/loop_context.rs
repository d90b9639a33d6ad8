//! The loop over the keys, and what it keeps in registers: bases of the buffers and rows of delay
//! lines.

use super::translate::Translator;
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::types::I64;
use cranelift_codegen::ir::{
    AliasRegion, AliasRegionData, Block, InstBuilder, MemFlagsData, Value,
};
use cranelift_frontend::FunctionBuilder;
use std::collections::HashMap;
use whippen_kernel::Region;

/// How many buffers there are.
pub(super) const BUFFERS: usize = 14;

/// The buffers, in the order in which their bases are handed over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Buffer {
    /// `*const u16`: key after key, port after port.
    Inputs,
    /// `*mut i16`: key after key, port after port.
    Outputs,
    /// `*mut u32`: the columns.
    Columns,
    /// `*mut u16`: rows of narrow lines.
    Narrow,
    /// `*mut i32`: rows of wide lines.
    Wide,
    /// `*const u32`: the ring indices.
    Rings,
    /// `*const i32`
    Lives,
    /// `*const i32`: all tables.
    Tables,
    /// `*mut u32`
    Events,
    /// `*mut i64`: key after key, probe after probe.
    Probes,
    /// `*mut Clock`
    Clock,
    /// `*const u128`: constants of the code for lanes.
    Constants,
    /// `*mut i32`: what a string's tick needs beside its words.
    Room,
    /// `*mut i64`: what is kept from one tick to the next.
    Kept,
}

impl Buffer {
    /// All, in order.
    const ALL: [Buffer; BUFFERS] = [
        Buffer::Inputs,
        Buffer::Outputs,
        Buffer::Columns,
        Buffer::Narrow,
        Buffer::Wide,
        Buffer::Rings,
        Buffer::Lives,
        Buffer::Tables,
        Buffer::Events,
        Buffer::Probes,
        Buffer::Clock,
        Buffer::Constants,
        Buffer::Room,
        Buffer::Kept,
    ];
}

/// How each kind of memory is accessed. What lies in different alias regions is never the same
/// place.
#[derive(Debug, Clone, Copy)]
pub(super) struct Access {
    /// What no code writes.
    pub fixed: MemFlagsData,
    /// Constants of lanes.
    pub constants: MemFlagsData,
    /// Columns.
    pub columns: MemFlagsData,
    /// Rows.
    pub rows: MemFlagsData,
    /// What leaves: outputs, events, probes, counters.
    pub leaving: MemFlagsData,
    /// What is kept.
    pub kept: MemFlagsData,
}

impl Access {
    /// Declares the alias regions in a function.
    pub fn new(f: &mut FunctionBuilder) -> Access {
        let mut region = |user_id: u32, description: &'static str| -> MemFlagsData {
            let data = AliasRegionData {
                user_id,
                description: description.into(),
            };
            let region: AliasRegion = f.func.dfg.alias_regions.insert(data);
            MemFlagsData::new()
                .with_notrap()
                .with_alias_region(Some(region))
        };
        Access {
            fixed: region(0, "fixed").with_readonly().with_can_move(),
            constants: region(4, "constants")
                .with_readonly()
                .with_can_move()
                .with_aligned(),
            columns: region(1, "columns"),
            rows: region(2, "rows"),
            leaving: region(3, "leaving"),
            kept: region(5, "kept"),
        }
    }
}

/// Values that are loop invariant over the keys of a tick, and those that step from key to key.
pub(super) struct LoopContext {
    /// Address of the table of bases.
    pub base_table: Value,
    /// Bases of the buffers.
    pub bases: [Value; BUFFERS],
    /// First element of the row that `delay line ticks` reads; of the row that is pushed to for
    /// `ticks` 0.
    pub rows: HashMap<(u32, u32), Value>,
    /// Index of the key; of the first of several keys in lanes.
    pub key: Value,
    /// Where the key's words stand in a column that begins at 0, for words of 32 and of 64 bits.
    pub words: [Value; 2],
}

impl Translator<'_> {
    /// Opens a function that runs a region for the keys from the second argument on and before the
    /// third; gives the block to go back to, and the end.
    pub fn open_keys(&mut self, region: &Region) -> (Block, Value) {
        let entry = self.f.create_block();
        self.f.append_block_params_for_function_params(entry);
        self.f.switch_to_block(entry);
        let [context, first, end] = std::array::from_fn(|at| self.f.block_params(entry)[at]);
        self.context.base_table = context;
        for buffer in Buffer::ALL {
            let offset = 8 * buffer as i32;
            self.context.bases[buffer as usize] =
                self.f.ins().load(I64, self.access.fixed, context, offset);
        }
        self.rows(region);
        let keys = self.f.create_block();
        self.f.ins().jump(keys, &[first.into()]);
        self.context.key = self.f.append_block_param(keys, I64);
        self.f.switch_to_block(keys);
        if self.layout.keys == 1 {
            // Then no address depends on it.
            self.context.key = self.f.ins().iconst(I64, 0);
        }
        let columns = self.base(Buffer::Columns);
        self.context.words = [2, 3].map(|shift| self.indexed(columns, self.context.key, shift));
        (keys, end)
    }

    /// Goes on with the key so many places later, or returns.
    pub fn close_keys(&mut self, (keys, end): (Block, Value), step: usize) {
        let key = self.f.ins().iadd_imm_s(self.context.key, step as i64);
        let more = self.f.ins().icmp(IntCC::SignedLessThan, key, end);
        let done = self.f.create_block();
        self.f.ins().brif(more, keys, &[key.into()], done, &[]);
        self.f.switch_to_block(done);
        self.f.ins().return_(&[]);
        self.f.seal_all_blocks();
    }

    /// Where this key's words begin in a buffer that holds so many bytes for each key.
    pub fn of_key(&mut self, buffer: Buffer, bytes: usize) -> Value {
        let offset = self.f.ins().imul_imm_s(self.context.key, bytes as i64);
        self.f
            .ins()
            .iadd(self.context.bases[buffer as usize], offset)
    }

    /// Finds the rows of this tick that a region uses.
    fn rows(&mut self, region: &Region) {
        for (line, ticks) in region.line_slots() {
            let ticks = ticks % self.kernel.lines[line as usize].len;
            if !self.context.rows.contains_key(&(line, ticks)) {
                let row = self.row(line, ticks);
                self.context.rows.insert((line, ticks), row);
            }
        }
    }

    /// First element of the row so many ticks ago; `ticks` is less than the line's length.
    fn row(&mut self, line: u32, ticks: u32) -> Value {
        let place = self.layout.lines[line as usize];
        let (width, buffer) = if place.narrow {
            (2, Buffer::Narrow)
        } else {
            (4, Buffer::Wide)
        };
        let rings = self.context.bases[Buffer::Rings as usize];
        let now = self
            .f
            .ins()
            .uload32(self.access.fixed, rings, 4 * place.ring as i32);
        let before = self.f.ins().iadd_imm_s(now, -i64::from(ticks));
        let around = self.f.ins().iadd_imm_s(before, place.len as i64);
        let below = self.f.ins().icmp_imm_s(IntCC::SignedLessThan, before, 0);
        let slot = self.f.ins().select(below, around, before);
        let offset = self
            .f
            .ins()
            .imul_imm_s(slot, width * self.layout.keys as i64);
        let start = self.f.ins().iadd_imm_s(
            self.context.bases[buffer as usize],
            width * place.start as i64,
        );
        self.f.ins().iadd(start, offset)
    }
}
