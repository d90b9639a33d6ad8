//! The files that tables are read from, for the command line and for an editor.

use std::path::Path;

use whippen_compiler::check::FileReader;

use crate::device;
use crate::lsp::uri;

/// Larger files (bytes) are no tables: 4096 rows take a twentieth of it.
const BYTES_MAX: u64 = 4 << 20;

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

/// The text of a file; in words why there is none.
pub fn text(path: &Path) -> Result<String, String> {
    let found = std::fs::metadata(path).map_err(|error| words(&error))?;
    if !found.is_file() {
        return Err("it is no plain file".to_string());
    }
    if found.len() > BYTES_MAX {
        return Err(format!("it is larger than {} MiB", BYTES_MAX >> 20));
    }
    let bytes = std::fs::read(path).map_err(|error| words(&error))?;
    String::from_utf8(bytes).map_err(|_| "it is no text".to_string())
}

fn words(error: &std::io::Error) -> String {
    match error.kind() {
        std::io::ErrorKind::NotFound => "there is no such file".to_string(),
        _ => error.to_string(),
    }
}
