//! Force over travel, pressed and let up, and what a technician reads off it.

/// Places along the dip at which a force is kept: of 10 mm every hundredth.
const PLACES: usize = 1000;

/// The part of the way to let-off, or to the bottom, in which weights are read: the key has left
/// its rest and nothing gives way yet.
const WINDOW: (f64, f64) = (0.25, 0.75);

/// A force that falls by less is no let-off (N): two grams, which a finger hardly feels.
const LEAST_FALL_N: f64 = 0.02;
/// Nor one that falls by less than this part of the greatest force on the way.
const LEAST_FALL: f64 = 0.1;
/// What falls over a longer part of the dip is a slope.
const LONGEST_FALL: f64 = 1.0 / 3.0;
/// What gives way has been held over this part of the dip: a part that the key meets on its way
/// pushes back and is moving before that.
const HELD: f64 = 0.01;
/// A fall begins and ends within this part of its size.
const EDGE: f64 = 0.01;

/// The force at places along the travel, in one direction.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Branch {
    /// Travel (m), rising, and force (N) there.
    pub points: Vec<(f64, f64)>,
}

impl Branch {
    /// The means of samples of travel (m) and force (N) around places along a dip.
    pub fn of(samples: impl Iterator<Item = (f64, f64)>, dip_m: f64) -> Branch {
        let mut sums = vec![(0.0, 0.0, 0_usize); PLACES];
        for (travel_m, force_n) in samples {
            let place = (travel_m / dip_m * PLACES as f64).floor();
            if (0.0..PLACES as f64).contains(&place) {
                let sum = &mut sums[place as usize];
                *sum = (sum.0 + travel_m, sum.1 + force_n, sum.2 + 1);
            }
        }
        let visited = sums.into_iter().filter(|sum| sum.2 > 0);
        let mean = |(x, f, n): (f64, f64, usize)| (x / n as f64, f / n as f64);
        Branch {
            points: visited.map(mean).collect(),
        }
    }

    /// The mean force between two places (N).
    fn mean(&self, (from_m, to_m): (f64, f64)) -> f64 {
        let inside = self.points.iter().filter(|p| p.0 >= from_m && p.0 <= to_m);
        let (sum, count) = inside.fold((0.0, 0), |(sum, count), p| (sum + p.1, count + 1));
        sum / f64::from(count.max(1))
    }

    /// The first fall of the force on the way down.
    fn fall(&self, dip_m: f64) -> Option<LetOff> {
        let forces = || self.points.iter().map(|p| p.1.abs());
        let least = LEAST_FALL_N.max(LEAST_FALL * forces().fold(0.0, f64::max));
        let mut from = 0;
        while from < self.points.len() {
            // Up to a peak from which the force falls far enough, and on to the bottom of the fall.
            let (peak, foot) = self.fall_after(from, least)?;
            let let_off = self.edges(peak, foot);
            let is_slope = let_off.end_m - let_off.travel_m > LONGEST_FALL * dip_m;
            let held = self.least_before(peak, HELD * dip_m);
            if !is_slope && held - self.points[foot].1 >= least {
                return Some(let_off);
            }
            from = foot;
        }
        None
    }

    /// The indices of the next peak and of the lowest place before the force rises again.
    fn fall_after(&self, from: usize, least: f64) -> Option<(usize, usize)> {
        let force = |at: usize| self.points[at].1;
        let (mut peak, mut foot) = (from, None);
        for at in from..self.points.len() {
            match foot {
                None if force(at) >= force(peak) => peak = at,
                None if force(at) <= force(peak) - least => foot = Some(at),
                Some(low) if force(at) < force(low) => foot = Some(at),
                Some(low) if force(at) > force(low) + least => break,
                _ => {}
            }
        }
        foot.map(|foot| (peak, foot))
    }

    /// The least force over this way up to a place.
    fn least_before(&self, at: usize, way_m: f64) -> f64 {
        let from_m = self.points[at].0 - way_m;
        let way = self.points[..=at].iter().rev();
        let near = way.take_while(|p| p.0 >= from_m);
        near.fold(f64::INFINITY, |least, p| least.min(p.1))
    }

    /// Where a fall begins and ends, but for its edges.
    fn edges(&self, peak: usize, foot: usize) -> LetOff {
        let (high, low) = (self.points[peak].1, self.points[foot].1);
        let edge = EDGE * (high - low);
        let way = &self.points[peak..=foot];
        let begun = way.iter().rev().find(|p| p.1 >= high - edge);
        let ended = way.iter().find(|p| p.1 <= low + 10.0 * edge);
        LetOff {
            travel_m: begun.unwrap_or(&way[0]).0,
            force_n: high,
            end_m: ended.unwrap_or(&self.points[foot]).0,
        }
    }
}

/// Where the force gives way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LetOff {
    /// Where it begins to fall (m).
    pub travel_m: f64,
    /// The force there (N).
    pub force_n: f64,
    /// Where nine tenths of the fall are over (m).
    pub end_m: f64,
}

