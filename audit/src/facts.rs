//! What is claimed of registers and flags in a state: intervals and equalities of words, possible
//! combinations of flags. An abstract semantics of the checker's own.
//!
//! Places have names; places of one name hold one word, and each name has an interval of signed
//! words. A name is an index of `values`; a place without one may hold any word.

#[cfg(test)]
mod tests;

use whippen_isa::Cond;

/// A place without a name.
pub const NONE: u16 = u16::MAX;
/// Any word.
pub const ALL: Interval = [i32::MIN as i64, i32::MAX as i64];
/// Places behind the registers: what was compared (two), what the flags show the sign of, whose
/// leading zeros were counted, and how many those are.
const LEFT: usize = 16;
const RIGHT: usize = 17;
const RESULT: usize = 18;
pub(crate) const COUNTED: usize = 19;
const ZEROS: usize = 20;
/// How many places there are.
pub const PLACES: usize = 21;
/// Names behind an instruction at most: several for each place, and far fewer than numbers.
const NAMES_MAX: usize = 64;

/// From the first to the second, both included; empty where the first is larger.
pub type Interval = [i64; 2];

/// See the module.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Facts {
    /// The name of each register, and of the places behind them.
    pub names: [u16; PLACES],
    /// The interval of each name.
    pub values: Vec<Interval>,
    /// Bit `n << 3 | z << 2 | c << 1 | v` for each combination of flags that may be.
    pub flags: u16,
}

impl Default for Facts {
    fn default() -> Self {
        Self {
            names: [NONE; PLACES],
            values: Vec::new(),
            flags: !0,
        }
    }
}

/// Whether the first holds all of the second.
pub(crate) fn holds(outer: Interval, inner: Interval) -> bool {
    outer[0] <= inner[0] && inner[1] <= outer[1]
}

fn both(a: Interval, b: Interval) -> Interval {
    [a[0].max(b[0]), a[1].min(b[1])]
}

fn without(value: Interval, word: i64) -> Interval {
    let [low, high] = value;
    [low + i64::from(low == word), high - i64::from(high == word)]
}

/// The words read as unsigned.
pub(crate) fn unsigned([low, high]: Interval) -> Interval {
    match (low < 0, high < 0) {
        (false, false) => [low, high],
        (true, true) => [low + (1 << 32), high + (1 << 32)],
        _ => [0, u32::MAX.into()],
    }
}

impl Facts {
    /// The interval of a register.
    pub fn of(&self, register: u8) -> Interval {
        self.of_place(usize::from(register & 15))
    }

    fn of_place(&self, place: usize) -> Interval {
        let value = self.values.get(usize::from(self.names[place]));
        value.copied().unwrap_or(ALL)
    }

    /// A new name with an interval.
    pub(crate) fn name(&mut self, value: Interval) -> u16 {
        self.values.push(value);
        (self.values.len() - 1) as u16
    }

    /// The name of a register, which gets one.
    pub(crate) fn name_of(&mut self, register: u8) -> u16 {
        let register = usize::from(register & 15);
        if self.names[register] == NONE {
            self.names[register] = self.name(ALL);
        }
        self.names[register]
    }

    /// A register holds a word of an interval.
    pub fn set(&mut self, register: u8, value: Interval) {
        self.names[usize::from(register & 15)] = self.name(value);
    }

    fn narrow(&mut self, name: u16, to: Interval) -> bool {
        let Some(value) = self.values.get_mut(usize::from(name)) else {
            return true;
        };
        *value = both(*value, to);
        value[0] <= value[1]
    }

    /// Whether words are possible at all.
    pub(crate) fn is_possible(&self) -> bool {
        let possible = |own: &Interval| own[0] <= own[1] && holds(ALL, *own);
        self.values.iter().all(possible)
    }

    /// Whether all that is claimed here holds where the other does.
    pub fn covers(&self, other: &Self) -> bool {
        let mut images = vec![NONE; self.values.len()];
        let agrees = |place: usize| {
            let (mine, theirs) = (self.names[place], other.names[place]);
            let Some(image) = images.get_mut(usize::from(mine)) else {
                return true;
            };
            let same = theirs != NONE && (*image == NONE || *image == theirs);
            *image = theirs;
            same && holds(self.of_place(place), other.of_place(place))
        };
        other.flags & !self.flags == 0 && (0..PLACES).all(agrees)
    }

