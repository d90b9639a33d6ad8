//! A progress bar on stderr, for what takes longer than a second, on a terminal only.

use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A bar that shows itself after a second.
pub struct Progress {
    bar: ProgressBar,
    start: Instant,
    rate_hz: f64,
}

impl Progress {
    /// For so many ticks.
    pub fn new(ticks: usize, rate_hz: u32) -> Progress {
        let bar = ProgressBar::with_draw_target(Some(ticks as u64), ProgressDrawTarget::hidden());
        let style = ProgressStyle::with_template("{bar:40} {msg}")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
        bar.set_style(style);
        Progress {
            bar,
            start: Instant::now(),
            rate_hz: f64::from(rate_hz),
        }
    }

    /// So many ticks are done.
    pub fn at(&self, ticks: usize) {
        if self.bar.is_hidden() && self.start.elapsed() > Duration::from_secs(1) {
            // indicatif draws on terminals only.
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
        }
        self.bar.set_position(ticks as u64);
        let total_s = self.bar.length().unwrap_or(0) as f64 / self.rate_hz;
        self.bar.set_message(format!(
            "{:.1} of {total_s:.1} s",
            ticks as f64 / self.rate_hz
        ));
    }

    /// Takes the bar away.
    pub fn done(&self) {
        self.bar.finish_and_clear();
    }
}
