//! `whippen tune`: a sensor's calibration table fitted to readings of a key that went to both ends.

use std::fmt::Write;
use std::path::PathBuf;

use clap::ValueHint;
use serde_json::json;
use whippen_runtime::files::write_whole;
use whippen_runtime::motion::Calibration;
use whippen_runtime::motion::tune::{Tuning, readings, tune};

use super::file_plan::FilePlan;
use super::option;
use crate::exit::{Failure, Outcome};
use crate::say::say;
use crate::table_text;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: whippen tune readings.txt --table sensor.csv --rest 0mm --full 10mm -o tuned.csv\n\
                  Example: whippen run instruments/hammond.whip --motion readings.txt --rate 1kHz --calibration tuned.csv\n\n\
                  Let the key rest, start recording, press it slowly all the way down, more than once, and let it up."
)]
pub struct Args {
    /// Readings of the converter, a bare column of numbers: first of the key at rest, then of one
    /// that goes to both ends
    #[arg(value_hint = ValueHint::FilePath)]
    readings: PathBuf,
    /// Table from position to reading of such a sensor, whatever its offset and gain
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    table: PathBuf,
    /// The column with the readings, counted from 1
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = option::column)]
    column: u32,
    /// Where the key rests, in the table; its first position otherwise
    #[arg(long, value_name = "LENGTH", value_parser = option::length, allow_hyphen_values = true)]
    rest: Option<f64>,
    /// Where the key is when down, in the table; its last position otherwise
    #[arg(long, value_name = "LENGTH", value_parser = option::length, allow_hyphen_values = true)]
    full: Option<f64>,
    /// The tuned table to write, for `run --calibration`
    #[arg(short, long, value_name = "FILE.csv", value_hint = ValueHint::FilePath)]
    out: PathBuf,
    /// One line of JSON instead of words
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> Outcome {
    let usage = |e: whippen_runtime::files::FileError| Failure::Usage(e.to_string());
    let out = Some(args.out.clone());
    let plan = FilePlan::default().reads([&args.readings, &args.table]);
    plan.writes("--out", &out, &["csv"]).check()?;
    let table = Calibration::load(&args.table).map_err(usage)?;
    let readings = readings(&args.readings, args.column as usize).map_err(usage)?;
    let [first_m, last_m] = table.ends_m();
    let stops_m = [args.rest.unwrap_or(first_m), args.full.unwrap_or(last_m)];
    let tuning = tune(&readings, &table, stops_m)
        .map_err(|why| Failure::Usage(format!("`{}`: {why}", args.readings.display())))?;
    let written = tuned(args, &tuning)?;
    write_whole(&args.out, |file| file.write_all(written.as_bytes())).map_err(usage)?;
    tell(args, &tuning, readings.len());
    Ok(())
}

/// The table with offset and gain in the title of its readings.
fn tuned(args: &Args, tuning: &Tuning) -> Result<String, Failure> {
    let text = table_text::text(&args.table)
        .map_err(|why| Failure::Usage(format!("`{}`: {why}", args.table.display())))?;
    let mut lines = text.lines();
    let position = lines.next().and_then(|titles| titles.split(',').next());
    let mut out = format!(
        "{},reading_after_offset_{}_gain_{}\n",
        position.unwrap_or("").trim(),
        tuning.offset,
        tuning.gain
    );
    for line in lines {
        let _ = writeln!(out, "{line}");
    }
    Ok(out)
}

fn tell(args: &Args, tuning: &Tuning, count: usize) {
    let Tuning {
        ends: [least, greatest],
        rises,
        offset,
        gain,
    } = *tuning;
    if args.json {
        let object = json!({
            "kind": "tune", "readings": count, "least": least, "greatest": greatest,
            "rises": rises, "offset": offset, "gain": gain,
        });
        say!("{object}");
        return;
    }
    let way = if rises { "rise" } else { "fall" };
    say!("{count} readings from {least} to {greatest}, which {way} when the key goes down");
    say!("a reading is {offset:.6} + {gain:.6} times that of the table");
    say!(
        "wrote {}; next: run --calibration with it",
        args.out.display()
    );
}
