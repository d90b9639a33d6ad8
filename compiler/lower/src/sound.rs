//! What is heard: a cell per channel, in which this tick's sample stands when the tick is over.

use super::Lowerer;
use super::format::exp2;
use super::real::Scale;
use whippen_kernel::{Op, OpError, Range, Type};

/// What stands for 1.
const FULL_SCALE: i64 = 1 << 30;

/// The channels by name.
pub(super) fn channel_names(channels: usize) -> &'static [&'static str] {
    match channels {
        0 => &[],
        1 => &["sound"],
        _ => &["channel left", "channel right"],
    }
}

impl Lowerer<'_> {
    /// Declares the channels. Names end in a hard keyword: they meet no name of the program.
    pub(super) fn declare_channels(&mut self) {
        let range = Range::new(-FULL_SCALE, FULL_SCALE);
        for name in channel_names(self.step.model.channels.len()) {
            let cell = self.b.cell(&format!("{name}.emit"), Type::I32, range, 0);
            self.channels.push(cell);
        }
    }

    /// This tick's samples.
    pub(super) fn heard(&mut self) -> Result<(), OpError> {
        for (index, node) in self.step.model.channels.iter().enumerate() {
            let real = self.real(*node)?;
            let range = Range::new(-FULL_SCALE, FULL_SCALE);
            let kept = self.saturated(real, Scale::plain(exp2(-30)), range)?;
            self.b
                .effect(Op::Set(self.channels[index]), &[kept.value])?;
        }
        Ok(())
    }
}
