//! `--uart`: the other end of the first serial port, as TCP on this machine or as a
//! pseudo-terminal.
//!
//! The board waits for the first connection, and its run ends when that is closed. Meanwhile time
//! goes as fast as the emulator does.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{Ipv4Addr, TcpListener};
use std::str::FromStr;
#[cfg(unix)]
use std::time::Duration;

use whippen_emulator::{Converter, Machine, Ports, Uart};

use crate::exit::Failure;
use crate::say::tell;

/// Bytes that arrive in one slice of the run, in which they have room in the port: a client that
/// waits between its bytes waits for its own time, which is not the board's.
const PART: usize = 16;

/// What is at the other end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UartDoor {
    /// A TCP port of this machine; 0 is a free one.
    Tcp(u16),
    /// A pseudo-terminal.
    Terminal,
}

impl FromStr for UartDoor {
    type Err = String;

    fn from_str(text: &str) -> Result<UartDoor, String> {
        match text {
            "pty" => Ok(UartDoor::Terminal),
            other => other.parse().map(UartDoor::Tcp).map_err(|_| {
                "wanted is a TCP port, such as 4444 (0 for a free one), or `pty`".to_string()
            }),
        }
    }
}

/// A stream that does not wait.
trait Stream: Read + Write {}
impl<T: Read + Write> Stream for T {}

/// An open door.
pub struct OpenDoor {
    stream: Box<dyn Stream>,
    /// What the other end has not taken yet.
    left: Vec<u8>,
    /// Sensor words, which begin again at their end.
    repeated: Vec<u16>,
    /// Whether the other end has gone.
    pub is_closed: bool,
}

impl UartDoor {
    /// Waits for somebody.
    pub fn open(self) -> Result<OpenDoor, Failure> {
        let cannot = |e: io::Error| Failure::Usage(format!("--uart: {e}"));
        let stream: Box<dyn Stream> = match self {
            UartDoor::Tcp(port) => {
                let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(cannot)?;
                let port = listener.local_addr().map_err(cannot)?.port();
                tell!("waiting at the serial port: whippen monitor --tcp localhost:{port}");
                let (stream, _) = listener.accept().map_err(cannot)?;
                stream.set_nodelay(true).map_err(cannot)?;
                stream.set_nonblocking(true).map_err(cannot)?;
                Box::new(stream)
            }
            UartDoor::Terminal => terminal().map_err(cannot)?,
        };
        Ok(OpenDoor {
            stream,
            left: Vec::new(),
            repeated: Vec::new(),
            is_closed: false,
        })
    }
}

#[cfg(unix)]
fn terminal() -> io::Result<Box<dyn Stream>> {
    use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
    use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
    let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
    let own = openpt(flags)?;
    grantpt(&own)?;
    unlockpt(&own)?;
    // What arrives before anybody has set it is bytes, too.
    let mut settings = tcgetattr(&own)?;
    settings.make_raw();
    tcsetattr(&own, OptionalActions::Now, &settings)?;
    let name = ptsname(&own, Vec::new())?;
    let name = name.to_string_lossy().into_owned();
    tell!("waiting at the serial port: whippen monitor --port {name}");
    let status = rustix::fs::fcntl_getfl(&own)?;
    rustix::fs::fcntl_setfl(&own, status | rustix::fs::OFlags::NONBLOCK)?;
    let file = std::fs::File::from(own);
    // Nobody can tell that it was opened, only that something arrives.
    while !has_bytes(&file) {
        std::thread::sleep(Duration::from_millis(5));
    }
    Ok(Box::new(file))
}

/// Whether there is something to read.
#[cfg(unix)]
fn has_bytes(file: &std::fs::File) -> bool {
    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    let mut polled = [PollFd::new(file, PollFlags::IN)];
    let now = Timespec {
        tv_sec: 0,
        tv_nsec: 0,
    };
    poll(&mut polled, Some(&now)).is_ok() && polled[0].revents().contains(PollFlags::IN)
}

#[cfg(not(unix))]
fn terminal() -> io::Result<Box<dyn Stream>> {
    Err(io::Error::new(
        ErrorKind::Unsupported,
        "there are pseudo-terminals on Unix alone: give it a TCP port",
    ))
}

impl OpenDoor {
    /// Passes bytes both ways; sensor words that are over begin again.
    pub fn pass(&mut self, machine: &mut Machine, ports: &Ports) {
        self.pass_bytes(machine, ports);
        let Some(converter) = machine.bus.device_mut::<Converter>(ports.converter) else {
            return;
        };
        if self.repeated.is_empty() {
            self.repeated.extend(&converter.samples);
        }
        if converter.samples.len() < self.repeated.len() {
            converter.samples.extend(&self.repeated);
        }
    }

    fn pass_bytes(&mut self, machine: &mut Machine, ports: &Ports) {
        let (port, cycle) = (ports.uarts[0], machine.cycle(0));
        let mut bytes = [0; PART];
        match self.stream.read(&mut bytes) {
            Ok(0) => self.is_closed = true,
            Ok(count) => {
                if let Some(uart) = machine.bus.device_mut::<Uart>(port) {
                    uart.receive(&bytes[..count], cycle);
                }
                machine.bus.reschedule(port);
            }
            Err(error) if error.kind() == ErrorKind::WouldBlock => {}
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            // A pseudo-terminal that nobody has any more says so.
            Err(_) => self.is_closed = true,
        }
        if let Some(uart) = machine.bus.device_mut::<Uart>(port) {
            self.left.append(&mut uart.output);
        }
        while !self.left.is_empty() && !self.is_closed {
            match self.stream.write(&self.left) {
                Ok(count) => drop(self.left.drain(..count)),
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(_) => self.is_closed = true,
            }
        }
    }
}
