//! DMA: channels that copy, chained and paced (RP2350 datasheet 12.6, RP2040 datasheet 2.5). A
//! transfer begins in the cycle after the one before is over, the channels in turn, those of high
//! priority first. It takes a cycle, those that its accesses wait for others (`fabric`), and those
//! that a bridge takes beyond one. What it moves is there in its first cycle already.
//!
//! Not here: the checksum of passing data, and a next read while a write waits.

use crate::bus::{Access, Bus, BusError, Device, DeviceId, Notices, Waits};
use crate::device::adc::Adc;
use crate::device::alias;
use crate::device::pio::Pio;
use crate::device::uart::Uart;

mod channel;

use channel::{Bits, Channel};

/// In what the two chips differ.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layout {
    pub channels: usize,
    /// How many interrupts, and the number of the first.
    pub interrupts: usize,
    pub first_interrupt: usize,
    /// Where the pacing timers lie; what follows them follows at the same distance on both chips.
    pub timers: u32,
    /// The request of the first serial port's transmitter; its receiver and the second port follow.
    pub uart_request: u32,
    /// The request of PWM's first slice, and how many there are: pulses, which channels count.
    pub pulses: (u32, u32),
    pub adc_request: u32,
    pub bits: Bits,
}

/// RP2350: 16 channels.
pub(crate) const RP2350: Layout = Layout {
    channels: 16,
    interrupts: 4,
    first_interrupt: 10,
    timers: 0x440,
    uart_request: 28,
    pulses: (32, 12),
    adc_request: 48,
    bits: channel::RP2350,
};

/// RP2040: 12 channels.
pub(crate) const RP2040: Layout = Layout {
    channels: 12,
    interrupts: 2,
    first_interrupt: 11,
    timers: 0x420,
    uart_request: 20,
    pulses: (24, 8),
    adc_request: 36,
    bits: channel::RP2040,
};

/// Requests that are no device's: the first pacing timer, and always.
const TIMER_REQUEST: u32 = 0x3b;
const ALWAYS: u32 = 0x3f;
/// What a channel's counter of requests holds at most.
const CREDITS_MAX: u32 = 63;
/// How often a device that does not request is asked again, in cycles.
const POLL: u64 = 64;

/// Who requests transfers.
pub(crate) struct Requesters {
    pub uarts: [DeviceId; 2],
    /// Blocks of state machines, each with eight requests, from 0 on.
    pub pios: Vec<DeviceId>,
    pub adc: DeviceId,
}

/// See the module.
pub(crate) struct Dma {
    layout: Layout,
    requesters: Requesters,
    channels: Vec<Channel>,
    raised: u32,
    enabled: [u32; 4],
    forced: [u32; 4],
    /// X / Y transfers a cycle, and the accumulated fraction.
    timers: [u32; 4],
    /// The cycle in which it looks for the next transfer, if nobody tells it of a request.
    next: u64,
    /// The cycle after the last transfer.
    free: u64,
    /// The channel that was served last.
    last: usize,
}

impl Dma {
    pub(crate) fn new(layout: Layout, requesters: Requesters) -> Self {
        let channels = (0..layout.channels)
            .map(|i| Channel::new(layout.bits, i))
            .collect();
        let (enabled, forced, timers) = ([0; 4], [0; 4], [0; 4]);
        Self {
            layout,
            requesters,
            channels,
            raised: 0,
            enabled,
            forced,
            timers,
            next: 0,
            free: 0,
            last: 0,
        }
    }

    /// Puts it on the bus, where it hears of requests.
    pub(crate) fn attach(bus: &mut Bus, base: u32, dma: Self) -> DeviceId {
        let id = bus.attach(base, alias::BLOCK, Waits::default(), Box::new(dma));
        let watches = Notices {
            pins: false,
            requests: true,
        };
        bus.watch(id, watches);
        id
    }

    fn active(&self, index: usize) -> u32 {
        self.raised & self.enabled[index] | self.forced[index]
    }

    fn interrupts(&self, bus: &mut Bus) {
        bus.fabric.dma = self.busy();
        for index in 0..self.layout.interrupts {
            bus.lines
                .set_all(self.layout.first_interrupt + index, self.active(index) != 0);
        }
    }

    fn busy(&self) -> bool {
        self.channels.iter().any(|c| c.busy)
    }

