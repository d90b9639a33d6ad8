//! The budget: what a tick may take, what it takes at most, and what is left.

use std::fmt;
use whippen_board::Board;
use whippen_rate::Rate;

use super::cores::Bounded;
use whippen_isa::timing::Evidence;

/// Whether every core does its keys in time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Budget {
    /// Cycles that a tick may take: those between two ticks, rounded down, or fewer where the board
    /// says when its outputs are due.
    pub period_cycles: u64,
    /// Cycles of a second.
    pub clock_hz: u32,
    /// Ticks of a second.
    pub rate_hz: Rate,
    /// Cycles of a key, at most, with nobody else at the bus.
    pub key_cycles_max: u64,
    /// Cycles of a key, at most, waiting for others included.
    pub contended_key_cycles_max: u64,
    /// Each core.
    pub cores: Vec<CoreBudget>,
    /// How sure: as the least sure number.
    pub class: Evidence,
    /// How sure the cycles of a key are, with nobody else at the bus.
    pub key_class: Evidence,
}

/// One core.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CoreBudget {
    /// Its keys.
    pub keys: u32,
    /// Cycles of a frame, at most, waiting for others included.
    pub cycles_max: u64,
    /// Of those, the keys, waiting for others included.
    pub keys_cycles_max: u64,
    /// Around the keys, with nobody else at the bus.
    pub around_cycles_max: u64,
    /// Of those, waiting for the other core and for own fetches.
    pub contention_cycles_max: u64,
    /// Cycles that are left; negative where the deadline is missed.
    pub slack_cycles: i64,
    /// How many keys more would fit as far as the keys themselves go: what is around them may grow
    /// by a few cycles with them, and by many where they no longer fit in the memory near the core.
    pub more_keys: u32,
    /// Bytes of stack.
    pub stack_bytes_max: u32,
}

impl fmt::Display for Budget {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{} cycles a tick", self.period_cycles)?;
        for (number, core) in self.cores.iter().enumerate() {
            writeln!(
                f,
                "core {number}: {} keys, {} cycles at most, {} around the keys, {} left",
                core.keys, core.cycles_max, core.around_cycles_max, core.slack_cycles
            )?;
        }
        Ok(())
    }
}

impl Budget {
    /// Of cores that are bounded, on a board with so many ticks a second.
    pub fn of(cores: &[Bounded], board: &Board, rate_hz: Rate) -> Self {
        let clock_hz = board.clock_hz;
        let period_cycles = board.deadline_cycles(rate_hz.cycles_min(clock_hz));
        let key = |of: &dyn Fn(&Bounded) -> u64| cores.iter().map(of).max().unwrap_or(0);
        let core = |core: &Bounded| {
            let slack_cycles = period_cycles as i64 - core.contended.cycles_max as i64;
            let more = slack_cycles.max(0) as u64 / core.contended.key_cycles_max().max(1);
            CoreBudget {
                keys: core.alone.keys,
                cycles_max: core.contended.cycles_max,
                keys_cycles_max: core.contended.keys_cycles_max(),
                around_cycles_max: core.alone.around_cycles_max(),
                contention_cycles_max: core.contention_cycles_max(),
                slack_cycles,
                more_keys: u32::try_from(more).unwrap_or(u32::MAX),
                stack_bytes_max: core.alone.stack_bytes_max,
            }
        };
        Self {
            period_cycles,
            clock_hz,
            rate_hz,
            key_cycles_max: key(&|core| core.alone.key_cycles_max()),
            contended_key_cycles_max: key(&|core| core.contended.key_cycles_max()),
            cores: cores.iter().map(core).collect(),
            class: cores
                .iter()
                .map(|core| core.contended.class)
                .max()
                .unwrap_or(Evidence::Exact),
            key_class: cores
                .iter()
                .map(|core| core.alone.key_class())
                .max()
                .unwrap_or(Evidence::Exact),
        }
    }

    /// Whether every core is in time.
    pub fn fits(&self) -> bool {
        self.cores.iter().all(|core| core.slack_cycles >= 0)
    }

    /// The core that has least left.
    pub fn fullest(&self) -> Option<&CoreBudget> {
        self.cores.iter().min_by_key(|core| core.slack_cycles)
    }

    /// How many ticks a second every core could do.
    pub fn rate_hz_max(&self) -> u64 {
        let most = self
            .cores
            .iter()
            .map(|core| core.cycles_max)
            .max()
            .unwrap_or(1);
        u64::from(self.clock_hz) / most.max(1)
    }

