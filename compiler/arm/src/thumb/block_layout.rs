//! Block layout: the order of basic blocks in memory, and their terminators as branches.
//!
//! Blocks follow each other along the worst-case path, so that it has no taken branch; then along
//! the longest path of those that are left, and so on. A block that is empty but for a jump is left
//! out.
//!
//! Where branches do not reach, what is off the path may lie between parts of it instead, which
//! costs the path a jump for each such place.
//!
//! Not here: encodings and offsets of branches (`emit`).

use super::critical_path;
use super::emit::{Item, Label, Line, select_encodings};
use super::func::{Allocated, Block, BlockId, Terminator};
use super::minst::{MInst, PReg, template};
use super::tuning::OFF_PATH_DISTANCE;
use whippen_ids::{Id, IdMap};
use whippen_isa::timing::Core;
use whippen_isa::{Inst, Op};

/// Where blocks lie that the longest path does not take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum OffPath {
    /// Behind all of it.
    Behind,
    /// Near the branches to them, so that these reach.
    Near,
}

/// The items of a function whose blocks have labels from `base` on.
pub(super) fn lay_out_blocks(
    func: &Allocated,
    base: Label,
    core: &Core,
    next: &[String],
    init_done: Label,
    off_path: OffPath,
) -> Vec<Item> {
    let order = order_blocks(func, &critical_path::cycles_from_each(func, core), off_path);
    let mut items = Vec::new();
    for (at, index) in order.iter().enumerate() {
        let block = &func.blocks[index];
        items.push(Item::Label(base + index.index()));
        items.extend(block.rounds.map(|rounds| Item::Loop { rounds }));
        let flags = matches!(block.end, Terminator::Branch { .. });
        let mut code = block.code.iter().map(line_of).collect();
        select_encodings(&mut code, core.arch, flags);
        items.extend(code.into_iter().map(|(inst, origin, address)| Item::Inst {
            inst,
            origin,
            address,
        }));
        emit_terminator(
            func,
            block,
            order.get(at + 1).copied(),
            base,
            next,
            init_done,
            &mut items,
        );
    }
    items
}

fn line_of(inst: &MInst<PReg>) -> Line {
    (inst.inst, inst.origin, inst.address)
}

fn emit_terminator(
    func: &Allocated,
    block: &Block<PReg>,
    following: Option<BlockId>,
    base: Label,
    next: &[String],
    init_done: Label,
    items: &mut Vec<Item>,
) {
    let follows = |block: BlockId| following == Some(skip_empty_blocks(func, block));
    let label = |block: BlockId| base + skip_empty_blocks(func, block).index();
    match &block.end {
        Terminator::Jump(edge) if follows(edge.block) => {}
        Terminator::Jump(edge) => items.push(Item::Branch {
            cond: None,
            to: label(edge.block),
        }),
        Terminator::Branch { cond, yes, no, .. } => {
            if follows(*yes)
                && let Some(inverse) = cond.invert()
            {
                items.push(Item::Branch {
                    cond: Some(inverse),
                    to: label(*no),
                });
                return;
            }
            items.push(Item::Branch {
                cond: Some(*cond),
                to: label(*yes),
            });
            if !follows(*no) {
                items.push(Item::Branch {
                    cond: None,
                    to: label(*no),
                });
            }
        }
        Terminator::NextKey(code) => {
            let bx = Inst {
                m: code.0,
                ..template(Op::BX)
            };
            items.push(Item::Indirect {
                inst: bx,
                to: next.to_vec(),
            });
        }
        Terminator::FallThrough => items.push(Item::Branch {
            cond: None,
            to: init_done,
        }),
    }
}

/// Where a jump to a block ends up.
fn skip_empty_blocks(func: &Allocated, mut block: BlockId) -> BlockId {
    for _ in 0..func.blocks.len() {
        match &func.blocks[block] {
            Block {
                code,
                end: Terminator::Jump(edge),
                rounds: None,
                ..
            } if code.is_empty() => block = edge.block,
            _ => break,
        }
    }
    block
}

/// The blocks in order, without those that are only passed through; `longest` is the longest path
/// from each on.
fn order_blocks(
    func: &Allocated,
    longest: &IdMap<BlockId, u64>,
    off_path: OffPath,
) -> Vec<BlockId> {
    let mut seen = IdMap::filled(false, func.blocks.len());
    let mut order = Vec::new();
    // With how many bytes there were when each was put off.
    let (mut waiting, mut bytes) = (vec![(BlockId(0), 0)], 0);
    while let Some((start, _)) = waiting.pop() {
        let first = skip_empty_blocks(func, start);
        let mut next = Some(first);
        while let Some(block) = next.take().filter(|block| !seen[block]) {
            let mut since = waiting.iter().map(|(_, at)| *at);
            if off_path == OffPath::Near
                && block != first
                && since.any(|at| bytes > at + OFF_PATH_DISTANCE)
            {
                // The path goes on behind all that waits.
                waiting.insert(0, (block, bytes));
                break;
            }
            seen[block] = true;
            order.push(block);
            // Instructions of two bytes, and two branches.
            bytes += 2 * func.blocks[block].code.len() + 4;
            next = match &func.blocks[block].end {
                Terminator::Jump(edge) => Some(skip_empty_blocks(func, edge.block)),
                Terminator::Branch {
                    yes, no, likely, ..
                } => {
                    let yes_first = longest[yes] > longest[no]
                        || longest[yes] == longest[no] && *likely == Some(true);
                    let (on, off) = if yes_first { (*yes, *no) } else { (*no, *yes) };
                    waiting.push((off, bytes));
                    Some(skip_empty_blocks(func, on))
                }
                Terminator::NextKey(_) | Terminator::FallThrough => None,
            };
        }
    }
    order
}
