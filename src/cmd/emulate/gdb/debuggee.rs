//! The machine as gdb sees it.

use gdbstub::common::{Signal, Tid};
use gdbstub::outputln;
use gdbstub::target::ext::base::BaseOps;
use gdbstub::target::ext::base::multithread::{
    MultiThreadBase, MultiThreadRangeStepping, MultiThreadRangeSteppingOps, MultiThreadResume,
    MultiThreadResumeOps, MultiThreadSchedulerLocking, MultiThreadSchedulerLockingOps,
    MultiThreadSingleStep, MultiThreadSingleStepOps,
};
use gdbstub::target::ext::breakpoints::{
    Breakpoints, BreakpointsOps, HwBreakpoint, HwBreakpointOps, HwWatchpoint, HwWatchpointOps,
    SwBreakpoint, SwBreakpointOps, WatchKind,
};
use gdbstub::target::ext::monitor_cmd::{ConsoleOutput, MonitorCmd, MonitorCmdOps};
use gdbstub::target::ext::target_description_xml_override::{
    TargetDescriptionXmlOverride, TargetDescriptionXmlOverrideOps,
};
use gdbstub::target::ext::thread_extra_info::{ThreadExtraInfo, ThreadExtraInfoOps};
use gdbstub::target::{Target, TargetError, TargetResult};
use whippen_emulator::{Activity, Machine, Ports, Watch};

use super::registers::{CortexM, Words, description};

/// What gdb asked for last.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Resume {
    /// All cores run.
    Continue,
    /// One core makes a step, and more while it stays in a range of addresses.
    Step {
        /// Which.
        core: usize,
        /// First address, and the one behind the last.
        range: Option<(u32, u32)>,
    },
}

/// A machine under gdb.
pub struct Debuggee {
    /// The machine.
    pub machine: Machine,
    /// Its devices that speak.
    pub ports: Option<Ports>,
    /// What it is to do.
    pub resume: Resume,
    /// The cycle it stops at, if any.
    pub limit: u64,
    /// What watchpoints are for, so that stops can say which kind they were.
    pub watches: Vec<(Watch, WatchKind)>,
}

impl Debuggee {
    /// With nothing asked for yet.
    pub fn new(machine: Machine, ports: Option<Ports>, max_cycles: Option<u64>) -> Self {
        let limit = max_cycles.map_or(u64::MAX, |max| machine.cycle(0).saturating_add(max));
        Self {
            machine,
            ports,
            resume: Resume::Continue,
            limit,
            watches: Vec::new(),
        }
    }

    fn core(&self, tid: Tid) -> usize {
        (tid.get() - 1).min(self.machine.cores() - 1)
    }
}

/// gdb counts threads from 1.
pub fn thread(core: usize) -> Tid {
    Tid::new(core + 1).unwrap_or(Tid::MIN)
}

impl Target for Debuggee {
    type Arch = CortexM;
    type Error = &'static str;

    fn base_ops(&mut self) -> BaseOps<'_, CortexM, Self::Error> {
        BaseOps::MultiThread(self)
    }

    fn support_breakpoints(&mut self) -> Option<BreakpointsOps<'_, Self>> {
        Some(self)
    }

    fn support_monitor_cmd(&mut self) -> Option<MonitorCmdOps<'_, Self>> {
        Some(self)
    }

    fn support_target_description_xml_override(
        &mut self,
    ) -> Option<TargetDescriptionXmlOverrideOps<'_, Self>> {
        Some(self)
    }

    // Stepping is the emulator's, so gdb need not place breakpoints of its own to step.
    fn guard_rail_implicit_sw_breakpoints(&self) -> bool {
        true
    }
}

impl TargetDescriptionXmlOverride for Debuggee {
    fn target_description_xml(
        &self,
        _: &[u8],
        offset: u64,
        length: usize,
        buf: &mut [u8],
    ) -> TargetResult<usize, Self> {
        let xml = description(self.machine.board().core);
        let from = xml.len().min(usize::try_from(offset).unwrap_or(usize::MAX));
        let part = &xml.as_bytes()[from..];
        Ok(copy(&part[..part.len().min(length)], buf))
    }
}

/// Copies as much as there is room for.
fn copy(from: &[u8], to: &mut [u8]) -> usize {
    let length = from.len().min(to.len());
    to[..length].copy_from_slice(&from[..length]);
    length
}

