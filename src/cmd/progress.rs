//! Progress on stderr, for what takes longer than a second, on a terminal only: a bar where it is
//! known how much there is, a line with the time that has gone by where it is not.

use std::io::IsTerminal;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};
use whippen_compiler::rate::Rate;

#[cfg(target_family = "wasm")]
use super::unseen as indicatif;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// What is over before is not shown.
const SHOWN_AFTER: Duration = Duration::from_secs(1);

/// The line is drawn again so often.
const REDRAWN: Duration = Duration::from_millis(100);

/// Does something that may take a while, and says what it is and for how long the command has
/// worked. Of what is done inside of it, or at the same time, nothing is said.
pub fn during<T>(what: &str, work: impl FnOnce() -> T) -> T {
    static BEGUN: OnceLock<Instant> = OnceLock::new();
    static BUSY: AtomicBool = AtomicBool::new(false);
    let begun = *BEGUN.get_or_init(Instant::now);
    if !std::io::stderr().is_terminal() || BUSY.swap(true, Ordering::Relaxed) {
        return work();
    }
    let (done, wait) = channel::<()>();
    let shown = move || {
        let rest = SHOWN_AFTER.saturating_sub(begun.elapsed());
        if wait.recv_timeout(rest) != Err(RecvTimeoutError::Timeout) {
            return;
        }
        let line = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
        let style = ProgressStyle::with_template("{msg}");
        line.set_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()));
        let mut over = Err(RecvTimeoutError::Timeout);
        while over == Err(RecvTimeoutError::Timeout) {
            line.set_message(format!("{what}: {:.0} s", begun.elapsed().as_secs_f64()));
            line.tick();
            over = wait.recv_timeout(REDRAWN);
        }
        line.finish_and_clear();
    };
    let result = thread::scope(|scope| {
        scope.spawn(shown);
        let done = done;
        let result = work();
        // Whoever waits hears that nobody will say anything any more.
        drop(done);
        result
    });
    BUSY.store(false, Ordering::Relaxed);
    result
}

/// A bar that shows itself after a second.
pub struct Progress {
    bar: ProgressBar,
    start: Instant,
    counted: Counted,
}

/// What a bar counts.
enum Counted {
    /// Ticks at a rate (Hz), told as seconds.
    Ticks(f64),
    /// Things of this name.
    Things(&'static str),
}

impl Progress {
    /// For so many ticks.
    pub fn new(ticks: usize, rate_hz: Rate) -> Progress {
        Progress::counting(ticks, Counted::Ticks(f64::from(rate_hz)))
    }

    /// For so many things of a name, such as keys.
    pub fn of_things(count: usize, name: &'static str) -> Progress {
        Progress::counting(count, Counted::Things(name))
    }

    fn counting(count: usize, counted: Counted) -> Progress {
        let bar = ProgressBar::with_draw_target(Some(count as u64), ProgressDrawTarget::hidden());
        let style = ProgressStyle::with_template("{bar:40} {msg}")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
        bar.set_style(style);
        Progress {
            bar,
            start: Instant::now(),
            counted,
        }
    }

    /// So many ticks or things are done.
    pub fn at(&self, done: usize) {
        if self.bar.is_hidden() && self.start.elapsed() > SHOWN_AFTER {
            // indicatif draws on terminals only.
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
        }
        self.bar.set_position(done as u64);
        let total = self.bar.length().unwrap_or(0);
        self.bar.set_message(match self.counted {
            Counted::Ticks(rate_hz) => {
                format!(
                    "{:.1} of {:.1} s",
                    done as f64 / rate_hz,
                    total as f64 / rate_hz
                )
            }
            Counted::Things(name) => format!("{done} of {total} {name}"),
        });
    }

    /// Takes the bar away.
    pub fn done(&self) {
        self.bar.finish_and_clear();
    }
}