    /// A register is zero, or is not; false where it cannot be so.
    pub(crate) fn assume_zero(&mut self, register: u8, zero: bool) -> bool {
        let name = self.name_of(register);
        let to = match zero {
            true => [0, 0],
            false => without(self.of(register), 0),
        };
        self.narrow(name, to)
    }

    /// A condition holds; false where it cannot.
    pub(crate) fn assume(&mut self, cond: Cond) -> bool {
        self.flags &= combinations(|[n, z, c, v]| cond.holds(n, z, c, v));
        self.flags != 0 && self.narrow_compared() && self.narrow_result() && self.renew_flags()
    }

    /// The flags show a difference, or the sign of a word, or nothing.
    pub(crate) fn show(&mut self, compared: Option<[u16; 2]>, result: u16) {
        let [left, right] = compared.unwrap_or([NONE; 2]);
        (self.names[LEFT], self.names[RIGHT], self.names[RESULT]) = (left, right, result);
        self.flags = !0;
        self.renew_flags();
    }

    /// That the last word whose leading zeros were counted is this one, and how many they are.
    pub(crate) fn set_counted(&mut self, word: u16, zeros: u16) {
        (self.names[COUNTED], self.names[ZEROS]) = (word, zeros);
    }

    /// Whether a register holds the word whose zeros were counted, and another their number.
    pub(crate) fn are_counted(&self, word: u8, zeros: u8) -> bool {
        let of = |register: u8| self.names[usize::from(register & 15)];
        let known = [self.names[COUNTED], self.names[ZEROS]];
        !known.contains(&NONE) && [of(word), of(zeros)] == known
    }

    /// Whether a combination is possible.
    fn can(&self, wanted: impl Fn([bool; 4]) -> bool) -> bool {
        self.flags & combinations(wanted) != 0
    }

    fn is_compared(&self) -> bool {
        self.names[LEFT] != NONE && self.names[RIGHT] != NONE
    }

    /// Takes out combinations that intervals exclude.
    fn renew_flags(&mut self) -> bool {
        if self.is_compared() {
            let same = self.names[LEFT] == self.names[RIGHT];
            self.flags &= of_difference(self.of_place(LEFT), self.of_place(RIGHT), same);
        }
        if self.names[RESULT] != NONE {
            let [low, high] = self.of_place(RESULT);
            self.flags &= combinations(|[n, z, _, _]| match (n, z) {
                (true, true) => false,
                (false, true) => low <= 0 && 0 <= high,
                (true, false) => low < 0,
                (false, false) => high > 0,
            });
        }
        self.flags != 0
    }

    /// What the combinations say of the words that were compared.
    fn narrow_compared(&mut self) -> bool {
        let (left, right) = (self.names[LEFT], self.names[RIGHT]);
        if !self.is_compared() || left == right {
            return true;
        }
        let less = self.can(|[n, z, _, v]| !z && n != v);
        let greater = self.can(|[n, z, _, v]| !z && n == v);
        let equal = self.can(|[_, z, _, _]| z);
        let lower = self.can(|[_, z, c, _]| !z && !c);
        let higher = self.can(|[_, z, c, _]| !z && c);
        let [a, b] = [self.of_place(LEFT), self.of_place(RIGHT)];
        let strict = i64::from(!equal);
        let (mut x, mut y) = (a, b);
        if !greater {
            (x, y) = at_most(x, y, strict);
        }
        if !less {
            (y, x) = at_most(y, x, strict);
        }
        if !higher && b[0] >= 0 {
            (x, y) = at_most(both(x, [0, ALL[1]]), y, strict);
        }
        if !lower && a[0] >= 0 {
            (y, x) = at_most(both(y, [0, ALL[1]]), x, strict);
        }
        if !equal {
            let [u, w] = [x, y];
            if w[0] == w[1] {
                x = without(u, w[0]);
            }
            if u[0] == u[1] {
                y = without(w, u[0]);
            }
        }
        self.narrow(left, x) && self.narrow(right, y)
    }

    /// What the combinations say of the word whose sign they show.
    fn narrow_result(&mut self) -> bool {
        let name = self.names[RESULT];
        if name == NONE {
            return true;
        }
        let mut to = self.of_place(RESULT);
        if !self.can(|[n, _, _, _]| n) {
            to[0] = to[0].max(0);
        }
        if !self.can(|[n, _, _, _]| !n) {
            to[1] = to[1].min(-1);
        }
        if !self.can(|[_, z, _, _]| !z) {
            to = both(to, [0, 0]);
        }
        if !self.can(|[_, z, _, _]| z) {
            to = without(to, 0);
        }
        self.narrow(name, to)
    }

