//! The table of the README: how many keys of each instrument are proven to fit. `WHIPPEN_BLESS=1` rewrites it.

use std::path::Path;
use std::process::Command;

use serde_json::Value;
use whippen_compiler::bundled::INSTRUMENTS;

/// Where the table stands.
const BEGIN: &str = "<!-- most keys -->\n";
const END: &str = "<!-- end of most keys -->\n";

/// `whippen budget FILE --most-keys --json`; none where there is no image.
fn budget(file: &str, name: Option<&str>) -> Option<Value> {
    let path = format!("instruments/{file}");
    let mut command = Command::new(env!("CARGO_BIN_EXE_whippen"));
    command.current_dir(env!("CARGO_MANIFEST_DIR")).args(["budget", &path]).args(name).args(["--most-keys", "--json"]);
    let output = command.output().expect("the command runs");
    (output.status.code() == Some(0)).then(|| serde_json::from_slice(&output.stdout).expect("JSON"))
}

fn table() -> String {
    let mut text =
        "| instrument | cycles of a key, at most | and waiting for memory | most keys, 44.1 kHz, two cores |\n\
                    | --- | --- | --- | --- |\n"
            .to_string();
    for compiled in crate::image::instruments() {
        let name = compiled.model.name.clone();
        let holds = |text: &str| text.contains(&format!("instrument {name} "));
        let file = INSTRUMENTS.iter().find(|(_, text)| holds(text)).map(|(file, _)| *file).expect("it is bundled");
        let Some(found) = budget(file, Some(&name)) else { continue };
        let key = &found["key"];
        let row = [&key["cycles_max"], &key["contention_cycles_max"], &found["keys"]].map(Value::to_string);
        text += &format!("| [{name}](instruments/{file}) | {} |\n", row.join(" | "));
    }
    text
}

#[test]
fn the_readme_lists_how_many_keys_fit() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md");
    let readme = std::fs::read_to_string(&path).expect("the README");
    let (before, rest) = readme.split_once(BEGIN).expect("the table begins");
    let (_, after) = rest.split_once(END).expect("the table ends");
    let new = format!("{before}{BEGIN}{}{END}{after}", table());
    if std::env::var_os("WHIPPEN_BLESS").is_some() {
        std::fs::write(&path, &new).expect("the README can be written");
    }
    let now = std::fs::read_to_string(&path).expect("the README");
    assert!(now == new, "bless with WHIPPEN_BLESS=1 cargo test --test bound readme:\n{}", table());
}
