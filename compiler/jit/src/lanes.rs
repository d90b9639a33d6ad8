//! SIMD vectorisation over keys: `tick` of several keys at once, in the lanes of vectors of 128
//! bits.
//!
//! ```text
//!   i1    a mask: 32 bits of ones or zeros a key         key 0 | key 1 | key 2 | key 3
//!   i32   a word a key                                   key 0 | key 1 | key 2 | key 3
//!   i64   two vectors                                    key 0 | key 1       key 2 | key 3
//! ```
//!
//! **When.** Code for lanes is made for keyboards of at least [`WIDTH`] keys, on the machines where
//! it is tested ([`suits`]), unless sixteen keys run at once ([`super::avx512`]); what is left when
//! keys are grouped runs one key after the other. Every operator has a form for lanes: where
//! vectors have none (`div_round`, `sqrt`, `lookup`, indices that differ), the lanes are taken
//! apart.
//!
//! **Branches.** An arm of an `if` that is cheap and has no effect is computed for all lanes, and
//! each takes its own ([`control`]). Any other arm is skipped where no lane wants it; if one does,
//! all compute it and a mask keeps the effects of the others back. No proof of a range rests on a
//! condition, so lanes that do not want an arm stay in the ranges all the same.
//!
//! **Events** must come out by keys, but four keys reach one `emit` together. They go to a buffer
//! of their own, and [`super::JitFunctions`] sorts what a tick left there; that is rare.
//!
//! **Constants** stand in memory, once for each use, and are read where they are used: registers
//! are few.

mod arithmetic;
mod control;
mod memory;
mod operator;

pub(super) use control::{CHEAP, cost};

use super::loop_context::Buffer;
use super::translate::Translator;
use cranelift_codegen::ir::immediates::V128Imm;
use cranelift_codegen::ir::types::{I8X16, I32X4, I64, I64X2};
use cranelift_codegen::ir::{self, Endianness, InstBuilder, MemFlagsData, Value};
use cranelift_codegen::isa::TargetFrontendConfig;
use cranelift_frontend::FunctionBuilder;
use whippen_ids::IdMap;
use whippen_kernel::layout::Layout;
use whippen_kernel::{Kernel, Region, Type, Walk};

/// How many keys run at once.
pub(super) const WIDTH: usize = 4;

/// The most events that all keys together may emit in a tick.
const EVENTS_MAX: usize = 1 << 16;

/// Whether a kernel for so many keys is to be run in lanes.
pub(super) fn suits(kernel: &Kernel, keys: usize) -> bool {
    cfg!(target_arch = "x86_64")
        && keys >= WIDTH
        && keys.saturating_mul(kernel.tick.events_max() as usize) <= EVENTS_MAX
}

/// A value of the kernel in lanes.
#[derive(Debug, Clone, Copy)]
enum Lane {
    /// The same in all lanes, and known.
    Known(Type, i64),
    /// An `i1`.
    Mask(Value),
    /// An `i32`.
    Word(Value),
    /// An `i64`.
    Wide([Value; 2]),
    /// An `i64` still to be shifted right: a `narrow` of it needs no sign.
    Shifted(u8, [Value; 2]),
}

/// Translates `tick` for lanes.
pub(super) struct Lanes<'a> {
    /// What single keys and lanes share: bases, rows, operators of one key.
    t: Translator<'a>,
    /// Values of the kernel that are translated.
    values: IdMap<whippen_kernel::Value, Lane>,
    /// Lanes that want what is being computed; none: all.
    mask: Option<Value>,
    constants: Vec<u128>,
}

