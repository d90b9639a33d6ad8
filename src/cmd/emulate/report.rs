//! What a run came to: a short summary, or one JSON object.

use serde::Serialize;
use whippen_emulator::{Converter, Register, Stop};
use whippen_runtime::files::write_whole;

use super::image::Image;
use super::run::{End, Read, Task};
use super::{EmulateOutputs, MAX_CYCLES};
use crate::exit::{Failure, Outcome};
use crate::say::{self, say};

/// The JSON object.
#[derive(Serialize)]
struct RunReport {
    cycles: u64,
    instructions: u64,
    r0: u32,
    r1: u32,
    reads: Vec<String>,
    stop: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    ticks: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    overruns: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    exit_code: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    message: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    r#where: Option<String>,
    core: &'static str,
    #[serde(skip_serializing_if = "String::is_empty")]
    output: String,
}

/// Prints the end of a run, and writes the profile.
pub fn print(image: &Image, task: &Task, end: &End, outputs: &EmulateOutputs) -> Outcome {
    if outputs.json {
        return json(image, task, end).and_then(|()| profile(image, end, outputs));
    }
    // A trace on stdout had it to itself until now.
    say::bytes(&end.output);
    summary(image, task, end);
    for read in &task.reads {
        let bytes = read.now(&image.machine).map_err(Failure::Usage)?;
        say!("\n{}, {} bytes", read.name, read.bytes);
        say::whole(&dump(read, &bytes));
    }
    profile(image, end, outputs)
}

fn profile(image: &Image, end: &End, outputs: &EmulateOutputs) -> Outcome {
    let (Some(profile), Some(path)) = (&end.profile, &outputs.profile) else {
        return Ok(());
    };
    let text = profile
        .json(image)
        .map_err(|e| Failure::Defect(e.to_string()))?;
    write_whole(path, |w| w.write_all(text.as_bytes()))
        .map_err(|e| Failure::Usage(e.to_string()))?;
    if !outputs.json {
        say::whole(&format!("\n{}", profile.table(image)));
    }
    Ok(())
}

fn json(image: &Image, task: &Task, end: &End) -> Outcome {
    let hex = |read: &Read| {
        let bytes = read.now(&image.machine)?;
        Ok(bytes.iter().map(|b| format!("{b:02x}")).collect())
    };
    let (message, place) = complaint(image, task, end).unzip();
    let [r0, r1] = result(image);
    let report = RunReport {
        cycles: end.cycles,
        instructions: end.instructions,
        r0,
        r1,
        reads: task
            .reads
            .iter()
            .map(hex)
            .collect::<Result<_, _>>()
            .map_err(Failure::Usage)?,
        stop: if end.over { "over" } else { word(&end.stop) },
        ticks: image.converter().map(Converter::ticks),
        overruns: image.converter().map(Converter::overruns),
        exit_code: if let Stop::Exit { code } = end.stop {
            Some(code)
        } else {
            None
        },
        message,
        r#where: place.flatten(),
        core: image.machine.board().core.name(),
        output: String::from_utf8_lossy(&end.output).into_owned(),
    };
    say!(
        "{}",
        serde_json::to_string(&report).map_err(|e| Failure::Defect(e.to_string()))?
    );
    Ok(())
}

/// The word for a script.
fn word(stop: &Stop) -> &'static str {
    match stop {
        Stop::Returned { .. } => "returned",
        Stop::Exit { .. } => "exit",
        Stop::Fault(_) => "fault",
        Stop::Limit => "limit",
        Stop::Breakpoint { .. } | Stop::Watchpoint { .. } => "breakpoint",
        Stop::Asleep => "asleep",
        Stop::Reset => "reset",
        Stop::Glitch { .. } => "glitch",
    }
}

fn result(image: &Image) -> [u32; 2] {
    [0, 1].map(|n| image.machine.cpu(0).get(Register::core(n)))
}

