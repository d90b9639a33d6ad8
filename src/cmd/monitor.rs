//! `whippen monitor`: what a board that plays says of itself; its live values; captures of its keys
//! at tick rate.
//!
//! ```text
//!   program and options of the build --> the same image, names, places --.
//!   port -> Client ------------------------------------------------------+--> status, values, cells
//!                                                                        `--> capture --jit--> trace, page
//!   image.elf, OpenOCD or a debug probe -------------------------------------> status
//! ```
//!
//! Nothing here halts a board.

mod board;
mod capturing;
mod osc;
mod port;
#[cfg(feature = "probe")]
mod probe;
mod told;

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::Duration;

use whippen_compiler::firmware::Fact;
use whippen_emulator::elf::Elf;
use whippen_runtime::files::{self, InputKind};
use whippen_runtime::monitor::{
    Client, Link, MonitorError, Status, align, align_by_mailbox, read_status,
};

use self::board::{KnownBoard, name_and_value};
use self::capturing::CaptureArgs;
use self::osc::Osc;
use self::port::{Line, PortArgs};
use self::told::Look;
use super::file_plan::FilePlan;
use super::option;
use super::setup::SetupArgs;
use crate::exit::{Failure, Outcome};
use crate::interrupt;
use crate::say::{self, say};

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Give it the files and options of `whippen build --monitor`: it makes the same image, and knows by it where everything lies.\n\
                  Example: whippen monitor instruments/grand-piano.whip --port /dev/ttyUSB0\n\
                  Example: whippen monitor instruments/grand-piano.whip --port /dev/ttyUSB0 --capture 40 --trigger x:4mm --out strike.csv --report strike.html\n\
                  Example: whippen monitor piano.elf --openocd localhost:6666 --watch 1\n\
                  Example: whippen monitor knob.elf --probe --align"
)]
pub struct Args {
    #[command(flatten)]
    setup: SetupArgs,
    #[command(flatten)]
    port: PortArgs,
    /// Set a live value, such as volume=0.5 or stiffness=90N/m
    #[arg(long, value_name = "NAME=VALUE", value_parser = name_and_value)]
    live: Vec<(String, String)>,
    /// Have this program play, by its name or number
    #[arg(long, value_name = "PROGRAM")]
    play: Option<String>,
    /// Have a knob find its motor anew: its chip starts again, and the knob moves by itself
    #[arg(long)]
    align: bool,
    /// Read what a key remembers, such as 40.phi: keys are counted from 0
    #[arg(long, value_name = "KEY.NAME,..", value_delimiter = ',')]
    read: Vec<String>,
    /// Tell the status again after so long, until Ctrl-C
    #[arg(long, value_name = "TIME", value_parser = option::seconds)]
    watch: Option<f64>,
    /// Send each status to this address too, by UDP, as Open Sound Control
    #[arg(long, value_name = "HOST:PORT")]
    osc: Option<String>,
    #[command(flatten)]
    capture: CaptureArgs,
    /// How long the board may take to answer
    #[arg(long, value_name = "TIME", default_value = "2s", value_parser = option::seconds)]
    patience: f64,
    /// Print JSON objects, a line each
    #[arg(long)]
    json: bool,
}

/// How long a board may take until it plays again: a knob that finds its motor takes a second.
const STARTING: Duration = Duration::from_secs(20);

/// Runs the command.
pub fn run(mut args: Args) -> Outcome {
    let folder: &[PathBuf] = &[];
    FilePlan::default()
        .reads(folder)
        .reads(&args.setup.files())
        .writes("--out", &args.capture.out, &["csv"])
        .writes("--report", &args.capture.report, &["html"])
        .check()?;
    match args.setup.image().map(Path::to_path_buf) {
        Some(image) => of_image(&args, &image),
        None => {
            args.setup.monitor.insist();
            of_program(&args)
        }
    }
}

/// The status alone, of an image whose program is not at hand.
fn of_image(args: &Args, path: &Path) -> Outcome {
    let asked = [
        ("--live", !args.live.is_empty()),
        ("--play", args.play.is_some()),
        ("--read", !args.read.is_empty()),
        ("--capture", !args.capture.capture.is_empty()),
    ];
    if let Some((option, _)) = asked.iter().find(|(_, asked)| *asked) {
        return Err(Failure::Usage(format!(
            "{option} wants the files of the program, in place of the image"
        )));
    }
    let wrong = |why: String| Failure::Usage(format!("`{}`: {why}", path.display()));
    let bytes = files::read_bytes(path, InputKind::IMAGE).map_err(|e| wrong(e.message))?;
    let elf = Elf::parse(&bytes, false).map_err(|e| wrong(e.to_string()))?;
    let status = elf.symbols.named("status");
    let at =
        status.map_err(|_| wrong("has no `status`: it is no image of `whippen build`".into()))?;
    let at = at.address;
    let find = |name: &str| elf.symbols.named(name).ok().map(|symbol| symbol.address);
    let mailbox = to_align(args, find)?;
    let patience = Duration::from_secs_f64(args.patience);
    match args.port.debugged(elf.arch, patience)? {
        Some(mut board) => {
            if let Some(mailbox) = mailbox {
                let asked = align_by_mailbox(&mut *board, mailbox, at, STARTING);
                aligned(args, asked)?;
            }
            let look = || {
                Ok(Look {
                    status: read_status(&mut *board, at)?,
                    lost_answers: None,
                })
            };
            watched(args, look, None)
        }
        None => {
            let mut client = args.client()?;
            client.identify().map_err(failure)?;
            if mailbox.is_some() {
                aligned(args, align(&mut client, at, STARTING))?;
            }
            watched(args, || look(&mut client, at), None)
        }
    }
}

