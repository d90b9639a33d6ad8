//! The files that tables are read from, for the command line and for an editor.

use std::path::Path;

use whippen_compiler::check::FileReader;
use whippen_runtime::files::{InputKind, read_text};

use crate::device;
use crate::lsp::uri;

/// Reads relative to the folder of a program's file.
pub const BESIDE_FILES: FileReader = FileReader(|program, file| {
    let folder = device::folder_of(program).unwrap_or_default();
    text(&folder.join(file))
});

/// Reads relative to the folder of a program's URI.
pub const BESIDE_URIS: FileReader = FileReader(|program, file| {
    let path = uri::path(program);
    let folder = path.as_deref().and_then(Path::parent);
    text(&folder.unwrap_or(Path::new("")).join(file))
});

/// The text of a file; in words why there is none. What is no file, such as a pipe, could keep an
/// editor waiting.
pub fn text(path: &Path) -> Result<String, String> {
    if path.metadata().is_ok_and(|found| !found.is_file()) {
        return Err("it is no plain file".to_string());
    }
    read_text(path, InputKind::TABLE).map_err(|error| error.message)
}