impl MultiThreadBase for Debuggee {
    fn read_registers(&mut self, words: &mut Words, tid: Tid) -> TargetResult<(), Self> {
        *words = Words::of(self.machine.cpu(self.core(tid)));
        Ok(())
    }

    fn write_registers(&mut self, words: &Words, tid: Tid) -> TargetResult<(), Self> {
        let core = self.core(tid);
        words.write(self.machine.cpu_mut(core));
        Ok(())
    }

    fn read_addrs(&mut self, address: u32, data: &mut [u8], _: Tid) -> TargetResult<usize, Self> {
        if self.machine.bus.memory.read(address, data).is_ok() {
            return Ok(data.len());
        }
        // A register of a device, as `x/wx` asks for it.
        let cycle = self.machine.cycle(0);
        match (
            u32::try_from(data.len()),
            self.machine.bus.memory.region(address),
        ) {
            (Ok(size @ (1 | 2 | 4)), None) if address.is_multiple_of(size) => {
                let value = self
                    .machine
                    .bus
                    .read(address, size, cycle)
                    .map_err(|_| TargetError::NonFatal)?;
                Ok(copy(&value.to_le_bytes()[..data.len()], data))
            }
            // Memory that ends here: as much as there is.
            (_, Some(_)) => Ok((0..data.len())
                .take_while(|i| self.read_byte(address, *i, data))
                .count()),
            _ => Err(TargetError::NonFatal),
        }
    }

    fn write_addrs(&mut self, address: u32, data: &[u8], _: Tid) -> TargetResult<(), Self> {
        if self.machine.bus.memory.write(address, data).is_ok() {
            return Ok(());
        }
        let cycle = self.machine.cycle(0);
        match (
            u32::try_from(data.len()),
            self.machine.bus.memory.region(address),
        ) {
            (Ok(size @ (1 | 2 | 4)), None) if address.is_multiple_of(size) => {
                let value = data
                    .iter()
                    .rev()
                    .fold(0, |value, byte| value << 8 | u32::from(*byte));
                self.machine
                    .bus
                    .write(address, size, value, cycle)
                    .map_err(|_| TargetError::NonFatal)
            }
            _ => Err(TargetError::NonFatal),
        }
    }

    fn list_active_threads(&mut self, register: &mut dyn FnMut(Tid)) -> Result<(), Self::Error> {
        (0..self.machine.cores()).for_each(|core| register(thread(core)));
        Ok(())
    }

    fn support_resume(&mut self) -> Option<MultiThreadResumeOps<'_, Self>> {
        Some(self)
    }

    fn support_thread_extra_info(&mut self) -> Option<ThreadExtraInfoOps<'_, Self>> {
        Some(self)
    }
}

impl Debuggee {
    fn read_byte(&self, address: u32, at: usize, data: &mut [u8]) -> bool {
        let place = address.checked_add(at as u32);
        place.is_some_and(|place| {
            self.machine
                .bus
                .memory
                .read(place, &mut data[at..=at])
                .is_ok()
        })
    }
}

impl ThreadExtraInfo for Debuggee {
    fn thread_extra_info(&self, tid: Tid, buf: &mut [u8]) -> Result<usize, Self::Error> {
        let core = self.core(tid);
        let state = match self.machine.cpu(core).activity() {
            Activity::Running => "running",
            Activity::WaitingForInterrupt => "WFI",
            Activity::WaitingForEvent => "WFE",
            Activity::Halted => "not started",
        };
        let text = format!("core {core}, {state}, cycle {}", self.machine.cycle(core));
        Ok(copy(text.as_bytes(), buf))
    }
}

impl MultiThreadResume for Debuggee {
    fn resume(&mut self) -> Result<(), Self::Error> {
        Ok(())
    }

    fn clear_resume_actions(&mut self) -> Result<(), Self::Error> {
        self.resume = Resume::Continue;
        Ok(())
    }

    // All cores continue together, whichever is named.
    fn set_resume_action_continue(&mut self, _: Tid, _: Option<Signal>) -> Result<(), Self::Error> {
        Ok(())
    }

