//! The memory of a board over a debug probe, by the crate `probe-rs`.
//!
//! ```text
//!   probe --SWD--> debug port --> memory port of core 0 --> flash, RAM
//! ```
//!
//! What `probe-rs` calls a session enables debugging in each core and halts cores meanwhile. Here
//! the probe is used below it: registers of the debug port and of one memory port are all that is
//! accessed, and no address from [`MEMORY_END`] on, where a core's debug registers are. So no core
//! can be halted.

use std::error::Error;

use probe_rs::architecture::arm::dp::{DPIDR, DpAccess, DpAddress};
use probe_rs::architecture::arm::sequences::DefaultArmSequence;
use probe_rs::architecture::arm::{
    ApV2Address, ArmDebugInterface, ArmError, FullyQualifiedApAddress,
};
use probe_rs::probe::list::Lister;
use probe_rs::probe::{
    DebugProbeError, DebugProbeInfo, DebugProbeSelector, Probe, ProbeCreationError, WireProtocol,
};
use whippen_isa::Arch;
use whippen_runtime::monitor::{BoardMemory, BoardWrite, MonitorError};

use crate::exit::Failure;

/// Below are code and RAM; from here on peripherals, and a core's own registers (Armv8-M
/// Architecture Reference Manual, "The system address map").
const MEMORY_END: u32 = 0x4000_0000;

/// What a probe must be allowed to, on Linux.
const PERMISSION: &str = "on Linux a udev rule must let you open it (docs/monitor.md)";

/// How the memory of a chip is reached.
struct Route {
    chip: &'static str,
    /// The version of its debug port, in DPIDR.
    version: u8,
    /// The memory port of core 0.
    port: FullyQualifiedApAddress,
}

/// By architecture: RP2350 Datasheet 3.5 (memory port of core 0 at 0x2000), RP2040 Datasheet
/// 2.3.4 (core 0 is at this number of the shared line), STM32F4 Reference Manual RM0090 38.
fn route(arch: Arch) -> Route {
    let (chip, version, port) = match arch {
        Arch::V8M => {
            let port = ApV2Address::new(0x2000);
            let port = FullyQualifiedApAddress::v2_with_default_dp(port);
            ("RP2350", 3, port)
        }
        Arch::V6M => {
            let core_0 = DpAddress::Multidrop(0x0100_2927);
            let port = FullyQualifiedApAddress::v1_with_dp(core_0, 0);
            ("RP2040", 2, port)
        }
        Arch::V7EM => {
            let port = FullyQualifiedApAddress::v1_with_default_dp(0);
            ("STM32F4", 1, port)
        }
    };
    Route {
        chip,
        version,
        port,
    }
}

/// A board at a probe.
pub struct ProbeMemory {
    interface: Box<dyn ArmDebugInterface>,
    port: FullyQualifiedApAddress,
}

impl ProbeMemory {
    /// The board at the probe of this name (`VID:PID[:SERIAL]`, hexadecimal), or, where the name is
    /// empty, at the only one. The image on it is for a core of this architecture.
    ///
    /// # Errors
    /// There is no such probe, or several; it cannot be opened; no such chip is at it.
    pub fn open(name: &str, arch: Option<Arch>) -> Result<ProbeMemory, Failure> {
        let arch = arch.ok_or_else(|| cannot("the image does not say what core it is for"))?;
        let Route {
            chip,
            version,
            port,
        } = route(arch);
        let probe = connected(open_probe(name)?)?;
        let interface = probe.try_into_arm_debug_interface(DefaultArmSequence::create());
        let mut interface = interface.map_err(|(_, error)| cannot(told(&error)))?;
        let dpidr = interface
            .select_debug_port(port.dp())
            .and_then(|()| interface.read_dp_register::<DPIDR>(port.dp()));
        let dpidr = dpidr.map_err(|error| {
            let why = cause(&error);
            cannot(format!(
                "no {chip} answers at the probe: it must have power, and SWDIO, SWCLK and ground \
                 must be connected ({why})"
            ))
        })?;
        if dpidr.version() != version {
            return Err(cannot(format!(
                "the chip at the probe is no {chip}, for which the image is: its debug port is of \
                 version {}, not {version}",
                dpidr.version()
            )));
        }
        Ok(ProbeMemory { interface, port })
    }
}

