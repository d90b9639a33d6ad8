//! Presets: several parameters at once, from what is bundled and from files.

use serde_json::Value;

use super::cli::{Shell, bundled};

#[test]
fn every_preset_fits_what_it_is_for() {
    let shell = Shell::new();
    for (preset, file) in [
        ("onofrei", "bowed-violin.whip"),
        ("open-g", "keytar.whip"),
        ("pentatonic", "rubbed-bank.whip"),
        ("pentatonic", "rubbed-pad.whip"),
        ("pentatonic", "rubbed-mouse.whip"),
    ] {
        let (out, err) = shell.ends(0, &["check", &bundled(file), "--preset", preset]);
        // Notes are of the instrument, whatever the preset.
        let is_fit = out.contains(": ok") && !err.contains("Error:") && !err.contains("Warning:");
        assert!(is_fit, "{out}{err}");
    }
}

#[test]
fn what_is_set_goes_before_a_preset_and_the_last_preset_before_others() {
    let shell = Shell::new()
        .with(
            "one.toml",
            "[set]\nheight = \"30 mN*m\"\nrubs = \"6 mN*m\"\n",
        )
        .with("two.toml", "[set]\nrubs = \"1 mN*m\"\npitch = \"30 deg\"\n");
    let knob = bundled("knob.whip");
    let command = ["run", &knob, "--preset", "one.toml", "--preset", "two.toml"];
    let more = ["--set", "pitch=20deg", "--seconds", "0.1", "--json"];
    let (out, _) = shell.ends(0, &[&command[..], &more].concat());
    let said: Value = serde_json::from_str(&out).expect("JSON");
    let set = &said["set"];
    assert_eq!(set["height"], "30 mN*m");
    assert_eq!(
        (&set["rubs"], &set["pitch"]),
        (&"1 mN*m".into(), &"20deg".into())
    );
}

#[test]
fn what_is_no_preset_is_refused() {
    let shell = Shell::new()
        .with("empty.toml", "# nothing\n")
        .with("bare.toml", "height = \"30 mN*m\"\n")
        .with("other.toml", "[set]\nheigth = \"30 mN*m\"\n");
    let knob = bundled("knob.whip");
    for (preset, says) in [
        ("onofri", "did you mean `onofrei`?"),
        ("mine.toml", "there is no file `mine.toml`"),
        ("empty.toml", "sets nothing"),
        ("bare.toml", "unknown key `height`"),
        ("other.toml", "`--preset` cannot be used as given"),
        (
            "open-g",
            "the preset `open-g` is for `keytar`, and the program has `knob`",
        ),
    ] {
        for command in ["run", "check", "budget"] {
            shell.refuses(2, &[command, &knob, "--preset", preset], &[says]);
        }
    }
}