    /// Whether a channel may make a transfer in a cycle.
    fn requested(&self, channel: &Channel, cycle: u64, bus: &Bus) -> bool {
        let request = channel.request();
        let first = self.layout.uart_request;
        if request == ALWAYS {
            true
        } else if self.is_pulse(request) {
            channel.credits > 0
        } else if (TIMER_REQUEST..ALWAYS).contains(&request) {
            channel.paced_from <= cycle
        } else if (first..first + 4).contains(&request) {
            let from = request - first;
            let uart = bus.device::<Uart>(self.requesters.uarts[from as usize / 2]);
            uart.is_some_and(|u| {
                if from.is_multiple_of(2) {
                    u.requests().0
                } else {
                    u.requests().1
                }
            })
        } else if request == self.layout.adc_request {
            let adc = bus.device::<Adc>(self.requesters.adc);
            adc.is_some_and(Adc::requests)
        } else {
            let pio = self.requesters.pios.get(request as usize / 8);
            pio.and_then(|id| bus.device::<Pio>(*id))
                .is_some_and(|pio| pio.requests(request % 8))
        }
    }

    /// Whether a request comes in pulses, each for one transfer.
    fn is_pulse(&self, request: u32) -> bool {
        request.wrapping_sub(self.layout.pulses.0) < self.layout.pulses.1
    }

    /// Channels at work count the pulses that are for them.
    fn count_pulses(&mut self, cycle: u64, bus: &mut Bus) {
        let pulses = bus.take_request_pulses(cycle);
        for channel in self.channels.iter_mut().filter(|channel| channel.busy) {
            if pulses >> channel.request() & 1 != 0 {
                channel.credits = (channel.credits + 1).min(CREDITS_MAX);
            }
        }
    }

    /// The channel whose turn it is.
    fn choose(&self, cycle: u64, bus: &Bus) -> Option<usize> {
        let count = self.channels.len();
        let turns = (1..=count).map(|i| (self.last + i) % count);
        let ready = |i: &usize| {
            let channel = &self.channels[*i];
            channel.busy && channel.is_enabled() && self.requested(channel, cycle, bus)
        };
        turns
            .filter(ready)
            .min_by_key(|i| !self.channels[*i].high_priority())
    }

    /// Makes the transfers that are due. The clock moves on by one cycle for each, or to when one
    /// may be ready.
    fn advance(&mut self, cycle: u64, bus: &mut Bus) {
        while self.busy() && self.next <= cycle {
            match self.choose(self.next, bus) {
                Some(index) => self.transfer(index, bus),
                None => self.next = self.next_request(),
            }
        }
    }

    /// When to look again: pacing timers are known, serial ports are asked, the others tell.
    fn next_request(&self) -> u64 {
        let uarts = self.layout.uart_request..self.layout.uart_request + 4;
        let look = |channel: &Channel| match channel.request() {
            TIMER_REQUEST..ALWAYS => channel.paced_from.max(self.next + 1),
            request if uarts.contains(&request) => self.next + POLL,
            _ => u64::MAX,
        };
        let busy = self.channels.iter().filter(|channel| channel.busy);
        busy.map(look).min().unwrap_or(u64::MAX)
    }

    fn transfer(&mut self, index: usize, bus: &mut Bus) {
        let now = self.next;
        bus.fabric.take_dma_cycles();
        let ended = self.channels[index].transfer(now, bus);
        let credits = &mut self.channels[index].credits;
        *credits = credits.saturating_sub(1);
        self.last = index;
        self.next = now + 1 + bus.fabric.take_dma_cycles();
        self.free = self.next;
        self.pace(index, now);
        if ended {
            self.ended(index);
        }
    }

    /// When a channel's pacing timer lets it go on.
    fn pace(&mut self, index: usize, now: u64) {
        let channel = &mut self.channels[index];
        if let Some(timer) = channel
            .request()
            .checked_sub(TIMER_REQUEST)
            .filter(|t| *t < 4)
        {
            let (x, y) = (
                self.timers[timer as usize] >> 16,
                self.timers[timer as usize] & 0xffff,
            );
            channel.paced_from = if x == 0 {
                u64::MAX
            } else {
                now + u64::from(y.div_ceil(x)).max(1)
            };
        }
    }

    fn ended(&mut self, index: usize) {
        if !self.channels[index].quiet() {
            self.raised |= 1 << index;
        }
        let next = self.channels[index].chain_to();
        if next != index {
            self.trigger(next);
        }
    }