    /// Forgets all but the registers of a set (bit 16: the flags), and numbers names in the order
    /// of places: for whoever writes certificates.
    pub fn trim(&mut self, relevant: u32) {
        let mut uses = vec![0_u32; self.values.len()];
        let mut count = |name: u16| {
            let known = uses.get_mut(usize::from(name));
            known.map_or(0, |uses| std::mem::replace(uses, *uses + 1))
        };
        for register in 0..16 {
            if relevant >> register & 1 == 0 {
                self.names[register] = NONE;
            }
            count(self.names[register]);
        }
        if relevant >> 16 & 1 == 0 {
            self.show(None, NONE);
        }
        let of_interest =
            |uses: &[u32], name: u16| uses.get(usize::from(name)).is_some_and(|u| *u > 0);
        if ![LEFT, RIGHT]
            .iter()
            .any(|at| of_interest(&uses, self.names[*at]))
        {
            (self.names[LEFT], self.names[RIGHT]) = (NONE, NONE);
        }
        if !of_interest(&uses, self.names[RESULT]) {
            self.names[RESULT] = NONE;
        }
        if ![COUNTED, ZEROS]
            .iter()
            .all(|at| of_interest(&uses, self.names[*at]))
        {
            (self.names[COUNTED], self.names[ZEROS]) = (NONE, NONE);
        }
        for place in LEFT..PLACES {
            if let Some(uses) = uses.get_mut(usize::from(self.names[place])) {
                *uses += 1;
            }
        }
        self.renumber(&uses);
    }

    /// Forgets names of no place, where there are many: of as few as a certificate may say, and of
    /// so few that a long way does not take ever more memory.
    pub(crate) fn forget_unused(&mut self) {
        if self.values.len() > NAMES_MAX {
            // Whatever is named is named twice: nothing is lost.
            let named = |name: usize| self.names.contains(&(name as u16));
            let uses = (0..self.values.len()).map(|name| 2 * u32::from(named(name)));
            let uses: Vec<u32> = uses.collect();
            self.renumber(&uses);
        }
    }

    fn renumber(&mut self, uses: &[u32]) {
        let mut new = vec![NONE; self.values.len()];
        let mut kept = Vec::new();
        for name in &mut self.names {
            let at = usize::from(*name);
            let tells = self
                .values
                .get(at)
                .filter(|value| uses[at] > 1 || **value != ALL);
            let Some(value) = tells else {
                *name = NONE;
                continue;
            };
            if new[at] == NONE {
                new[at] = kept.len() as u16;
                kept.push(*value);
            }
            *name = new[at];
        }
        self.values = kept;
    }
}

/// The first at most the second, or by so much less.
fn at_most(a: Interval, b: Interval, strict: i64) -> (Interval, Interval) {
    (
        [a[0], a[1].min(b[1] - strict)],
        [b[0].max(a[0] + strict), b[1]],
    )
}

/// The set of the combinations of N, Z, C, V that fit.
fn combinations(fits: impl Fn([bool; 4]) -> bool) -> u16 {
    let flags = |bits: u16| [8, 4, 2, 1].map(|flag| bits & flag != 0);
    (0..16)
        .filter(|bits| fits(flags(*bits)))
        .fold(0, |set, bits| set | 1 << bits)
}

/// The flags of `a - b`.
fn of_difference(a: Interval, b: Interval, same: bool) -> u16 {
    let (ua, ub) = (unsigned(a), unsigned(b));
    let meets = a[0].max(b[0]) <= a[1].min(b[1]);
    let (less, greater) = (!same && a[0] < b[1], !same && a[1] > b[0]);
    let (lower, higher) = (!same && ua[0] < ub[1], !same && ua[1] > ub[0]);
    let difference = [a[0] - b[1], a[1] - b[0]];
    let fits = difference[0] <= ALL[1] && difference[1] >= ALL[0];
    let overflows = !holds(ALL, difference);
    combinations(|[n, z, c, v]| match z {
        true => (same || meets) && !n && c && !v,
        false => {
            (if n != v { less } else { greater })
                && (if c { higher } else { lower })
                && (if v { overflows } else { fits })
        }
    })
}
