//! Tail merging: blocks that do the same and lead to the same blocks become one.
//!
//! Two blocks are the same if they do the same to the same values from above, their own values
//! numbered as they come and in the same ranges, and lead to blocks that are the same. Both see all
//! that they read, so whatever leads to either may lead to one of them.

use super::{Block, BlockId, End, tuning};
use rustc_hash::{FxHashMap, FxHasher};
use std::hash::{Hash, Hasher};
use whippen_ids::IdMap;
use whippen_kernel::{Inst, Region, Value, ValueInfo};

/// The blocks with everyone led to the first of those that are the same; the others are led to by
/// nobody.
pub(super) fn equal_tails(
    mut blocks: IdMap<BlockId, Block>,
    values: &IdMap<Value, ValueInfo>,
) -> IdMap<BlockId, Block> {
    let mut known: FxHashMap<Vec<u64>, BlockId> = FxHashMap::default();
    let mut first: IdMap<BlockId, BlockId> = blocks.ids().collect();
    let shapes = shapes(&blocks);
    let mut alike: FxHashMap<u64, usize> = FxHashMap::default();
    shapes
        .iter()
        .for_each(|shape| *alike.entry(*shape).or_default() += 1);
    // What a block leads to comes after it, so from the end all that is equal below has become one.
    for at in blocks.ids().rev() {
        blocks[at]
            .end
            .targets_mut()
            .for_each(|target| target.block = first[target.block]);
        if alike[&shapes[at]] == 1 {
            continue;
        }
        let mut spelled = Spelled {
            infos: values,
            words: Vec::new(),
            own: FxHashMap::default(),
            count: 0,
            depth: 0,
        };
        spelled.block(&blocks, at);
        first[at] = *known.entry(spelled.words).or_insert(at);
    }
    blocks
}

/// Of each block a number that says which operators it and those below it have: others are not the
/// same.
fn shapes(blocks: &IdMap<BlockId, Block>) -> IdMap<BlockId, u64> {
    let mut shapes = IdMap::filled(0, blocks.len());
    for (at, block) in blocks.enumerated().rev() {
        let mut hasher = FxHasher::default();
        block
            .insts
            .iter()
            .for_each(|inst| inst.op.row().index.hash(&mut hasher));
        if let End::Next(next) = block.end {
            next.hash(&mut hasher);
        }
        block
            .end
            .targets()
            .for_each(|target| shapes[target.block].hash(&mut hasher));
        shapes[at] = hasher.finish();
    }
    shapes
}

/// A block and all below it as numbers.
struct Spelled<'a> {
    infos: &'a IdMap<Value, ValueInfo>,
    words: Vec<u64>,
    own: FxHashMap<Value, u64>,
    /// How many definitions came by; one that two paths lead to comes by twice.
    count: u64,
    /// How many blocks down this is.
    depth: usize,
}

impl Spelled<'_> {
    fn block(&mut self, blocks: &IdMap<BlockId, Block>, at: BlockId) {
        if self.depth == tuning::TAIL_DEEP {
            return self.words.extend([4, at.0.into()]);
        }
        self.depth += 1;
        self.spell(blocks, at);
        self.depth -= 1;
    }

    fn spell(&mut self, blocks: &IdMap<BlockId, Block>, at: BlockId) {
        let Some(block) = blocks.get(at) else { return };
        self.define(&block.params);
        block.insts.iter().for_each(|inst| self.inst(inst));
        match &block.end {
            End::Next(next) => self.words.extend([0, next.0.into()]),
            End::Jump(target) => {
                self.words.push(1);
                self.values(&target.args);
                self.block(blocks, target.block);
            }
            End::Branch {
                condition,
                yes,
                no,
                likely,
            } => {
                self.words.extend([2, likely.map_or(2, u64::from)]);
                self.values(&[*condition]);
                for target in [yes, no] {
                    self.values(&target.args);
                    self.block(blocks, target.block);
                }
            }
        }
    }

    fn inst(&mut self, inst: &Inst) {
        let [n, m] = inst.op.immediates();
        self.words
            .extend([3, inst.op.row().index as u64, n as u64, m as u64]);
        self.values(&inst.args);
        inst.regions.iter().for_each(|region| self.region(region));
        self.define(&inst.results);
    }

    fn region(&mut self, region: &Region) {
        self.define(&region.params);
        region.insts.iter().for_each(|inst| self.inst(inst));
        self.values(&region.yields);
    }

    fn values(&mut self, values: &[Value]) {
        self.words.push(values.len() as u64);
        for value in values {
            // Own values are told from those of above by their lowest bit.
            let word = self
                .own
                .get(value)
                .map_or(u64::from(value.0) << 1, |own| own << 1 | 1);
            self.words.push(word);
        }
    }

    fn define(&mut self, values: &[Value]) {
        self.words.push(values.len() as u64);
        for value in values {
            let ValueInfo { ty, range } = self.infos[value];
            self.words
                .extend([u64::from(ty.bits()), range.low as u64, range.high as u64]);
            self.own.insert(*value, self.count);
            self.count += 1;
        }
    }
}
