//! Results in registers that were not used a moment ago, so that more instructions may change places.
//!
//! ```text
//!   ldr lr, a                ldr lr, a
//!   cmp lr, r9               movs r4, 0        What begins anew in a register that was just read
//!   mov lr, 0        =>      cmp lr, r9        cannot go up to where something is waited for.
//!   str lr, b                str r4, b
//! ```

use super::allocate::{Fixed, Placed};
use super::frame::FREE;
use super::hoist::{renamed, touched, wanted_before};
use whippen_isa::timing::Core;

/// A register that was touched longer ago than this is as good as any.
const LONG: usize = 12;
/// What it takes for a register that only long encodings name.
const HIGH: usize = 6;

/// The block with other registers; `behind` is what is wanted behind it. None if nothing can be otherwise.
pub(super) fn spread(block: &Placed, behind: u32, free: u32, core: &Core) -> Option<Vec<Fixed>> {
    let mut code = block.code.clone();
    let mut changed = false;
    for at in 0..code.len() {
        let (_, own) = touched(&code[at]);
        if own & free != own || own.count_ones() != 1 || code[at].inst.cond.is_some() {
            continue;
        }
        let wanted = wanted_after(&code, behind);
        let since = |register: u32| {
            let before = code[..at].iter().rev().take(LONG);
            let touches = |fixed: &Fixed| {
                let (uses, defs) = touched(fixed);
                (uses | defs) & register != 0
            };
            before.enumerate().find(|(_, fixed)| touches(fixed)).map_or(LONG, |(distance, _)| distance)
        };
        let worth = |register: u32| since(register).saturating_sub(if register < 1 << 8 { 0 } else { HIGH });
        let others = FREE.iter().map(|reg| 1_u32 << reg).filter(|reg| *reg != own && free & !wanted[at] & reg != 0);
        let mut better: Vec<u32> = others.filter(|reg| worth(*reg) > worth(own) + 2).collect();
        better.sort_by_key(|reg| std::cmp::Reverse(worth(*reg)));
        let new = better.into_iter().find_map(|reg| renamed(&code[at..], own, reg, behind, core));
        if let Some(new) = new {
            code.truncate(at);
            code.extend(new);
            changed = true;
        }
    }
    changed.then_some(code)
}

/// The registers that hold something that is wanted behind each instruction.
fn wanted_after(code: &[Fixed], behind: u32) -> Vec<u32> {
    let mut wanted = vec![behind; code.len()];
    let mut live = behind;
    for (at, fixed) in code.iter().enumerate().rev() {
        wanted[at] = live;
        live = wanted_before(fixed, live);
    }
    wanted
}
