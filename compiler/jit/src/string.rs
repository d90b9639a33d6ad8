//! A string of one key, as plain Rust that machine code calls: loops over blocks of points, which
//! Rust's compiler turns into the widest vectors that the machine has (`lib.rs` chooses). Those of
//! Cranelift have four words at most.
//!
//! ```text
//!   first pass:    P of the left end | P of each point | of the right end     to neighbours, in `room`
//!                  Q of each point                                            to themselves, in `room`
//!   second pass:   rates and slopes, in place
//!   blocks:        0 .. 15 | 16 .. 31 | ..
//!                                | the last 16     may overlap the one before, so the second pass
//!                                                  reads what it changes before it changes anything
//! ```
//!
//! What a block needs of its neighbours' words is moved into place in registers: to load it from
//! where it has just been stored takes longer.

use whippen_kernel::wave::POINTS;

/// Words that a tick needs beside those of the string.
pub(super) const ROOM_WORDS: usize = 2 * POINTS.high as usize + 2;

/// Points of a block; of strings with fewer, [`FEW`].
const MANY: usize = 16;

/// No string has fewer points.
const FEW: usize = 4;

/// What a string's tick is made of.
pub(super) struct Coefficients {
    /// `k0` to `k3`.
    pub k: [i32; 4],
    /// How the ends are held.
    pub ends: [i32; 2],
}

/// One tick of a string of so many slopes, and one rate fewer (`whippen_kernel::wave`).
#[inline(always)]
pub(super) fn tick(e: &mut [i32], v: &mut [i32], room: &mut [i32], by: &Coefficients) {
    let (done, own) = room.split_at_mut(v.len() + 2);
    if v.len() < MANY {
        products::<FEW>(e, v, done, own, by);
        motion::<FEW>(e, v, done, own);
    } else {
        products::<MANY>(e, v, done, own, by);
        motion::<MANY>(e, v, done, own);
    }
}

/// What points and ends do to their neighbours and what points do to themselves.
#[inline(always)]
fn products<const W: usize>(
    e: &[i32],
    v: &[i32],
    done: &mut [i32],
    own: &mut [i32],
    by: &Coefficients,
) {
    let (count, [k0, k1, k2, k3], [first, last]) = (v.len(), by.k, by.ends);
    done[0] = top(k1, first.saturating_mul(e[0])) as i32;
    done[count + 1] = top(k1, last.saturating_mul(0_i32.saturating_sub(e[count]))) as i32;
    for block in 0..count.div_ceil(W) {
        let at = (block * W).min(count - W);
        let (before, after): ([_; W], [_; W]) = (words(e, at), words(e, at + 1));
        let rates: [_; W] = words(v, at);
        let [mut bends, mut to_neighbours, mut to_itself] = [[0; W]; 3];
        for n in 0..W {
            bends[n] = after[n].saturating_sub(before[n]);
        }
        for n in 0..W {
            to_neighbours[n] = (top(k1, bends[n]) + top(k2, rates[n])) as i32;
            to_itself[n] = (top(k0, bends[n]) + top(k3, rates[n])) as i32;
        }
        put(done, at + 1, to_neighbours);
        put(own, at, to_itself);
    }
}

/// Rates and slopes behind the tick.
#[inline(always)]
fn motion<const W: usize>(e: &mut [i32], v: &mut [i32], done: &[i32], own: &[i32]) {
    let count = v.len();
    let last: ([_; W], [_; W]) = (words(e, count - W), words(v, count - W));
    for block in 0..count.div_ceil(W) {
        let at = (block * W).min(count - W);
        let (slopes, rates) = match at == count - W {
            true => last,
            false => (words(e, at), words(v, at)),
        };
        let (here, own): ([_; W], [_; W]) = (words(done, at + 1), words(own, at));
        let (before, after) = (behind(done[at], here), ahead(here, done[at + W + 1]));
        let [mut new_rates, mut new_slopes] = [[0_i32; W]; 2];
        for n in 0..W {
            let sum = before[n].wrapping_add(own[n]).saturating_add(after[n]);
            new_rates[n] = rates[n].saturating_add(sum);
        }
        let before = behind(if at == 0 { 0 } else { v[at - 1] }, new_rates);
        for n in 0..W {
            new_slopes[n] = moved(slopes[n], before[n], new_rates[n]);
        }
        put(v, at, new_rates);
        put(e, at, new_slopes);
    }
    e[count] = moved(e[count], v[count - 1], 0);
}

#[inline(always)]
fn words<const W: usize>(from: &[i32], at: usize) -> [i32; W] {
    let mut words = [0; W];
    words.copy_from_slice(&from[at..at + W]);
    words
}

#[inline(always)]
fn put<const W: usize>(to: &mut [i32], at: usize, words: [i32; W]) {
    to[at..at + W].copy_from_slice(&words);
}

/// The words one place on, behind a first one.
#[inline(always)]
fn behind<const W: usize>(first: i32, words: [i32; W]) -> [i32; W] {
    let mut moved = [first; W];
    moved[1..].copy_from_slice(&words[..W - 1]);
    moved
}

/// The words one place back, ahead of a last one.
#[inline(always)]
fn ahead<const W: usize>(words: [i32; W], last: i32) -> [i32; W] {
    let mut moved = [last; W];
    moved[..W - 1].copy_from_slice(&words[1..]);
    moved
}

/// `floor(k x / 2^32 + 1/2)`
#[inline(always)]
fn top(k: i32, x: i32) -> i64 {
    (i64::from(k) * i64::from(x) + (1 << 31)) >> 32
}

/// A slope between points of such new rates.
#[inline(always)]
fn moved(e: i32, before: i32, after: i32) -> i32 {
    e.wrapping_add(after.wrapping_sub(before).wrapping_mul(2))
}
