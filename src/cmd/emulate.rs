//! `whippen emulate`: runs any bare-metal image for a Cortex-M, or calls one function of it, and
//! counts cycles.
//!
//! ```text
//!   image  -> ELF, core, board, memory          value -> numbers and symbols of the command line
//!     |
//!   run    -> call or reset, to the end          trace, profile  watch every instruction
//!     |                                          gdb             lets a debugger drive
//!   report -> summary or JSON, memory read back
//! ```

mod bench;
mod board;
mod chips;
mod columns;
mod gdb;
mod image;
mod knob;
mod outside;
mod ports;
mod profile;
mod report;
mod rows;
mod run;
mod trace;
mod uart;
mod value;
mod watch;

use std::path::{Path, PathBuf};

use whippen_compiler::rate::Rate;
use whippen_emulator::CoreKind;

use super::build::files_of_chips;
use super::file_plan::FilePlan;
use super::option;
use crate::exit::{Failure, Outcome};
use board::{Boards, MemoryRange};
use image::Image;

/// Unless told otherwise, a run ends after so many cycles.
const MAX_CYCLES: u64 = 1_000_000_000;

#[derive(Debug, clap::Args)]
#[command(after_long_help = LONG_HELP, after_help = SHORT_HELP)]
pub struct Args {
    /// An ELF for a Cortex-M: a linked image, or an object file that needs nothing else
    #[arg(value_name = "IMAGE.elf")]
    image: PathBuf,
    #[command(flatten)]
    what: What,
    #[command(flatten)]
    on: On,
    #[command(flatten)]
    outputs: EmulateOutputs,
}

impl Args {
    /// The files that are read and written.
    fn plan(&self) -> FilePlan {
        let devices = &self.on.devices;
        let trace = self.outputs.trace.iter().filter(|path| !is_stdout(path));
        FilePlan::default()
            .reads(&files_of_chips(&self.image, self.on.board.chips))
            .reads(&self.what.input)
            .reads(&self.what.memory_files())
            .reads(devices.serial_in.iter().chain(&devices.sense))
            .reads(&self.on.parts.files())
            .writes("--trace", trace, &[])
            .writes("--profile", &self.outputs.profile, &["json"])
            .writes("--drive", &devices.drive, &[])
            .writes("--vcd", &devices.vcd, &["vcd"])
            .writes("--out", &self.on.parts.out, &["csv"])
            .writes("--heard", &self.on.parts.heard, &["wav"])
    }
}