/// A slow press and return.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Touch {
    /// How far the key went (m).
    pub dip_m: f64,
    /// On the way down.
    pub press: Branch,
    /// On the way up.
    pub back: Branch,
}

impl Touch {
    /// Where the force gives way on the way down, if it does.
    pub fn let_off(&self) -> Option<LetOff> {
        self.press.fall(self.dip_m)
    }

    /// Where weights are read (m).
    pub fn window_m(&self) -> (f64, f64) {
        let reach_m = self.let_off().map_or(self.dip_m, |l| l.travel_m);
        (WINDOW.0 * reach_m, WINDOW.1 * reach_m)
    }

    /// The force that presses the key slowly (N).
    pub fn down_weight(&self) -> f64 {
        self.press.mean(self.window_m())
    }

    /// The force against which the key slowly rises (N).
    pub fn up_weight(&self) -> f64 {
        self.back.mean(self.window_m())
    }

    /// The down-weight where another press has it read.
    pub(super) fn down_weight_like(&self, other: &Touch) -> f64 {
        self.press.mean(other.window_m())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DIP_M: f64 = 0.010;

    /// What a law of force reads.
    fn touch(law: impl Fn(f64, f64) -> f64) -> Touch {
        let branch = |sign: f64| {
            let samples = (0..100_000).map(|i| (f64::from(i) + 0.5) * DIP_M / 1e5);
            Branch::of(samples.map(|x| (x, law(x, sign))), DIP_M)
        };
        Touch {
            dip_m: DIP_M,
            press: branch(1.0),
            back: branch(-1.0),
        }
    }

    fn close(found: f64, known: f64, within: f64) {
        assert!((found - known).abs() <= within, "{found} is not {known}");
    }

    #[test]
    fn a_spring_with_coulomb_friction_has_its_mean_force_and_its_friction() {
        let spring = touch(|x, sign| 0.2 + 40.0 * x + 0.15 * sign);
        close(spring.down_weight(), 0.2 + 0.2 + 0.15, 1e-6);
        close(spring.up_weight(), 0.2 + 0.2 - 0.15, 1e-6);
        assert_eq!(spring.let_off(), None);
    }

    #[test]
    fn a_weight_that_breaks_has_its_let_off_there() {
        let broken = touch(|x, _| if x < 0.007 { 0.5 } else { 0.1 });
        let let_off = broken.let_off().expect("it breaks");
        close(let_off.travel_m, 0.007, 1e-5);
        close(let_off.end_m, 0.007, 2e-5);
        close(let_off.force_n, 0.5, 1e-9);
        close(broken.down_weight(), 0.5, 1e-9);
        close(broken.window_m().1, 0.75 * 0.007, 1e-5);
    }

    #[test]
    fn a_ramp_that_falls_over_a_millimetre_ends_there() {
        let ramp = touch(|x, _| 0.5 - 0.4 * ((x - 0.006) / 0.001).clamp(0.0, 1.0));
        let let_off = ramp.let_off().expect("it falls");
        close(let_off.travel_m, 0.006, 3e-5);
        close(let_off.end_m, 0.0069, 2e-5);
    }

    #[test]
    fn slopes_and_ripples_are_no_let_off() {
        let slope = touch(|x, _| 1.0 - 60.0 * x);
        assert_eq!(slope.let_off(), None);
        let ripple = touch(|x, _| 0.5 + 0.009 * libm::sin(x * 6000.0));
        assert_eq!(ripple.let_off(), None);
        // A slope first does not hide what breaks after it.
        let both = touch(|x, _| match x {
            x if x < 0.005 => 1.0 - 60.0 * x,
            x if x < 0.008 => 0.7 + 100.0 * (x - 0.005),
            _ => 0.2,
        });
        close(both.let_off().expect("it breaks").travel_m, 0.008, 1e-5);
    }

    #[test]
    fn what_the_key_meets_on_its_way_is_no_let_off() {
        // A blow over 0.05 mm, and what was met is carried from there on.
        let met = |x: f64| match x {
            x if x < 0.0005 => 0.37,
            x if x < 0.00055 => 0.62,
            x if x < 0.0076 => 0.52,
            _ => 0.37,
        };
        let met = touch(|x, _| met(x));
        close(met.let_off().expect("it breaks").travel_m, 0.0076, 1e-5);
        close(met.down_weight(), 0.52, 1e-9);
        // Nor one after which nothing is carried.
        let blow = touch(|x, _| {
            if (0.005..0.00508).contains(&x) {
                0.6
            } else {
                0.5
            }
        });
        assert_eq!(blow.let_off(), None);
        // What is held for longer than that and then lost is one.
        let snap = touch(|x, _| {
            if (0.005..0.0053).contains(&x) {
                0.6
            } else {
                0.5
            }
        });
        close(snap.let_off().expect("it snaps").travel_m, 0.0053, 1e-5);
    }

    #[test]
    fn nothing_measured_reads_nothing() {
        assert_eq!(Touch::default().let_off(), None);
        assert_eq!(Touch::default().down_weight(), 0.0);
    }
}
