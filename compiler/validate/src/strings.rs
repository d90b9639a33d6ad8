//! A tick of a string (`wave`) by the Kernel's definition (`whippen_kernel::wave`), point by point,
//! from the slopes and rates before it. Its code is a routine, which is run as any other code is.

use whippen_kernel::{Inst, wave};

use crate::bounds::WORD;
use crate::kernel::{KernelRun, round};
use crate::stop::Told;
use crate::term::{Term, Terms};
use crate::truth::Truth;

/// What a point is to its neighbours: its bend and its rate before the tick, and what it does to
/// both of them.
#[derive(Clone, Copy)]
struct Point {
    bend: Term,
    rate: Term,
    push: Term,
}

impl KernelRun<'_> {
    /// One tick of the string that two cells hold.
    pub(crate) fn wave(&mut self, terms: &mut Terms, inst: &Inst, [e, v]: [u32; 2]) -> Told<()> {
        let t = terms;
        let count = self.question.modes.kernel.cells[v as usize].len;
        let mut k = [t.constant(0); 4];
        for (to, arg) in k.iter_mut().zip(&inst.args) {
            *to = self.whole(t, *arg)?;
        }
        let slopes = self.words(t, e, count + 1)?;
        let rates = self.words(t, v, count)?;
        let points = points(t, k, &slopes, &rates, wave::ends(self.values, &inst.args))?;
        let [k0, _, _, k3] = k;
        let mut before = t.constant(0);
        for at in 0..count as usize {
            let [left, own, right] = [points[at], points[at + 1], points[at + 2]];
            let (bent, slowed) = (top(t, k0, own.bend)?, top(t, k3, own.rate)?);
            let sum = t.add(left.push, bent)?;
            let sum = t.add(sum, slowed)?;
            let pushed = t.word(sum)?;
            let pushed = t.add(pushed, right.push)?;
            let pushed = saturated(t, pushed)?;
            let rate = t.add(own.rate, pushed)?;
            let rate = saturated(t, rate)?;
            self.store_word(t, v, at, rate)?;
            let slope = moved(t, slopes[at], [before, rate])?;
            self.store_word(t, e, at, slope)?;
            before = rate;
        }
        let zero = t.constant(0);
        let last = moved(t, slopes[count as usize], [before, zero])?;
        self.store_word(t, e, count as usize, last)
    }

    /// The words of a cell.
    fn words(&mut self, terms: &mut Terms, cell: u32, count: u32) -> Told<Vec<Term>> {
        let word = |index: u32| {
            let index = terms.constant(index.into());
            let address = self.place(terms, cell, index)?;
            self.memory.load(terms, address, 4)
        };
        (0..count).map(word).collect()
    }

    fn store_word(&mut self, terms: &mut Terms, cell: u32, at: usize, word: Term) -> Told<()> {
        let index = terms.constant(at as i128);
        let address = self.place(terms, cell, index)?;
        self.memory.store(terms, address, 4, word, Truth::YES)
    }
}

/// All points, with the ends before the first and behind the last.
fn points(
    terms: &mut Terms,
    k: [Term; 4],
    slopes: &[Term],
    rates: &[Term],
    [left, right]: [i64; 2],
) -> Told<Vec<Point>> {
    let t = terms;
    let zero = t.constant(0);
    let first = held(t, left, slopes[0])?;
    let mut points = vec![Point::new(t, k, first, zero)?];
    for (two, rate) in slopes.windows(2).zip(rates) {
        let bend = t.sub(two[1], two[0])?;
        let bend = saturated(t, bend)?;
        points.push(Point::new(t, k, bend, *rate)?);
    }
    let away = t.sub(zero, slopes[rates.len()])?;
    let away = saturated(t, away)?;
    let last = held(t, right, away)?;
    points.push(Point::new(t, k, last, zero)?);
    Ok(points)
}

impl Point {
    fn new(terms: &mut Terms, k: [Term; 4], bend: Term, rate: Term) -> Told<Point> {
        let [_, k1, k2, _] = k;
        let (bent, slowed) = (top(terms, k1, bend)?, top(terms, k2, rate)?);
        let push = terms.add(bent, slowed)?;
        let push = terms.word(push)?;
        Ok(Point { bend, rate, push })
    }
}

/// A sum that saturates, which fits a word.
fn saturated(terms: &mut Terms, sum: Term) -> Told<Term> {
    let word = terms.saturate(sum)?;
    terms.learn(word, WORD)?;
    Ok(word)
}

/// The bend of an end, by the outermost slope away from it.
fn held(terms: &mut Terms, end: i64, slope: Term) -> Told<Term> {
    let bend = terms.scale(slope, end.into())?;
    saturated(terms, bend)
}

/// A slope between points of such new rates.
fn moved(terms: &mut Terms, slope: Term, [before, after]: [Term; 2]) -> Told<Term> {
    let apart = terms.sub(after, before)?;
    let new = terms.add_scaled(slope, apart, 2)?;
    terms.word(new)
}

/// `floor(k x / 2^32 + 1/2)`
fn top(terms: &mut Terms, k: Term, x: Term) -> Told<Term> {
    let product = terms.mul(k, x)?;
    round(terms, product, 32)
}