    fn trigger(&mut self, index: usize) {
        if let Some(channel) = self.channels.get_mut(index) {
            channel.start();
        }
    }

    fn channel_write(&mut self, at: u32, access: Access, value: u32) -> Result<(), BusError> {
        let (index, place) = ((at / 0x40) as usize, at % 0x40 / 4);
        let channel = self.channels.get_mut(index).ok_or(BusError)?;
        channel.write(place, alias::written(access, value, channel.read(place)));
        // The last of each group of four starts the channel, unless it is written with 0.
        if place % 4 == 3 {
            if channel.read(place) != 0 {
                self.trigger(index);
            } else if channel.quiet() {
                self.raised |= 1 << index;
            }
        }
        Ok(())
    }

    fn word(&self, at: u32) -> Option<u32> {
        let group = (at.wrapping_sub(0x400) / 0x10) as usize;
        let timers = self.layout.timers;
        Some(match at {
            0..0x400 => self.channels.get(at as usize / 0x40)?.read(at % 0x40 / 4),
            _ if (0x400..timers).contains(&at) && group < self.layout.interrupts => match at % 0x10
            {
                0 => self.raised,
                4 => self.enabled[group],
                8 => self.forced[group],
                _ => self.active(group),
            },
            _ if (timers..timers + 0x10).contains(&at) => self.timers[(at - timers) as usize / 4],
            _ if [0x10, 0x20, 0x24].contains(&at.wrapping_sub(timers)) => 0,
            _ if at == timers + 0x28 => self.channels.len() as u32,
            _ => return None,
        })
    }

    fn control_write(&mut self, at: u32, value: u32) -> Option<()> {
        let group = (at.wrapping_sub(0x400) / 0x10) as usize;
        let timers = self.layout.timers;
        let all = (1 << self.channels.len()) - 1;
        match at {
            _ if (0x400..timers).contains(&at) && group < self.layout.interrupts => match at % 0x10
            {
                4 => self.enabled[group] = value & all,
                8 => self.forced[group] = value & all,
                _ => self.raised &= !value,
            },
            _ if (timers..timers + 0x10).contains(&at) => {
                self.timers[(at - timers) as usize / 4] = value
            }
            _ if at == timers + 0x10 => {
                (0..self.channels.len())
                    .filter(|i| value >> i & 1 != 0)
                    .for_each(|i| self.trigger(i));
            }
            _ if at == timers + 0x24 => {
                let aborted = |i: &usize| value >> i & 1 != 0;
                (0..self.channels.len())
                    .filter(aborted)
                    .for_each(|i| self.channels[i].busy = false);
            }
            _ => return None,
        }
        Some(())
    }

    /// What a write to one of the copies changes; where a write is an action, zero.
    fn held(&self, at: u32) -> u32 {
        let held = at >= self.layout.timers || at % 0x10 == 4 || at % 0x10 == 8;
        if held { self.word(at).unwrap_or(0) } else { 0 }
    }
}

impl Device for Dma {
    fn read(&mut self, access: Access, bus: &mut Bus) -> Result<u32, BusError> {
        self.advance(access.cycle, bus);
        let word = self
            .word(alias::plain(access.offset) & !3)
            .ok_or(BusError)?;
        Ok(alias::part(access.offset, word))
    }

    fn write(&mut self, access: Access, value: u32, bus: &mut Bus) -> Result<(), BusError> {
        self.advance(access.cycle, bus);
        let at = alias::plain(access.offset) & !3;
        let idle = !self.busy();
        if at < 0x400 {
            self.channel_write(at, access, value)?;
        } else {
            self.control_write(at, alias::written(access, value, self.held(at)))
                .ok_or(BusError)?;
        }
        // What it writes may start a channel.
        self.free = self.free.max(access.cycle + 1);
        self.next = if idle {
            self.free
        } else {
            self.next.min(self.free)
        };
        self.interrupts(bus);
        Ok(())
    }

    fn due(&self) -> u64 {
        if self.busy() { self.next } else { u64::MAX }
    }

    fn attend(&mut self, cycle: u64, bus: &mut Bus) {
        // A request may have come before the cycle that was set without it.
        self.next = self.next.min(cycle.max(self.free));
        self.count_pulses(cycle, bus);
        self.advance(cycle, bus);
        self.interrupts(bus);
    }
}

#[cfg(test)]
mod judged;
#[cfg(test)]
mod tests;
