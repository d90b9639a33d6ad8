//! How many keys fit, found by few tries: each tells about how many more or fewer it would be.
//!
//! What is around the keys grows with them, and by much where they no longer fit in the memory near
//! the core, so what a try tells is a guess, and a better one the nearer it is. Where it leads out
//! of what is left to try, the middle is tried. The end is proven: so many keys fit, and one more
//! does not.

/// Keys of the first try, where there may be so many: about as many as most instruments have on
/// two cores.
const FIRST_TRY: u32 = 48;

/// Between a number of keys that fits and one that does not.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Between {
    /// How few there may be.
    least: u32,
    /// How many there may be.
    most: u32,
    /// Fewer than the least where none are known to fit.
    fits: u32,
    /// Too many, or more than there may be.
    exceeds: u32,
    /// What the last try says.
    guess: u32,
}

impl Between {
    /// Nothing is known yet. There are at least one and `least`, and at most `most`.
    pub fn new(least: u32, most: u32) -> Between {
        Between {
            least,
            most,
            fits: least - 1,
            exceeds: most + 1,
            guess: FIRST_TRY.clamp(least, most),
        }
    }

    /// How many are known to fit, if any are.
    pub fn fits(&self) -> Option<u32> {
        (self.fits >= self.least).then_some(self.fits)
    }

    /// What to try next; none where it is known.
    pub fn next(&self) -> Option<u32> {
        let left = self.fits + 1..self.exceeds;
        let is_tried = self.exceeds <= self.most;
        match self.guess {
            _ if left.is_empty() => None,
            guess if guess >= self.exceeds && !is_tried => Some(self.most),
            guess if left.contains(&guess) => Some(guess),
            // It may be that none fit, or that none have a bound.
            guess if guess < self.least && self.fits().is_none() => Some(self.least),
            _ => Some(left.start.midpoint(self.exceeds - 1)),
        }
    }

    /// Whether it is known behind a try of so many that do not fit: one fewer do.
    pub fn is_last(&self, keys: u32) -> bool {
        self.fits() == Some(keys - 1)
    }

    /// So many fit, and about so many more would; one more is tried in any case.
    pub fn fit(&mut self, keys: u32, more: u32) {
        (self.fits, self.guess) = (keys, keys.saturating_add(more.max(1)));
    }

    /// So many do not fit; about so many fewer would, where that is known.
    pub fn exceed(&mut self, keys: u32, fewer: Option<u32>) {
        (self.exceeds, self.guess) = (keys, fewer.map_or(0, |fewer| keys.saturating_sub(fewer)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How many keys fit, by the cycles that are left, the last number that did not, and after how
    /// many tries it is known. What is told of `told` cycles a key is all that the search knows.
    fn searched(
        [least, most]: [u32; 2],
        told: i64,
        left: impl Fn(u32) -> Option<i64>,
    ) -> (Option<u32>, Option<u32>, u32) {
        let (mut between, mut refused, mut tries) = (Between::new(least, most), None, 0);
        while let Some(keys) = between.next() {
            assert!((least..=most).contains(&keys), "{keys} of {between:?}");
            assert!(refused.is_none_or(|refused| keys < refused), "{between:?}");
            tries += 1;
            let is_last = between.is_last(keys);
            let too_many = left(keys).is_none_or(|left| left < 0);
            match left(keys) {
                Some(left) if left >= 0 => between.fit(keys, (left / told) as u32),
                left => {
                    let fewer = left.map(|left| -left.div_euclid(told));
                    between.exceed(keys, fewer.map(|fewer| fewer as u32));
                    refused = Some(keys);
                }
            }
            assert!(!(is_last && too_many) || between.next().is_none());
        }
        (between.fits(), refused, tries)
    }

    /// The same where some fit, and one more does not.
    fn found(range: [u32; 2], told: i64, left: impl Fn(u32) -> Option<i64>) -> (u32, u32) {
        let (fits, refused, tries) = searched(range, told, left);
        let fits = fits.expect("some fit");
        assert!(fits == range[1] || refused == Some(fits + 1), "{fits}");
        (fits, tries)
    }

    #[test]
    fn a_guess_that_is_right_is_tried_with_its_neighbour() {
        for fit in 2..=510 {
            let exact = |keys: u32| Some(i64::from(fit * 20) - i64::from(keys * 20));
            let (keys, tries) = found([2, 510], 20, exact);
            assert_eq!(keys, fit);
            assert!(tries <= 3, "{fit}: {tries}");
        }
    }

    /// As of 249 springs, where 259 looked right at first.
    #[test]
    fn what_grows_around_keys_takes_few_tries() {
        for (around, told) in [(5, 100), (10, 100), (40, 100), (-10, 100), (30, 20)] {
            let left = |keys: u32| Some(26_000 - i64::from(keys) * (told + around));
            let (keys, tries) = found([2, 510], told, left);
            assert!(left(keys) >= Some(0) && (keys == 510 || left(keys + 1) < Some(0)));
            assert!(tries <= 8, "{around} of {told}: {tries}");
        }
    }

    /// Where keys leave the near memory, or have no bound, nobody can guess.
    #[test]
    fn steps_are_found_by_halves() {
        for step in 3..=510 {
            let far = |keys: u32| Some(if keys < step { 90_000 } else { -90_000 });
            let none = |keys: u32| (keys < step).then_some(90_000);
            for (keys, tries) in [found([2, 510], 100, far), found([2, 510], 100, none)] {
                assert_eq!(keys, step - 1);
                assert!(tries <= 12, "{step}: {tries}");
            }
        }
        assert_eq!(found([1, 1], 100, |_| Some(500)), (1, 1));
    }

    /// The least is the last that is tried: what is proven of it is told.
    #[test]
    fn where_none_fit_the_least_is_tried() {
        for (least, told) in [(1, 100), (2, 100), (9, 130), (2, 1)] {
            let range = [least, 510];
            let (fits, refused, tries) = searched(range, told, |keys| Some(-100 * i64::from(keys)));
            assert_eq!((fits, refused), (None, Some(least)));
            assert!(tries <= 8, "{least}, {told}: {tries}");
            assert_eq!(searched(range, told, |_| None), (None, Some(least), 2));
        }
    }
}
