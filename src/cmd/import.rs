//! `whippen import`: a recording of force over travel becomes an instrument.

pub(super) mod curve;
mod program;
pub(super) mod recording;

use std::ffi::OsString;
use std::path::PathBuf;

use serde_json::json;
use whippen_runtime::files::write_whole;

use super::new::{is_name, suggestion};
use crate::exit::{Failure, Outcome};
use crate::say::say;
use crate::table_text;
use curve::Curve;
use recording::{GRAM_N, Recording, rounded};

/// Glitches that are told one by one.
const GLITCHES_TOLD: usize = 8;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: whippen import my-switch.csv -o my_switch.whip\n\n\
                  A recording goes all the way down and up again, slowly. Its first line holds titles \
                  with units: `x_um,force_gf`, or `x_mm,branch,force_N` with `press` and `return`, or \
                  `x_mm,press_gf,return_gf`. docs/import.md says what becomes of it."
)]
pub struct Args {
    /// The recording, a table of travel and force
    #[arg(value_hint = clap::ValueHint::FilePath)]
    recording: PathBuf,
    /// The program to write, NAME.whip; the instrument is called NAME
    #[arg(short, long, value_name = "NAME.whip", value_hint = clap::ValueHint::FilePath)]
    out: PathBuf,
    /// One line of JSON instead of words
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> Outcome {
    let name = name_of(&args.out)?;
    if args.out.symlink_metadata().is_ok() {
        return Err(Failure::Usage(format!(
            "`{}` exists already; choose another name, or move it away",
            args.out.display()
        )));
    }
    let wrong = |why: String| {
        Failure::Usage(format!(
            "`{}` cannot be imported: {why}",
            args.recording.display()
        ))
    };
    let text = table_text::text(&args.recording).map_err(wrong)?;
    let recording = recording::read(&text).map_err(wrong)?;
    let curve = curve::of(&recording);
    let source = args.recording.file_name().unwrap_or_default();
    let source: OsString = source.to_os_string();
    let written = program::text(&name, &plain(&source), &recording, &curve);
    write_whole(&args.out, |file| file.write_all(written.as_bytes()))
        .map_err(|error| Failure::Usage(error.to_string()))?;
    if args.json {
        say!("{}", told_as_json(&name, &recording, &curve));
    } else {
        tell_all(args, &recording, &curve);
    }
    Ok(())
}

/// The name of a file as it may stand in a comment.
fn plain(name: &OsString) -> String {
    let text = name.to_string_lossy();
    text.chars()
        .filter(|c| !c.is_control() && *c != '`')
        .collect()
}

/// The instrument's name: that of the file.
fn name_of(out: &std::path::Path) -> Result<String, Failure> {
    let file = out
        .file_name()
        .map(|name| name.to_string_lossy().into_owned());
    let file = file.unwrap_or_default();
    let stem = file.strip_suffix(".whip").unwrap_or("");
    if is_name(stem) {
        return Ok(stem.to_string());
    }
    let so = suggestion(&file).map_or(String::new(), |s| format!("; try `-o {s}.whip`"));
    Err(Failure::Usage(format!(
        "`{file}` names no instrument: NAME.whip is wanted, where NAME is made of letters, digits and `_`{so}"
    )))
}

fn gf(newtons: f64) -> f64 {
    rounded(newtons / GRAM_N)
}

fn tell_all(args: &Args, recording: &Recording, curve: &Curve) {
    let [low, high] = recording.travel_m();
    let out = args.out.display();
    say!(
        "{} points down and {} up, {} mm to {} mm, forces in {}",
        recording.press.len(),
        recording.back.len(),
        rounded(1e3 * low),
        rounded(1e3 * high),
        recording.unit_of_force
    );
    for glitch in curve.glitches.iter().take(GLITCHES_TOLD) {
        say!(
            "glitch at {} mm {}: {} gf, taken as {} gf like its neighbours",
            rounded(1e3 * glitch.x_m),
            if glitch.pressed {
                "going down"
            } else {
                "coming up"
            },
            gf(glitch.force_n),
            gf(glitch.instead_n)
        );
    }
    let more = curve.glitches.len().saturating_sub(GLITCHES_TOLD);
    if more > 0 {
        say!("and {more} more glitches; is this a recording of one slow press?");
    }
    if let Some([stiffness, first]) = curve.spring {
        say!(
            "a bare spring: {} N/m behind {} gf, no hysteresis to speak of",
            rounded(stiffness),
            gf(first)
        );
    }
    say!(
        "{} knots down and {} up; the loop is the recording's within {} gf rms",
        curve.press.len(),
        curve.back.len(),
        gf(curve.rms_n)
    );
    say!(
        "a recording does not tell how the force goes from curve to curve where the key turns round half way \
         (give = {} mm is assumed, the longest that the turn at the bottom allows), nor damping, nor what moves with the key",
        rounded(1e3 * curve.give_m)
    );
    say!("wrote {out}; next: whippen check {out} --numbers");
}

fn told_as_json(name: &str, recording: &Recording, curve: &Curve) -> serde_json::Value {
    let [low, high] = recording.travel_m();
    let glitch = |glitch: &curve::Glitch| {
        json!({
            "pressed": glitch.pressed,
            "x_mm": rounded(1e3 * glitch.x_m),
            "force_gf": gf(glitch.force_n),
            "instead_gf": gf(glitch.instead_n),
        })
    };
    json!({
        "kind": "import",
        "instrument": name,
        "travel_mm": [rounded(1e3 * low), rounded(1e3 * high)],
        "knots": [curve.press.len(), curve.back.len()],
        "rms_gf": gf(curve.rms_n),
        "give_mm": rounded(1e3 * curve.give_m),
        "glitches": curve.glitches.iter().map(glitch).collect::<Vec<_>>(),
        "spring_n_per_m": curve.spring.map(|[stiffness, _]| rounded(stiffness)),
    })
}
