//! What is heard: a cell per channel, in which this tick's sample stands when the tick is over.

use super::Lowerer;
use super::format::exp2;
use super::real::{Real, Scale};
use whippen_kernel::{CHANNEL, FULL_SCALE, Op, OpError, Range, Type};

/// A channel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Channel {
    cell: u32,
    /// This tick's sample, once it is made.
    pub sample: Option<Real>,
}

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
            let cell = self
                .b
                .cell(&format!("{name}{CHANNEL}"), Type::I32, range, 0);
            self.channels.push(Channel { cell, sample: None });
        }
    }

    /// This tick's samples.
    pub(super) fn heard(&mut self) -> Result<(), OpError> {
        for (index, node) in self.step.model.channels.iter().enumerate() {
            let real = self.real(*node)?;
            let range = Range::new(-FULL_SCALE, FULL_SCALE);
            let lsb = exp2(-30);
            let kept = self.saturated(real, Scale::plain(lsb), range)?;
            let channel = &mut self.channels[index];
            self.b.effect(Op::Set(channel.cell), &[kept.value])?;
            channel.sample = Some(Real::new(kept.value, lsb, kept.error));
        }
        Ok(())
    }
}