/// The probe of a name, or the only one.
fn open_probe(name: &str) -> Result<Probe, Failure> {
    let selector = match name {
        "" => None,
        name => Some(name.parse::<DebugProbeSelector>().map_err(|_| {
            let why = "is no VID:PID[:SERIAL], in hexadecimal, such as 2e8a:000c";
            Failure::Usage(format!("--probe={name}: {why}"))
        })?),
    };
    let found = Lister::new().list(selector.as_ref());
    let info = match (&found[..], selector) {
        ([only], _) => only,
        ([], Some(name)) => {
            return Err(cannot(format!("there is no debug probe {name}")));
        }
        ([], None) => {
            return Err(cannot(
                "there is no debug probe: plug one in, of CMSIS-DAP version 2 or a J-Link",
            ));
        }
        (several, _) => {
            let name =
                |info: &DebugProbeInfo| format!("--probe={}", DebugProbeSelector::from(info));
            let names: Vec<String> = several.iter().map(name).collect();
            let names = names.join(", ");
            return Err(cannot(format!(
                "there are several debug probes, say which: {names}"
            )));
        }
    };
    info.open().map_err(|error| {
        let why = match error {
            DebugProbeError::ProbeCouldNotBeCreated(
                ProbeCreationError::NotFound | ProbeCreationError::CouldNotOpen,
            ) if info.is_hid_interface => {
                "it speaks CMSIS-DAP version 1 only, and wanted is version 2".to_string()
            }
            other => format!("it cannot be opened ({}); {PERMISSION}", told(&other)),
        };
        cannot(format!("{}: {why}", info.identifier))
    })
}

/// The probe, on the wires.
fn connected(mut probe: Probe) -> Result<Probe, Failure> {
    let name = probe.get_name();
    // Others have commands of their own in place of plain transfers, and what those do to a core is
    // not known.
    if probe.try_as_dap_probe().is_none() {
        return Err(cannot(format!(
            "{name} does not pass transfers on as they are: wanted is one of CMSIS-DAP version 2, \
             or a J-Link; OpenOCD speaks to others (--openocd)"
        )));
    }
    let attached = probe
        .select_protocol(WireProtocol::Swd)
        .map_err(|error| told(&error))
        .and_then(|()| probe.attach_to_unspecified().map_err(|error| told(&error)));
    match attached {
        Ok(()) => Ok(probe),
        Err(why) => Err(cannot(format!("{name}: {why}"))),
    }
}

fn cannot(why: impl Into<String>) -> Failure {
    Failure::Usage(format!("--probe: {}", why.into()))
}

/// An error, and what it comes from.
fn told(error: &(dyn Error + 'static)) -> String {
    let causes = causes(error).map(|error| error.to_string());
    let plain = causes.map(|text| text.trim_end_matches('.').to_string());
    plain.collect::<Vec<_>>().join(": ")
}

/// What an error comes from in the end.
fn cause(error: &(dyn Error + 'static)) -> String {
    causes(error).last().map_or(String::new(), told)
}

/// An error, what it comes from, and so on.
fn causes<'e>(error: &'e (dyn Error + 'static)) -> impl Iterator<Item = &'e (dyn Error + 'static)> {
    std::iter::successors(Some(error), |error| (*error).source())
}

/// What goes wrong on the wires.
fn lost(error: ArmError) -> MonitorError {
    MonitorError::Line(cause(&error))
}

/// Whether so many words from an address on are memory.
fn memory(address: u32, words: usize) -> Result<(), MonitorError> {
    let end = u64::from(address) + 4 * words as u64;
    match end <= u64::from(MEMORY_END) {
        true => Ok(()),
        false => Err(MonitorError::Refused(format!(
            "{address:#010x} is no memory: a probe reads none of a core's registers here"
        ))),
    }
}

impl BoardMemory for ProbeMemory {
    fn read(&mut self, address: u32, words: usize) -> Result<Vec<u32>, MonitorError> {
        memory(address, words)?;
        let mut all = vec![0; words];
        let mut port = self.interface.memory_interface(&self.port).map_err(lost)?;
        port.read_32(address.into(), &mut all).map_err(lost)?;
        Ok(all)
    }
}

impl BoardWrite for ProbeMemory {
    fn write(&mut self, address: u32, word: u32) -> Result<(), MonitorError> {
        memory(address, 1)?;
        let mut port = self.interface.memory_interface(&self.port).map_err(lost)?;
        port.write_word_32(address.into(), word).map_err(lost)?;
        port.flush().map_err(lost)
    }
}
