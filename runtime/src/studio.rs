//! The studio: a page with an editor and the whole command as a WebAssembly module, in one file
//! that needs no network.
//!
//! ```text
//!   whippen.wasm (WASI preview 1) --gzip, base64--> studio.html: module, files in memory (`wasi.js`), workers, editor, page
//! ```
//!
//! Whatever the page shows is the command's own output: `check`, `run --plot`, `page`, `budget`,
//! `build` and the language server, each run in a worker over files in memory.
//!
//! Not here: the module, which `studio/build-module` makes; the page that plays (`playable`).

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::{Compression, GzBuilder};
use serde_json::{Value, json};
use whippen_compiler::bundled::{INSTRUMENTS, KEYBOARDS, boards};

use crate::files::{FileError, write_whole};
use crate::report::script_json;

const STYLE: &str = include_str!("studio/page.css");
const BODY: &str = include_str!("studio/body.html");
const EDITOR_LIBRARY: &str = include_str!("studio/vendor/codemirror.iife.min.js");
/// What a worker runs, in this order.
const WASI: &str = include_str!("studio/wasi.js");
const WORKER: &str = include_str!("studio/worker.js");
/// The grammar that all editors colour by.
const GRAMMAR: &str = include_str!("studio/whip.tmLanguage.json");
/// The page's own scripts, in this order.
const SCRIPTS: &[&str] = &[
    include_str!("web_elements.js"),
    include_str!("studio/compiler.js"),
    include_str!("studio/language.js"),
    include_str!("studio/editor.js"),
    include_str!("studio/budget.js"),
    include_str!("studio/emulated.js"),
    include_str!("studio/page.js"),
];

/// Nothing is loaded from anywhere: workers, pictures and what is downloaded are the page's own,
/// and the page that plays stands in a frame of it, under the same policy.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval' data: blob:; worker-src blob:; \
     style-src 'unsafe-inline'; img-src data: blob:";

/// The bundled program that the studio begins with.
const FIRST: &str = "grand-piano.whip";

/// What every module begins with: the magic number and the version of the binary format.
const MAGIC: &[u8] = b"\0asm\x01\0\0\0";

/// The name of the imports of a module for WASI preview 1.
const IMPORTS: &[u8] = b"wasi_snapshot_preview1";

/// What the page calls the file that `whippen page` writes for it.
pub const PLAYABLE: &str = "touch.html";

/// The bundled program that the studio begins with: its file and its text.
pub fn first() -> (&'static str, &'static str) {
    let found = INSTRUMENTS.iter().find(|(file, _)| *file == FIRST);
    *found.expect("the first program is bundled")
}

/// Makes the studio of a module of the command and of the page that plays the first program
/// ([`first`]), which is heard while the module is still being read.
///
/// # Errors
/// The bytes are no module for WASI preview 1, in words.
pub fn page(module: &[u8], first_page: &str) -> Result<String, String> {
    if !module.starts_with(MAGIC) {
        return Err("it is no WebAssembly module".to_string());
    }
    if !module.windows(IMPORTS.len()).any(|part| part == IMPORTS) {
        return Err("it is a module for something else than WASI preview 1".to_string());
    }
    let packed = |bytes| compressed(bytes).map_err(|error| error.to_string());
    let (module, first_page) = (packed(module)?, packed(first_page.as_bytes())?);
    let mut html = String::with_capacity(2 * module.len());
    let _ = write!(
        html,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n\
         <title>Whippen studio</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n{BODY}"
    );
    for (id, kind, text) in [
        ("data", "application/json", script_json(&data())),
        (
            "grammar",
            "application/json",
            GRAMMAR.replace('<', "\\u003c"),
        ),
        ("wasi", "text/plain", WASI.to_string()),
        ("worker", "text/plain", WORKER.to_string()),
        ("first", "application/gzip", STANDARD.encode(&first_page)),
    ] {
        let _ = writeln!(html, "<script type=\"{kind}\" id=\"{id}\">{text}</script>");
    }
    let scripts = SCRIPTS.concat();
    // Most of the page is the compiler: what shows it and plays need not wait for it.
    let _ = write!(
        html,
        "<script>{EDITOR_LIBRARY}</script>\n<script>\n\"use strict\";\n(() => {{\n{scripts}}})();\n</script>\n\
         <script type=\"application/gzip\" id=\"compiler\">{}</script>\n</body>\n</html>\n",
        STANDARD.encode(&module)
    );
    Ok(html)
}

/// Writes the studio of a module to a file.
///
/// # Errors
/// The file cannot be written.
pub fn save(html: &str, path: &Path) -> Result<(), FileError> {
    write_whole(path, |w| w.write_all(html.as_bytes()))
}

/// The same bytes for the same bytes: no name and no time.
fn compressed(bytes: &[u8]) -> std::io::Result<Vec<u8>> {
    let mut packer = GzBuilder::new().write(Vec::new(), Compression::best());
    packer.write_all(bytes)?;
    packer.finish()
}

/// What the scripts must know: the bundled programs, and the boards.
fn data() -> Value {
    let example = |keyboard: bool| move |&(file, text): &(&str, &str)| json!({ "file": file, "text": text, "keyboard": keyboard });
    let instruments = INSTRUMENTS.iter().map(example(false));
    let examples = instruments.chain(KEYBOARDS.iter().map(example(true)));
    json!({ "first": FIRST, "playable": PLAYABLE, "boards": boards(), "examples": examples.collect::<Vec<_>>() })
}

#[cfg(test)]
mod tests {
    use super::{MAGIC, page};

    #[test]
    fn what_is_no_module_of_the_command_is_refused() {
        let why = |bytes: &[u8]| page(bytes, "").expect_err("is refused");
        assert_eq!(why(b"\x7fELF"), "it is no WebAssembly module");
        assert!(why(MAGIC).contains("WASI preview 1"));
    }

    #[test]
    fn the_page_loads_nothing_and_is_the_same_again() {
        let module = [MAGIC, b"wasi_snapshot_preview1"].concat();
        let html = page(&module, "<p>").expect("a page");
        for outside in ["src=\"http", "@import", "fetch(", "XMLHttpRequest"] {
            assert!(!html.contains(outside), "{outside}");
        }
        assert_eq!(html, page(&module, "<p>").expect("a page"));
    }
}