fn summary(image: &Image, task: &Task, end: &End) {
    let board = image.machine.board();
    let [r0, _] = result(image);
    match (&end.stop, &task.call) {
        (Stop::Returned { .. }, Some(name)) => say!("{name} returned {r0:#010x}{}", decimal(r0)),
        (Stop::Exit { code }, _) => say!("the program exited with {code}"),
        _ => {}
    }
    if let Some((message, place)) = complaint(image, task, end) {
        match place {
            Some(place) => say!("stopped in {place}: {message}"),
            None => say!("stopped: {message}"),
        }
    }
    let each = end.cycles as f64 / end.instructions.max(1) as f64;
    let time = duration(end.cycles as f64 / f64::from(board.clock_hz.max(1)));
    let clock_mhz = f64::from(board.clock_hz) / 1e6;
    say!(
        "  cycles       {:>12}  {time} at {clock_mhz} MHz, {}",
        end.cycles,
        board.core.name()
    );
    say!(
        "  instructions {:>12}  {each:.2} cycles each",
        end.instructions
    );
    if let Some(converter) = image.converter() {
        let (ticks, overruns) = (converter.ticks(), converter.overruns());
        say!(
            "  ticks        {ticks:>12}  of {} keys, {overruns} overruns",
            converter.keys()
        );
    }
    for told in image.outside.told(&image.machine) {
        say!("  {told}");
    }
    if matches!(end.stop, Stop::Fault(_)) {
        registers(image);
    }
}

/// A small number reads better in decimal, a negative one with its sign.
fn decimal(word: u32) -> String {
    match word as i32 {
        value if (-1_000_000..=1_000_000).contains(&value) => format!(" ({value})"),
        _ => String::new(),
    }
}

fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 1e-6 => format!("{:.1} ns", s * 1e9),
        s if s < 1e-3 => format!("{:.2} us", s * 1e6),
        s if s < 1.0 => format!("{:.2} ms", s * 1e3),
        s => format!("{s:.2} s"),
    }
}

/// What went wrong, and where.
fn complaint(image: &Image, task: &Task, end: &End) -> Option<(String, Option<String>)> {
    let pc = image.machine.cpu(0).get(Register::PC);
    let (message, address) = match &end.stop {
        _ if end.over => return None,
        Stop::Asleep if end.differ.is_some() => return None,
        Stop::Returned { .. } | Stop::Exit { .. } => return None,
        Stop::Fault(fault) => {
            let named = image
                .elf
                .symbols
                .covering(fault.address)
                .filter(|_| fault.address != fault.pc);
            let named = named.map_or(String::new(), |_| {
                format!("; the address is {}", image.place(fault.address))
            });
            (format!("{fault}{named}"), fault.pc)
        }
        Stop::Limit => {
            let limit = task.max_cycles.unwrap_or(MAX_CYCLES);
            (
                format!("the limit of {limit} cycles was reached; --max-cycles sets another"),
                pc,
            )
        }
        Stop::Breakpoint { address, .. } => (
            "a BKPT instruction; --gdb lets a debugger take it".into(),
            *address,
        ),
        other => (other.to_string(), pc),
    };
    Some((message, Some(image.place(address))))
}

fn registers(image: &Image) {
    let cpu = image.machine.cpu(0);
    let all: Vec<Register> = Register::all().take(17).collect();
    for row in all.chunks(4) {
        let row: Vec<String> = row
            .iter()
            .map(|r| format!("{:>4} {:08x}", r.name(), cpu.get(*r)))
            .collect();
        say!("  {}", row.join(" "));
    }
}

/// Sixteen bytes a line: address, hexadecimal, text.
fn dump(read: &Read, bytes: &[u8]) -> String {
    let mut text = String::new();
    for (i, row) in bytes.chunks(16).enumerate() {
        let address = read.address.wrapping_add(16 * i as u32);
        let hex: Vec<String> = row.iter().map(|b| format!("{b:02x}")).collect();
        let shown: String = row
            .iter()
            .map(|&b| {
                if (b' '..=b'~').contains(&b) {
                    char::from(b)
                } else {
                    '.'
                }
            })
            .collect();
        text.push_str(&format!(
            "  {address:08x}  {:<47}  |{shown}|\n",
            hex.join(" ")
        ));
    }
    text
}