/// Everything, of an image whose program is at hand.
fn of_program(args: &Args) -> Outcome {
    if let Some(option) = args.port.debugger() {
        let why = "wants the image, an .elf, in place of the program's files";
        return Err(Failure::Usage(format!("{option} {why}")));
    }
    let opened = args.setup.open()?;
    let setup = args.setup.all_programs(&opened)?;
    let known = KnownBoard::new(&setup, &opened.sources)?;
    args.capture.check(&known)?;
    let mailbox = to_align(args, |name| known.symbol(name))?;
    let mut client = args.client()?;
    let facts = client.identify().map_err(failure)?;
    known.check(&facts).map_err(failure)?;
    let at = facts.word(Fact::Status);
    if mailbox.is_some() {
        aligned(args, align(&mut client, at, STARTING))?;
    }
    if let Some(program) = &args.play {
        client.play(known.program(program)?).map_err(failure)?;
    }
    for (name, value) in &args.live {
        known.set_live(&mut client, name, value)?;
    }
    if !args.capture.capture.is_empty() {
        return args.capture.run(&known, &facts, &mut client, args.json);
    }
    for name in &args.read {
        let told = known.read_cell(&mut client, name)?;
        told::cell(name, &told, args.json);
    }
    let lives = known.lives(&mut client)?;
    watched(args, || look(&mut client, at), Some((&known, lives)))
}

/// The status, and what the line has lost until then.
fn look<L: Link>(client: &mut Client<L>, at: u32) -> Result<Look, MonitorError> {
    Ok(Look {
        status: read_status(client, at)?,
        lost_answers: Some(client.lost_answers()),
    })
}

impl Args {
    fn client(&self) -> Result<Client<Line>, Failure> {
        let line = self.port.open(self.setup.monitor.baud_or_fast())?;
        Ok(Client::new(line, Duration::from_secs_f64(self.patience)))
    }
}

/// The mailbox of an image with these symbols, where its knob is to find its motor anew.
fn to_align(args: &Args, find: impl Fn(&str) -> Option<u32>) -> Result<Option<u32>, Failure> {
    if !args.align {
        return Ok(None);
    }
    match (find("board_align"), find("mailbox")) {
        (Some(_), Some(mailbox)) => Ok(Some(mailbox)),
        _ => Err(Failure::Usage(
            "--align: the image keeps no alignment of a motor: it is for no knob, or for a board \
             without the key `store` of [knob], which finds its motor at every start"
                .to_string(),
        )),
    }
}

/// What came of asking a knob.
fn aligned(args: &Args, asked: Result<(), MonitorError>) -> Outcome {
    asked.map_err(failure)?;
    told::aligned(args.json);
    Ok(())
}

/// Live values by their names.
pub type Lives = Vec<(String, String)>;

/// Tells the status once, or again and again.
fn watched(
    args: &Args,
    mut look: impl FnMut() -> Result<Look, MonitorError>,
    known: Option<(&KnownBoard, Lives)>,
) -> Outcome {
    let osc = args.osc.as_deref().map(Osc::to).transpose()?;
    let send = |look: &Look| match &osc {
        Some(osc) => osc.send(&told::json(look, known.as_ref())),
        None => Ok(()),
    };
    let first = look().map_err(failure)?;
    send(&first)?;
    let text = match args.json {
        true => format!("{}\n", told::json(&first, known.as_ref())),
        false => told::text(&first, known.as_ref()),
    };
    say::whole(&text);
    let Some(pause) = args.watch else {
        return Ok(());
    };
    let stop = interrupt::stops();
    let mut before = first;
    while !stop.load(Ordering::Relaxed) {
        std::thread::sleep(Duration::from_secs_f64(pause));
        let now = look().map_err(failure)?;
        let ticks = |status: &Status| status.cores.first().map_or(0, |core| core.ticks);
        // A number that goes back by less than half of what there are is that of another start.
        if ticks(&now.status).wrapping_sub(ticks(&before.status)) > u32::MAX / 2 {
            return Err(failure(MonitorError::Restarted));
        }
        send(&now)?;
        match args.json {
            true => say!("{}", told::json(&now, known.as_ref())),
            false => say!("{}", told::line(&now)),
        }
        before = now;
    }
    Ok(())
}

/// What the board did not do: the program's fault, or that of the command line.
pub fn failure(error: MonitorError) -> Failure {
    match error {
        MonitorError::Refused(_) | MonitorError::Restarted => {
            crate::say::tell!("error: {error}");
            Failure::Program
        }
        other => Failure::Usage(other.to_string()),
    }
}
