//! Running between two stops, and saying why it stopped.

use std::io::Write;
use std::net::TcpStream;
use std::time::Duration;

use gdbstub::common::Signal;
use gdbstub::conn::{Connection, ConnectionExt};
use gdbstub::stub::MultiThreadStopReason;
use gdbstub::stub::run_blocking::{BlockingEventLoop, Event, WaitForStopReasonError};
use gdbstub::target::Target;
use gdbstub::target::ext::breakpoints::WatchKind;
use whippen_emulator::{Fault, Reason, Stop};

use super::super::ports;
use super::PC;
use super::debuggee::{Debuggee, Resume, thread};
use crate::say::{self, tell};

/// So many cycles between two looks at the socket.
const SLICE: u64 = 200_000;
/// So many steps of a range between two looks.
const STEPS: usize = 10_000;

type StopReason = MultiThreadStopReason<u32>;

/// The loop that gdbstub wants.
pub enum Session {}

type Failure =
    WaitForStopReasonError<<Debuggee as Target>::Error, <TcpStream as Connection>::Error>;

impl BlockingEventLoop for Session {
    type Target = Debuggee;
    type Connection = TcpStream;
    type StopReason = StopReason;

    fn wait_for_stop_reason(
        debuggee: &mut Debuggee,
        conn: &mut TcpStream,
    ) -> Result<Event<StopReason>, Failure> {
        loop {
            let stop = advance(debuggee);
            print(debuggee);
            if let Some(reason) = stop {
                return Ok(Event::TargetStopped(reason));
            }
            if conn
                .peek()
                .map_err(WaitForStopReasonError::Connection)?
                .is_some()
            {
                let byte = ConnectionExt::read(conn).map_err(WaitForStopReasonError::Connection)?;
                return Ok(Event::IncomingData(byte));
            }
        }
    }

    fn on_interrupt(_: &mut Debuggee) -> Result<Option<StopReason>, &'static str> {
        Ok(Some(MultiThreadStopReason::Signal(Signal::SIGINT)))
    }
}

/// What the program printed goes to the server's output.
pub fn print(debuggee: &mut Debuggee) {
    let machine = &mut debuggee.machine;
    let mut output = std::mem::take(&mut machine.semihosting.output);
    if let Some(ports) = &debuggee.ports {
        output.append(&mut ports::printed(machine, ports));
    }
    let errors = std::mem::take(&mut machine.semihosting.errors);
    if !output.is_empty() {
        say::bytes(&output);
    }
    if !errors.is_empty() {
        let _ = std::io::stderr().lock().write_all(&errors);
    }
}

/// A slice of what was asked for; the reason if it came to a stop.
fn advance(debuggee: &mut Debuggee) -> Option<StopReason> {
    let machine = &mut debuggee.machine;
    let stop = match debuggee.resume {
        Resume::Continue => {
            let until = machine.cycle(0).saturating_add(SLICE).min(debuggee.limit);
            Some(machine.run(until))
        }
        Resume::Step { core, range } => return step(debuggee, core, range),
    };
    stop.and_then(|stop| reason(debuggee, stop))
}

fn step(debuggee: &mut Debuggee, core: usize, range: Option<(u32, u32)>) -> Option<StopReason> {
    let machine = &mut debuggee.machine;
    for _ in 0..STEPS {
        if let Some(stop) = machine.step(core) {
            return reason(debuggee, stop);
        }
        let pc = machine.cpu(core).get(PC);
        let inside = range.is_some_and(|(start, end)| (start..end).contains(&pc));
        if !inside {
            return Some(MultiThreadStopReason::SignalWithThread {
                tid: thread(core),
                signal: Signal::SIGTRAP,
            });
        }
    }
    None
}

/// Why gdb is told that the program stopped; nothing when it goes on.
fn reason(debuggee: &mut Debuggee, stop: Stop) -> Option<StopReason> {
    let signal = |core, signal| {
        Some(MultiThreadStopReason::SignalWithThread {
            tid: thread(core),
            signal,
        })
    };
    match stop {
        Stop::Limit if debuggee.machine.cycle(0) < debuggee.limit => None,
        Stop::Limit => signal(0, Signal::SIGXCPU),
        Stop::Exit { code } => Some(MultiThreadStopReason::Exited(code as u8)),
        Stop::Returned { cycles, result } => {
            tell!(
                "the function returned {:#010x} after {cycles} cycles",
                result[0]
            );
            Some(MultiThreadStopReason::Exited(0))
        }
        Stop::Breakpoint { core, .. } => Some(MultiThreadStopReason::SwBreak(thread(core))),
        Stop::Watchpoint {
            core,
            address,
            write,
            ..
        } => {
            let (address, kind) = watched(debuggee, address, write);
            Some(MultiThreadStopReason::Watch {
                tid: thread(core),
                kind,
                addr: address,
            })
        }
        Stop::Fault(fault) => {
            tell!("{fault}");
            signal(fault.core, signal_of(&fault))
        }
        // Only gdb can end that sleep; it is not worth a whole host core.
        Stop::Asleep => {
            std::thread::sleep(Duration::from_millis(5));
            None
        }
        Stop::Glitch { .. } => {
            tell!("{stop}");
            signal(0, Signal::SIGSYS)
        }
        Stop::Reset => {
            debuggee.machine.reset();
            None
        }
    }
}

/// The address and kind that gdb set, for an access to somewhere inside it.
fn watched(debuggee: &Debuggee, address: u32, write: bool) -> (u32, WatchKind) {
    let covers = |watch: &whippen_emulator::Watch| {
        let kind = if write { watch.writes } else { watch.reads };
        // An access may begin before the range and reach into it.
        kind && address.wrapping_sub(watch.base).wrapping_add(3) < watch.bytes.wrapping_add(3)
    };
    let found = debuggee.watches.iter().find(|(watch, _)| covers(watch));
    found.map_or((address, WatchKind::Write), |(watch, kind)| {
        (watch.base.max(address), *kind)
    })
}

fn signal_of(fault: &Fault) -> Signal {
    match fault.reason {
        Reason::Undefined
        | Reason::Unpredictable(_)
        | Reason::NoCoprocessor
        | Reason::InvalidState => Signal::SIGILL,
        Reason::Unaligned => Signal::SIGBUS,
        Reason::DivideByZero => Signal::SIGFPE,
        _ => Signal::SIGSEGV,
    }
}