    /// The clock (Hz) with which every core would be in time.
    pub fn clock_hz_min(&self) -> u64 {
        let most = self
            .cores
            .iter()
            .map(|core| core.cycles_max)
            .max()
            .unwrap_or(0);
        self.rate_hz.clock_hz_min(most)
    }

    /// Cycles that a key may take for the fullest core to be in time.
    pub fn key_cycles_allowed(&self) -> u64 {
        let allowed = |core: &CoreBudget| {
            let around = core.cycles_max.saturating_sub(core.keys_cycles_max);
            self.period_cycles.saturating_sub(around) / u64::from(core.keys.max(1))
        };
        self.cores.iter().map(allowed).min().unwrap_or(0)
    }
}

impl CoreBudget {
    /// The part of the period that is spent, at most.
    pub fn utilization(&self) -> f64 {
        self.cycles_max as f64 / self.period_cycles().max(1) as f64
    }

    /// The part of the period that is left; negative where the deadline is missed.
    pub fn slack(&self) -> f64 {
        self.slack_cycles as f64 / self.period_cycles().max(1) as f64
    }

    /// How many of its keys are too many, as far as the keys themselves go.
    pub fn surplus_keys(&self) -> u32 {
        let key = self.keys_cycles_max / u64::from(self.keys.max(1));
        let late = self.slack_cycles.min(0).unsigned_abs();
        u32::try_from(late.div_ceil(key.max(1))).unwrap_or(u32::MAX)
    }

    fn period_cycles(&self) -> i64 {
        self.cycles_max as i64 + self.slack_cycles
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// So many keys, which take so many of the cycles of a core.
    fn core(keys: u32, cycles_max: u64, keys_cycles_max: u64) -> CoreBudget {
        CoreBudget {
            keys,
            cycles_max,
            keys_cycles_max,
            around_cycles_max: cycles_max - keys_cycles_max,
            contention_cycles_max: 0,
            slack_cycles: 3000 - cycles_max as i64,
            more_keys: 0,
            stack_bytes_max: 0,
        }
    }

    /// 50 000 ticks a second at 150 MHz.
    fn budget(cores: &[CoreBudget]) -> Budget {
        Budget {
            period_cycles: 3000,
            clock_hz: 150_000_000,
            rate_hz: Rate::whole(50_000),
            key_cycles_max: 0,
            contended_key_cycles_max: 0,
            cores: cores.to_vec(),
            class: Evidence::Exact,
            key_class: Evidence::Exact,
        }
    }

    #[test]
    fn what_is_left_is_that_of_the_fullest_core() {
        let (room, full, late) = (
            core(10, 2500, 2000),
            core(4, 3000, 500),
            core(8, 3100, 2800),
        );
        let both = budget(&[room, late]);
        assert!(budget(&[room, full]).fits() && !both.fits());
        assert_eq!(both.fullest(), Some(&late));
        assert_eq!(budget(&[]).fullest(), None);
        assert_eq!(both.rate_hz_max(), 150_000_000 / 3100);
        assert_eq!(both.clock_hz_min(), 3100 * 50_000);
        // (3000 - 500) / 10, where the other one has (3000 - 300) / 8.
        assert_eq!(both.key_cycles_allowed(), 250);
        assert_eq!(budget(&[late]).key_cycles_allowed(), 337);
        assert_eq!(
            both.to_string(),
            "3000 cycles a tick\n\
             core 0: 10 keys, 2500 cycles at most, 500 around the keys, 500 left\n\
             core 1: 8 keys, 3100 cycles at most, 300 around the keys, -100 left\n"
        );
    }

    #[test]
    fn parts_are_those_of_a_period() {
        let (room, late) = (core(10, 2500, 2000), core(8, 3600, 2800));
        let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
        assert!(near(room.utilization(), 2500.0 / 3000.0) && near(room.slack(), 0.5 / 3.0));
        assert!(near(late.utilization(), 1.2) && near(late.slack(), -0.2));
    }

    /// Where a key takes 350 cycles.
    #[test]
    fn so_many_keys_are_too_many_as_are_late() {
        let surplus = |cycles| core(8, cycles, 2800).surplus_keys();
        let late = [2900, 3000, 3001, 3350, 3351, 3700, 3701];
        assert_eq!(late.map(surplus), [0, 0, 1, 1, 2, 2, 3]);
    }
}
