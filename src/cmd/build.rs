//! `whippen build`: from a program to files for a microcontroller.

mod files;
mod project;
#[cfg(test)]
mod refuted;
mod report;
mod self_test;
mod tick_bound;

use std::path::PathBuf;

use clap::ValueHint;
use clap::builder::{OsStringValueParser, TypedValueParser};

use super::file_plan::FilePlan;
use super::opened::Opened;
use super::option;
use super::setup::SetupArgs;
use crate::exit::{Failure, Outcome};
use files::Output;
pub use files::files_of_chips;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: whippen build instruments/grand-piano.whip --board rp2350 --keys 58 -o piano.uf2\n\
                  Example: whippen build instruments/grand-piano.whip --board rp2350 --keys 29 -o piano.o\n\
                  Example: whippen build instruments/grand-piano.whip -o piano.c\n\
                  Example: whippen build instruments/grand-piano.whip --keys 88 -o piano.wasm\n\
                  Example: whippen build instruments/grand-piano.whip --board rp2350 --self-test -o test.uf2"
)]
pub struct Args {
    #[command(flatten)]
    setup: SetupArgs,
    /// What to write: .elf or .uf2, a whole image; .o to link; .c for any other compiler
    /// (both with .h and .rs beside them); .wasm for browsers, .fmu for tools that simulate
    #[arg(short, long, value_name = "FILE.elf|.uf2|.o|.c|.wasm|.fmu", value_hint = ValueHint::FilePath, value_parser = OsStringValueParser::new().try_map(files::output))]
    output: Output,
    /// Write it also where it is not proven to be in time, with a mark in the file (of a .o, beside
    /// it)
    #[arg(long)]
    unproven: bool,
    /// Write an image that tests the core instead: it counts the cycles of little programs, and of
    /// ticks of the instrument's key, and tells them beside what is expected
    #[arg(long, conflicts_with = "unproven")]
    self_test: bool,
    /// A .o or .c guards its keys as an image does: force that comes up, what the motor stands,
    /// broken sensors, energy
    #[arg(long, conflicts_with = "self_test")]
    safety: bool,
    /// Also compare an image's code with the modes it was made of, and say of which modes both are
    /// shown to do the same; code that is found to do something else is not written
    #[arg(long, conflicts_with = "self_test")]
    validate: bool,
    /// The clock of the chip that a .o is for, such as 170MHz, where it is not the board's
    #[arg(long, value_name = "HZ", allow_negative_numbers = true, value_parser = option::clock)]
    clock: Option<u32>,
    /// Also write the firmware's texts for the board into this folder, a start for --firmware
    #[arg(long, value_name = "FOLDER", value_hint = ValueHint::DirPath, conflicts_with_all = ["firmware", "self_test"])]
    firmware_texts: Option<PathBuf>,
    /// Also write where everything lies and how large it is
    #[arg(long, value_name = "FILE.map", value_hint = ValueHint::FilePath)]
    map: Option<PathBuf>,
    /// Also write the source and its instructions side by side, with cycles
    #[arg(long, value_name = "FILE.lst", value_hint = ValueHint::FilePath)]
    listing: Option<PathBuf>,
}

/// That no file is written over one that is read, where there are so many chips.
fn check_files(args: &Args, opened: &Opened, chips: u32) -> Outcome {
    let of_chips = |path: &Option<PathBuf>| {
        let path = path.iter();
        path.flat_map(|path| files_of_chips(path, chips))
            .collect::<Vec<_>>()
    };
    FilePlan::default()
        .reads(opened.paths())
        .reads(&args.setup.files())
        .writes("--output", &args.output.files(chips), &[])
        .writes("--map", &of_chips(&args.map), &["map", "txt"])
        .writes("--listing", &of_chips(&args.listing), &["lst", "txt"])
        .check()
}

pub fn run(args: &Args) -> Outcome {
    let opened = args.setup.open()?;
    let named = args.setup.named_chips()?;
    check_files(args, &opened, named)?;
    let mut setup = if args.output.is_image() && !args.self_test {
        args.setup.all_programs(&opened)?
    } else {
        args.setup.one_program(&opened)?
    };
    if !args.output.is_image() {
        // What is no image is of no chip, however many the keyboard has.
        setup.chips = named;
    }
    if setup.chips != named {
        check_files(args, &opened, setup.chips)?;
    }
    match args.clock {
        Some(clock_hz) if args.output.is_object() && !args.self_test => {
            setup.board.clock_hz = clock_hz;
        }
        Some(_) => {
            let why = "--clock is for a .o: an image's firmware sets its clock, and of C nothing is \
                       proven";
            return Err(Failure::Usage(why.to_string()));
        }
        None => {}
    }
    files::write(&setup, args)
}
