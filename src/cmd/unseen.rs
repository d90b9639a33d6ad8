//! What of `indicatif` the commands use, in a module of the command (`docs/studio.md`): bars that
//! nobody sees, because nothing there is a terminal.

use std::convert::Infallible;

/// Where a bar is drawn: nowhere.
pub struct ProgressDrawTarget;

impl ProgressDrawTarget {
    pub fn stderr() -> Self {
        ProgressDrawTarget
    }

    pub fn hidden() -> Self {
        ProgressDrawTarget
    }
}

/// How a bar looks.
pub struct ProgressStyle;

impl ProgressStyle {
    pub fn with_template(_template: &str) -> Result<Self, Infallible> {
        Ok(ProgressStyle)
    }

    pub fn default_bar() -> Self {
        ProgressStyle
    }

    pub fn default_spinner() -> Self {
        ProgressStyle
    }
}

/// A bar.
pub struct ProgressBar;

impl ProgressBar {
    pub fn with_draw_target(_length: Option<u64>, _target: ProgressDrawTarget) -> Self {
        ProgressBar
    }

    pub fn hidden() -> Self {
        ProgressBar
    }

    pub fn with_style(self, _style: ProgressStyle) -> Self {
        self
    }

    pub fn set_style(&self, _style: ProgressStyle) {}

    pub fn is_hidden(&self) -> bool {
        true
    }

    pub fn set_draw_target(&self, _target: ProgressDrawTarget) {}

    pub fn set_position(&self, _at: u64) {}

    pub fn length(&self) -> Option<u64> {
        None
    }

    pub fn set_message(&self, _message: String) {}

    pub fn tick(&self) {}

    pub fn suspend(&self, print: impl FnOnce()) {
        print();
    }

    pub fn finish_and_clear(&self) {}
}