    fn support_single_step(&mut self) -> Option<MultiThreadSingleStepOps<'_, Self>> {
        Some(self)
    }

    fn support_range_step(&mut self) -> Option<MultiThreadRangeSteppingOps<'_, Self>> {
        Some(self)
    }

    fn support_scheduler_locking(&mut self) -> Option<MultiThreadSchedulerLockingOps<'_, Self>> {
        Some(self)
    }
}

impl MultiThreadSingleStep for Debuggee {
    fn set_resume_action_step(&mut self, tid: Tid, _: Option<Signal>) -> Result<(), Self::Error> {
        self.resume = Resume::Step {
            core: self.core(tid),
            range: None,
        };
        Ok(())
    }
}

impl MultiThreadRangeStepping for Debuggee {
    fn set_resume_action_range_step(
        &mut self,
        tid: Tid,
        start: u32,
        end: u32,
    ) -> Result<(), Self::Error> {
        self.resume = Resume::Step {
            core: self.core(tid),
            range: Some((start, end)),
        };
        Ok(())
    }
}

impl MultiThreadSchedulerLocking for Debuggee {
    // A step moves one core only, so the others are locked anyway.
    fn set_resume_action_scheduler_lock(&mut self) -> Result<(), Self::Error> {
        Ok(())
    }
}

impl Breakpoints for Debuggee {
    fn support_sw_breakpoint(&mut self) -> Option<SwBreakpointOps<'_, Self>> {
        Some(self)
    }

    fn support_hw_breakpoint(&mut self) -> Option<HwBreakpointOps<'_, Self>> {
        Some(self)
    }

    fn support_hw_watchpoint(&mut self) -> Option<HwWatchpointOps<'_, Self>> {
        Some(self)
    }
}

impl SwBreakpoint for Debuggee {
    fn add_sw_breakpoint(&mut self, address: u32, _: usize) -> TargetResult<bool, Self> {
        self.machine.set_breakpoint(address);
        Ok(true)
    }

    fn remove_sw_breakpoint(&mut self, address: u32, _: usize) -> TargetResult<bool, Self> {
        self.machine.clear_breakpoint(address);
        Ok(true)
    }
}

impl HwBreakpoint for Debuggee {
    fn add_hw_breakpoint(&mut self, address: u32, kind: usize) -> TargetResult<bool, Self> {
        self.add_sw_breakpoint(address, kind)
    }

    fn remove_hw_breakpoint(&mut self, address: u32, kind: usize) -> TargetResult<bool, Self> {
        self.remove_sw_breakpoint(address, kind)
    }
}

fn watch(base: u32, bytes: u32, kind: WatchKind) -> Watch {
    Watch {
        base,
        bytes,
        reads: kind != WatchKind::Write,
        writes: kind != WatchKind::Read,
    }
}

impl HwWatchpoint for Debuggee {
    fn add_hw_watchpoint(
        &mut self,
        base: u32,
        bytes: u32,
        kind: WatchKind,
    ) -> TargetResult<bool, Self> {
        let watch = watch(base, bytes, kind);
        self.machine.set_watch(watch);
        self.watches.push((watch, kind));
        Ok(true)
    }

    fn remove_hw_watchpoint(
        &mut self,
        base: u32,
        bytes: u32,
        kind: WatchKind,
    ) -> TargetResult<bool, Self> {
        let watch = watch(base, bytes, kind);
        self.machine.clear_watch(watch);
        self.watches.retain(|(w, k)| (*w, *k) != (watch, kind));
        Ok(true)
    }
}

impl MonitorCmd for Debuggee {
    fn handle_monitor_cmd(
        &mut self,
        command: &[u8],
        mut out: ConsoleOutput<'_>,
    ) -> Result<(), Self::Error> {
        match command.trim_ascii() {
            b"reset" | b"reset halt" | b"reset init" => {
                self.machine.reset();
                outputln!(
                    out,
                    "reset; the program counter is {:#010x}",
                    self.machine.cpu(0).get(super::PC)
                );
            }
            b"cycles" => {
                for core in 0..self.machine.cores() {
                    outputln!(out, "core {core}: {} cycles", self.machine.cycle(core));
                }
            }
            _ => outputln!(
                out,
                "monitor cycles: cycles so far\nmonitor reset: start from the vector table again"
            ),
        }
        Ok(())
    }
}
