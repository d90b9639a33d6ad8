//! The budget: what a tick may take, what it takes at most, and what is left.

use super::Tick;
use whippen_isa::timing::Evidence;

/// What has to be done in which time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Deadline {
    /// Cycles of a second.
    pub clock_hz: u32,
    /// Ticks of a second.
    pub rate_hz: u32,
    /// Cores that share the keys.
    pub cores: u32,
    /// Keys of all cores.
    pub keys: u32,
    /// Cycles of a tick that a core spends around its keys' code at most: the firmware's, interrupts included.
    pub firmware_cycles: u64,
}

/// One core.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CoreBudget {
    /// Its keys.
    pub keys: u32,
    /// Cycles of a tick, at most.
    pub cycles_max: u64,
    /// Cycles that are left; negative where the deadline is missed.
    pub slack_cycles: i64,
    /// How many keys more would fit.
    pub more_keys: u32,
}

/// Whether every core does its keys in time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Budget {
    /// Cycles between two ticks, rounded down.
    pub period_cycles: u64,
    /// Cycles of a key, at most.
    pub key_cycles_max: u64,
    /// Cycles of a tick around the keys, the firmware's included.
    pub frame_cycles_max: u64,
    /// Each core.
    pub cores: Vec<CoreBudget>,
    /// How sure: as the least sure number.
    pub class: Evidence,
}

impl Budget {
    /// Of ticks with this deadline: the first cores take one key more where keys do not divide evenly.
    pub fn of(tick: &Tick, deadline: &Deadline) -> Self {
        let period_cycles = u64::from(deadline.clock_hz / deadline.rate_hz.max(1));
        let (key, frame) = (tick.key_cycles_max(), tick.frame_cycles_max() + deadline.firmware_cycles);
        let cores = deadline.cores.max(1);
        let core = |number| {
            let keys = deadline.keys / cores + u32::from(number < deadline.keys % cores);
            let cycles_max = frame + u64::from(keys) * key;
            let fitting = period_cycles.saturating_sub(frame) / key.max(1);
            CoreBudget {
                keys,
                cycles_max,
                slack_cycles: period_cycles as i64 - cycles_max as i64,
                more_keys: u32::try_from(fitting).unwrap_or(u32::MAX).saturating_sub(keys),
            }
        };
        Self {
            period_cycles,
            key_cycles_max: key,
            frame_cycles_max: frame,
            cores: (0..cores).map(core).collect(),
            class: tick.class(),
        }
    }

    /// Whether every core is in time.
    pub fn fits(&self) -> bool {
        self.cores.iter().all(|core| core.slack_cycles >= 0)
    }

    /// Cycles that a key may take for the fullest core to be in time.
    pub fn key_cycles_allowed(&self) -> u64 {
        let keys = self.cores.iter().map(|core| core.keys).max().unwrap_or(0);
        self.period_cycles.saturating_sub(self.frame_cycles_max) / u64::from(keys.max(1))
    }
}

impl CoreBudget {
    /// The part of the period that is spent, at most.
    pub fn utilization(&self) -> f64 {
        let period = self.cycles_max as i64 + self.slack_cycles;
        self.cycles_max as f64 / period.max(1) as f64
    }
}
