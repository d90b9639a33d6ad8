//! The line to a board: a serial port, TCP, or a debugger.

use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::ValueHint;
use whippen_isa::Arch;
use whippen_runtime::monitor::openocd::OpenOcd;
use whippen_runtime::monitor::{BoardWrite, Link};

use crate::exit::Failure;

/// Where the board is.
#[derive(Debug, clap::Args)]
#[group(required = true, multiple = false)]
pub struct PortArgs {
    /// The serial port at which the board is, such as /dev/ttyUSB0
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    port: Option<PathBuf>,
    /// A serial port behind TCP, such as that of `whippen emulate --uart`
    #[arg(long, value_name = "HOST:PORT")]
    tcp: Option<String>,
    /// OpenOCD's Tcl port, usually localhost:6666: the status only, of any image of `build`
    #[arg(long, value_name = "HOST:PORT")]
    openocd: Option<String>,
    /// A debug probe, the only one or that of these USB numbers: the status only, of any image of
    /// `build`; for a whippen that was built with `--features probe`
    #[arg(long, value_name = "VID:PID[:SERIAL]", num_args = 0..=1, require_equals = true, default_missing_value = "")]
    probe: Option<String>,
}

/// How long a connection may take.
const CONNECTING: Duration = Duration::from_secs(5);

impl PortArgs {
    /// The line, at so many bits per second.
    pub fn open(&self, baud: u32) -> Result<Line, Failure> {
        match (&self.port, &self.tcp) {
            (Some(path), _) => serial(path, baud),
            (None, Some(at)) => connect("--tcp", at).map(Line::Tcp),
            (None, None) => Err(Failure::Usage(format!(
                "{} wants the image, an .elf, in place of the program's files",
                self.debugger().unwrap_or_default()
            ))),
        }
    }

    /// The option by which a debugger was asked for, in place of the board's serial port.
    pub fn debugger(&self) -> Option<&'static str> {
        let openocd = self.openocd.as_ref().map(|_| "--openocd");
        openocd.or(self.probe.as_ref().map(|_| "--probe"))
    }

    /// What a debugger reads and writes of a board whose core is of this architecture; none where
    /// the board's serial port was asked for. An answer of OpenOCD may take so long.
    pub fn debugged(
        &self,
        arch: Option<Arch>,
        patience: Duration,
    ) -> Result<Option<Box<dyn BoardWrite>>, Failure> {
        if let Some(name) = &self.probe {
            return probed(name, arch).map(Some);
        }
        let Some(address) = &self.openocd else {
            return Ok(None);
        };
        let stream = connect("--openocd", address)?;
        let set = stream.set_read_timeout(Some(patience));
        set.map_err(|e| Failure::Usage(format!("--openocd {address}: {e}")))?;
        Ok(Some(Box::new(OpenOcd::new(stream))))
    }
}

/// The board at a debug probe.
#[cfg(feature = "probe")]
fn probed(name: &str, arch: Option<Arch>) -> Result<Box<dyn BoardWrite>, Failure> {
    Ok(Box::new(super::probe::ProbeMemory::open(name, arch)?))
}

#[cfg(not(feature = "probe"))]
fn probed(_: &str, _: Option<Arch>) -> Result<Box<dyn BoardWrite>, Failure> {
    Err(Failure::Usage(
        "--probe: this whippen was built without debug probes; `cargo build --release --features \
         probe` makes one that has them"
            .to_string(),
    ))
}

/// A connection to what an option names.
pub fn connect(option: &str, at: &str) -> Result<TcpStream, Failure> {
    use std::net::ToSocketAddrs;
    let cannot = |why: String| Failure::Usage(format!("{option} {at}: {why}"));
    let mut all = at.to_socket_addrs().map_err(|e| cannot(e.to_string()))?;
    let address = all
        .next()
        .ok_or_else(|| cannot("there is no such host".to_string()))?;
    let stream = TcpStream::connect_timeout(&address, CONNECTING);
    let stream = stream.map_err(|e| cannot(e.to_string()))?;
    stream
        .set_nodelay(true)
        .map_err(|e| cannot(e.to_string()))?;
    Ok(stream)
}

/// An open line.
pub enum Line {
    /// A serial port.
    #[cfg(unix)]
    Serial(std::fs::File),
    /// TCP.
    Tcp(TcpStream),
}

impl Link for Line {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        match self {
            #[cfg(unix)]
            Line::Serial(file) => file.write_all(bytes),
            Line::Tcp(stream) => stream.write_all(bytes),
        }
    }

    fn receive(&mut self, patience: Duration) -> io::Result<Vec<u8>> {
        let mut bytes = [0; 4096];
        let read = match self {
            // It waits for a tenth of a second at most.
            #[cfg(unix)]
            Line::Serial(file) => file.read(&mut bytes),
            Line::Tcp(stream) => {
                stream.set_read_timeout(Some(patience.max(Duration::from_millis(1))))?;
                match stream.read(&mut bytes) {
                    Ok(0) => Err(io::Error::new(
                        ErrorKind::UnexpectedEof,
                        "the other end has closed it",
                    )),
                    other => other,
                }
            }
        };
        match read {
            Ok(count) => Ok(bytes[..count].to_vec()),
            Err(error) => match error.kind() {
                ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted => {
                    Ok(Vec::new())
                }
                _ => Err(error),
            },
        }
    }
}

#[cfg(unix)]
fn serial(path: &Path, baud: u32) -> Result<Line, Failure> {
    use rustix::fs::{Mode, OFlags};
    use rustix::termios::{
        ControlModes, OptionalActions, QueueSelector, SpecialCodeIndex, isatty, tcflush, tcgetattr,
        tcsetattr,
    };
    let cannot = |why: String| Failure::Usage(format!("--port `{}`: {why}", path.display()));
    let failed = |e: rustix::io::Errno| cannot(io::Error::from(e).to_string());
    // A port without a carrier opens at once, and is no terminal of this command.
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
    let port = rustix::fs::open(path, flags, Mode::empty()).map_err(failed)?;
    if !isatty(&port) {
        return Err(cannot("is no serial port".to_string()));
    }
    let mut settings = tcgetattr(&port).map_err(failed)?;
    settings.make_raw();
    settings.control_modes |= ControlModes::CLOCAL | ControlModes::CREAD;
    settings.control_modes &= !(ControlModes::CRTSCTS | ControlModes::CSTOPB);
    settings.special_codes[SpecialCodeIndex::VMIN] = 0;
    settings.special_codes[SpecialCodeIndex::VTIME] = 1;
    let speed = settings.set_speed(baud);
    let set = speed.and_then(|()| tcsetattr(&port, OptionalActions::Now, &settings));
    set.map_err(|e| cannot(format!("{baud} baud: {}", io::Error::from(e))))?;
    let flags = rustix::fs::fcntl_getfl(&port).map_err(failed)?;
    rustix::fs::fcntl_setfl(&port, flags - OFlags::NONBLOCK).map_err(failed)?;
    tcflush(&port, QueueSelector::IOFlush).map_err(failed)?;
    Ok(Line::Serial(port.into()))
}

#[cfg(not(unix))]
fn serial(path: &Path, _: u32) -> Result<Line, Failure> {
    let path = path.display();
    Err(Failure::Usage(format!(
        "--port `{path}`: serial ports are opened on Unix alone; --tcp reaches one elsewhere"
    )))
}
