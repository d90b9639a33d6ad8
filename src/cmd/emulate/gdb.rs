//! A server for gdb's remote protocol: the crate `gdbstub` speaks it, the machine answers.
//!
//! ```text
//!   gdb --TCP, this machine only-- session (run, poll the socket, say why it stopped)
//!                                     |
//!                                  debuggee (registers, memory, breakpoints, watchpoints, a thread per core)
//! ```
//!
//! While gdb reads and types, time stands still. A step is one instruction of one core; to continue
//! lets all cores run.
//!
//! Not here: reverse execution, and files for the program (it prints to the server's own output).

mod debuggee;
mod registers;
mod session;

use std::net::{Ipv4Addr, TcpListener, TcpStream};

use gdbstub::stub::{DisconnectReason, GdbStub};
use whippen_emulator::Register;

use super::image::Image;
use super::run::Task;
use crate::exit::{Failure, Outcome};
use crate::say::tell;
use debuggee::Debuggee;

/// The register that says where a core is.
const PC: Register = Register::PC;

/// Waits for gdb, and serves it until it leaves or the program ends.
pub fn serve(image: Image, task: &Task, port: u16) -> Outcome {
    let stream =
        accept(port).map_err(|e| Failure::Usage(format!("cannot listen on port {port}: {e}")))?;
    let mut debuggee = Debuggee::new(image.machine, image.ports, task.max_cycles);
    let ended = GdbStub::new(stream).run_blocking::<session::Session>(&mut debuggee);
    session::print(&mut debuggee);
    match ended {
        Ok(DisconnectReason::TargetExited(0))
        | Ok(DisconnectReason::Disconnect | DisconnectReason::Kill) => Ok(()),
        Ok(DisconnectReason::TargetExited(code)) => {
            tell!("the program exited with {code}");
            Err(Failure::Program)
        }
        Ok(DisconnectReason::TargetTerminated(signal)) => {
            tell!("the program was ended by {signal}");
            Err(Failure::Program)
        }
        // gdb that is gone without a word is no failure of the program.
        Err(error) if error.is_connection_error() => {
            tell!("gdb has gone away");
            Ok(())
        }
        Err(error) => Err(Failure::Usage(format!(
            "the conversation with gdb broke off: {error}"
        ))),
    }
}

fn accept(port: u16) -> std::io::Result<TcpStream> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
    let port = listener.local_addr()?.port();
    tell!("waiting for gdb; say there: target remote localhost:{port}");
    let (stream, _) = listener.accept()?;
    stream.set_nodelay(true)?;
    Ok(stream)
}