impl<'a> Lanes<'a> {
    /// A translator into an empty function.
    pub fn new(kernel: &'a Kernel, layout: &'a Layout, f: FunctionBuilder<'a>) -> Lanes<'a> {
        let values = IdMap::filled(Lane::Known(Type::I1, 0), kernel.values.len());
        Lanes {
            t: Translator::new(kernel, layout, f),
            values,
            mask: None,
            constants: Vec::new(),
        }
    }

    /// Translates the region as a whole function; gives its constants.
    pub fn function(mut self, region: &Region, config: TargetFrontendConfig) -> Vec<u128> {
        let keys = self.t.open_keys(region);
        // Read again for every group of keys, by way of memory that is written to: a base that
        // stays the same would take all constants out of the loop, and into registers that do not
        // exist.
        let (access, at) = (self.t.access.columns, 8 * Buffer::Constants as i32);
        let context = self.t.context.base_table;
        self.t.context.bases[Buffer::Constants as usize] =
            self.ins().load(I64, access, context, at);
        self.region(region);
        self.t.close_keys(keys, WIDTH);
        self.t.f.finalize(config);
        self.constants
    }

    fn ins(&mut self) -> cranelift_frontend::FuncInstBuilder<'_, 'a> {
        self.t.f.ins()
    }

    fn lane(&self, value: whippen_kernel::Value) -> Lane {
        self.values[value]
    }

    fn set_lane(&mut self, value: whippen_kernel::Value, lane: Lane) {
        self.values[value] = lane;
    }

    /// A constant of 128 bits.
    fn constant(&mut self, ty: ir::Type, bits: u128) -> Value {
        if bits == 0 {
            let zero = self
                .t
                .f
                .func
                .dfg
                .constants
                .insert(0u128.to_le_bytes().as_slice().into());
            return self.ins().vconst(ty, zero);
        }
        let (base, at) = (
            self.t.base(Buffer::Constants),
            16 * self.constants.len() as i32,
        );
        self.constants.push(bits);
        let access = self.t.access.constants;
        self.ins().load(ty, access, base, at)
    }

    /// The value as a mask.
    fn mask(&mut self, value: whippen_kernel::Value) -> Value {
        match self.lane(value) {
            Lane::Known(_, bit) => self.constant(I32X4, if bit == 0 { 0 } else { u128::MAX }),
            Lane::Mask(mask) => mask,
            Lane::Word(word) => word,
            Lane::Wide([low, _]) | Lane::Shifted(_, [low, _]) => low,
        }
    }

    /// The value as words.
    fn word(&mut self, value: whippen_kernel::Value) -> Value {
        match self.lane(value) {
            Lane::Known(_, number) => self.splat(number),
            Lane::Mask(word) | Lane::Word(word) => word,
            Lane::Wide([low, _]) | Lane::Shifted(_, [low, _]) => low,
        }
    }

    /// The value as pairs of 64 bits.
    fn wide(&mut self, value: whippen_kernel::Value) -> [Value; 2] {
        match self.lane(value) {
            Lane::Known(_, number) => [self.splat_wide(number); 2],
            Lane::Mask(word) | Lane::Word(word) => [word; 2],
            Lane::Wide(pair) => pair,
            Lane::Shifted(n, pair) => pair.map(|half| self.ins().sshr_imm_s(half, i64::from(n))),
        }
    }

    /// A word that is the same for all keys.
    fn splat(&mut self, number: i64) -> Value {
        let word = u128::from(number as u32);
        self.constant(I32X4, word | word << 32 | word << 64 | word << 96)
    }

    /// 64 bits that are the same for all keys.
    fn splat_wide(&mut self, number: i64) -> Value {
        let half = u128::from(number as u64);
        self.constant(I64X2, half | half << 64)
    }

    /// Lanes of 32 bits out of two vectors, by place: 0 to 3 in the first, 4 to 7 in the second.
    fn words_of(&mut self, [a, b]: [Value; 2], places: [u8; 4]) -> Value {
        let [a, b] = [a, b].map(|vector| self.reinterpreted(I8X16, vector));
        let bytes: Vec<u8> = places
            .iter()
            .flat_map(|place| (0..4).map(move |byte| 4 * place + byte))
            .collect();
        let places = self
            .t
            .f
            .func
            .dfg
            .immediates
            .push(V128Imm::from(&bytes[..]).into());
        let shuffled = self.ins().shuffle(a, b, places);
        self.reinterpreted(I32X4, shuffled)
    }

    /// The same bits as lanes of another width.
    fn reinterpreted(&mut self, ty: ir::Type, vector: Value) -> Value {
        let flags = MemFlagsData::new().with_endianness(Endianness::Little);
        if self.t.f.func.dfg.value_type(vector) == ty {
            vector
        } else {
            self.ins().bitcast(ty, flags, vector)
        }
    }
}