/// Whether an output goes to the terminal.
fn is_stdout(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// What to run.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "What to run")]
struct What {
    /// Call one function with up to four arguments in R0 to R3, instead of starting at reset
    ///
    /// Numbers are decimal or 0x.., may be negative, and may be symbols with an offset: `--call
    /// fir,buffer,coefs+8,64`. Data that start-up code would copy to RAM is there already, the rest
    /// of RAM is zero, the stack is at the end of RAM and the FPU is on. Cycles count from the
    /// entry of the function to its return.
    #[arg(long, value_name = "SYMBOL[,R0..R3]", allow_hyphen_values = true)]
    call: Option<String>,
    /// Set memory first: bytes in hexadecimal, or a file's as `ADDR=@FILE`
    #[arg(long, value_name = "ADDR=HEX")]
    write: Vec<String>,
    /// Read memory back at the end; LEN may be left out for a symbol that has a size
    #[arg(long, value_name = "ADDR[:LEN]")]
    read: Vec<String>,
    /// Stop after so many cycles; 2e9, 500k and 150M are numbers too [default: 1e9, none with
    /// --gdb]
    #[arg(long, value_name = "N", value_parser = value::count)]
    max_cycles: Option<u64>,
    /// What the program reads from its console by semihosting
    #[arg(long, value_name = "FILE")]
    input: Option<PathBuf>,
    /// The command line that the program gets by semihosting
    #[arg(long, value_name = "TEXT", default_value = "")]
    args: String,
}

impl What {
    /// The files whose bytes memory is set to.
    fn memory_files(&self) -> Vec<PathBuf> {
        let file = |text: &String| text.split_once("=@").map(|(_, file)| PathBuf::from(file));
        self.write.iter().filter_map(file).collect()
    }
}

/// What to run it on.
#[derive(Debug, Clone, clap::Args)]
#[command(next_help_heading = "What to run it on")]
struct On {
    /// cortex-m0plus, cortex-m4 or cortex-m33 [default: what the image was compiled for]
    #[arg(long, value_name = "CORE", value_parser = board::core)]
    core: Option<CoreKind>,
    /// The board: rp2350, rp2040 or stm32f4; `generic` is a core and the memory that the image
    /// wants, with 512 KiB of RAM at 0x20000000. `rp2350*2` are two chips with the images that
    /// `build` made of them, IMAGE.chip1.elf and IMAGE.chip2.elf
    #[arg(long, value_name = "BOARD[*CHIPS]", default_value = "generic", value_parser = board::boards)]
    board: Boards,
    /// More RAM, such as 0x30000000:64K
    #[arg(long, value_name = "ADDR:SIZE", value_parser = board::memory)]
    ram: Vec<MemoryRange>,
    /// Memory that the program cannot write
    #[arg(long, value_name = "ADDR:SIZE", value_parser = board::memory)]
    rom: Vec<MemoryRange>,
    /// Cycles of flag-setting instructions with a shifted register on a Cortex-M33, where sources
    /// disagree
    ///
    /// 2 is the datasheet of RP2350; 1 is what others measured, the flags then come a cycle later.
    #[arg(long, value_name = "1|2", default_value_t = 2, value_parser = option::shifted_flags)]
    shifted_flags: u8,
    #[command(flatten)]
    devices: Devices,
    #[command(flatten)]
    parts: outside::PartArgs,
}

/// What is at the other end of a board's devices.
#[derive(Debug, Clone, clap::Args)]
#[command(next_help_heading = "Devices of rp2350 and rp2040")]
struct Devices {
    /// What arrives on the first serial port; what the program sends goes to stdout
    #[arg(long, value_name = "FILE")]
    serial_in: Option<PathBuf>,
    /// The other end of the first serial port is a TCP port of this machine, or a pseudo-terminal;
    /// the board waits for somebody there, and ends with him. `--sense` begins again at its end
    #[arg(long, value_name = "PORT|pty", conflicts_with = "serial_in")]
    uart: Option<uart::UartDoor>,
    /// Sensor words for the converter: 16 bits each, low byte first, one per key and tick; their
    /// end ends the run
    #[arg(long, value_name = "FILE")]
    sense: Option<PathBuf>,
    /// Where to write the drive words, in the same order
    #[arg(long, value_name = "FILE")]
    drive: Option<PathBuf>,
    /// Where to write what is on the pins, every change at its cycle, for a viewer of waveforms
    #[arg(long, value_name = "FILE.vcd")]
    vcd: Option<PathBuf>,
    /// The pins of --vcd, such as 2,3,4 [default: all that have had a function]
    #[arg(long, value_name = "PINS", value_delimiter = ',', requires = "vcd", value_parser = clap::value_parser!(u8).range(0..48))]
    vcd_pins: Vec<u8>,
    /// Keys of the converter [default: 88]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = option::keys)]
    keys: Option<u32>,
    /// Its ticks per second [default: 44100]
    #[arg(long, value_name = "HZ", allow_negative_numbers = true, value_parser = option::rate)]
    rate: Option<Rate>,
}

/// What to tell.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "What to tell")]
struct EmulateOutputs {
    /// One line per instruction: its cycles, and why it waited; `-` is stdout
    #[arg(long, value_name = "FILE")]
    trace: Option<PathBuf>,
    /// Cycles per function and source line, as JSON; the most expensive functions are printed too
    #[arg(long, value_name = "FILE.json")]
    profile: Option<PathBuf>,
    /// Wait for gdb on this TCP port of the local machine; 0 takes a free one and says which
    #[arg(long, value_name = "PORT", value_parser = option::port, conflicts_with_all = ["trace", "profile", "json", "uart"])]
    gdb: Option<u16>,
    /// Print the result as one JSON object
    #[arg(long)]
    json: bool,
}

const SHORT_HELP: &str = "\
Example: whippen emulate firmware.elf --call fir,in,out,4 --write in=0100020003000400 --read out:8";

const LONG_HELP: &str = "\
ADDR is a number (0x20000000), a symbol (buffer) or both (buffer+0x10).

Examples:
  # Run an image from reset until it exits by semihosting; its output goes to stdout.
  whippen emulate firmware.elf

  # How many cycles does one function take, and what does it compute?
  whippen emulate firmware.elf --call isqrt,1000000
  whippen emulate firmware.elf --call fir,in,out,64 --write in=@samples.bin --read out:128

  # The same function straight from the compiler, without a linker.
  arm-none-eabi-gcc -O2 -mcpu=cortex-m33 -c isqrt.c
  whippen emulate isqrt.o --call isqrt,1000000

  # Where do the cycles go?
  whippen emulate firmware.elf --call update --trace - | less
  whippen emulate firmware.elf --profile profile.json

  # Both cores of an RP2350 serve 88 keys: sensor words in, drive words out, overruns counted.
  whippen emulate firmware.elf --board rp2350 --sense words.bin --drive drive.bin

  # A knob in the hand: sensor, driver and motor on the pins of a Pico 2.
  whippen build instruments/knob.whip --board pico2_knob --device gimbal --tick-rate 150MHz/3400 -o knob.elf
  whippen emulate knob.elf --board rp2350 --knob pico2_knob --motion turn.csv --out knob.csv --vcd knob.vcd

  # Keys on a bench, and what the DAC beside them is given.
  whippen build instruments/clavichord-heard.whip --board rp2350b_bench --keys 2 --device voice_coil --tick-rate 150MHz/3400 -o keys.elf
  whippen emulate keys.elf --board rp2350 --bench rp2350b_bench --motion press.csv --out keys.csv --heard keys.wav

  # Keys at columns of converters.
  whippen build instruments/grand-piano.whip --board rp2350_columns --keys 16 --device column_coil --tick-rate 150MHz/3400 -o columns.elf
  whippen emulate columns.elf --board rp2350 --columns rp2350_columns --motion press.csv --pressed 1,9 --out columns.csv

  # A keyboard with `build --monitor`, and whippen monitor at its serial port.
  whippen emulate piano.elf --board rp2350 --uart 4444 &
  whippen monitor piano.whip --tcp localhost:4444

  # Debug it.
  whippen emulate firmware.elf --gdb 3333 &
  gdb-multiarch firmware.elf -ex 'target remote :3333'

JSON: cycles, instructions, r0 (and r1), reads (a string of hexadecimal digits each, in memory's order), stop, which is
`returned`, `exit`, `fault`, `limit`, `over` (of --sense), `breakpoint`, `asleep` or `reset`; with more of the program's end under `where`,
`message` and `exit_code`, and what it printed under `output`.

Exit code: 0 the function returned, or the program exited with 0; 1 it faulted, exited otherwise or did not end;
2 the command line or the image is wrong.";

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    args.plan().check()?;
    if args.on.board.chips > 1 {
        return chips::run(args);
    }
    let mut image = Image::load(&args.image, &args.on)?;
    image.machine.semihosting.enabled = true;
    image
        .machine
        .semihosting
        .command_line
        .clone_from(&args.what.args);
    if let Some(path) = &args.what.input {
        image.machine.semihosting.input.extend(image::read(path)?);
    }
    let task = run::Task::prepare(&mut image, &args.what)?;
    if let Some(door) = args.on.devices.uart {
        image.door = Some(door.open()?);
    }
    if let Some(port) = args.outputs.gdb {
        return gdb::serve(image, &task, port);
    }
    let end = run::to_the_end(&mut image, &task, &args.outputs)?;
    if let Some(ports) = &image.ports {
        args.on.devices.write_drive(&image.machine, ports)?;
        args.on.devices.write_pins(&mut image.machine)?;
    }
    args.on.parts.write(&image.outside)?;
    report::print(&image, &task, &end, &args.outputs)?;
    if end.succeeded() {
        Ok(())
    } else {
        Err(Failure::Program)
    }
}
