//! `--firmware`: texts of a board of one's own, from a folder; and the bundled ones, written into
//! one.

use std::path::{Path, PathBuf};

use clap::ValueHint;
use whippen_compiler::board::Board;
use whippen_compiler::budget::NotBounded;
use whippen_compiler::diag::nearest;
use whippen_compiler::firmware::{
    FirmwareError, FirmwareImage, ImageError, OwnText, OwnTexts, all_texts, text_name,
};
use whippen_compiler::image::LinkError;
use whippen_runtime::files::{InputKind, read_text, reason, write_whole};

use crate::exit::{Failure, Outcome};
use crate::say::tell;

/// Folders of texts, and the prefix of the texts of each in a name.
const FOLDERS: [&str; 2] = ["", "v6m"];

#[derive(Debug, clap::Args)]
pub struct FirmwareArgs {
    /// Take the assembly texts of this folder in place of the firmware's of the same names, for a
    /// board of your own; for whole images
    #[arg(long, value_name = "FOLDER", value_hint = ValueHint::DirPath)]
    firmware: Option<PathBuf>,
}

impl FirmwareArgs {
    /// The texts, by their names in the folder.
    fn listed(&self) -> Result<Vec<(String, PathBuf)>, Failure> {
        let Some(folder) = &self.firmware else {
            return Ok(Vec::new());
        };
        let mut texts = Vec::new();
        for sub in FOLDERS {
            let at = folder.join(sub);
            if !sub.is_empty() && !at.is_dir() {
                continue;
            }
            let unreadable =
                |e| Failure::Usage(format!("--firmware `{}`: {}", at.display(), reason(&e)));
            for entry in at.read_dir().map_err(unreadable)? {
                let name = entry.map_err(unreadable)?.file_name();
                let name = Path::new(sub).join(name);
                if name.extension().is_some_and(|ending| ending == "s") {
                    texts.push((name.to_string_lossy().into_owned(), folder.join(name)));
                }
            }
        }
        texts.sort();
        if texts.is_empty() {
            let why = "has no text of a firmware, whose names end in `.s`";
            let folder = folder.display();
            return Err(Failure::Usage(format!("--firmware `{folder}` {why}")));
        }
        Ok(texts)
    }

    /// All files that are read; none where the folder cannot be.
    pub fn files(&self) -> Vec<PathBuf> {
        let texts = self.listed().unwrap_or_default();
        texts.into_iter().map(|(_, path)| path).collect()
    }

    /// What takes the place of bundled texts.
    pub fn texts(&self, board: &Board) -> Result<OwnTexts, Failure> {
        let mut texts = Vec::new();
        for (name, path) in self.listed()? {
            let text = read_text(&path, InputKind::DESCRIPTION);
            let text = text.map_err(|error| Failure::Usage(error.to_string()))?;
            let path = path.display().to_string();
            texts.push((name, OwnText { path, text }));
        }
        let own = OwnTexts::new(texts).map_err(|unknown| {
            let name = Path::new(&unknown.path).file_name();
            let name = name.map(|name| name.to_string_lossy().into_owned());
            let near = nearest(
                &name.unwrap_or_default(),
                unknown.known.iter().map(|s| &**s),
            );
            let near = near.map_or(String::new(), |near| format!("; did you mean {near}?"));
            Failure::Usage(format!("{unknown}{near}"))
        })?;
        if !own.is_empty() {
            tell_limits(&own, board);
        }
        Ok(own)
    }
}

/// What the bound does not hold of texts, and which of them no image of the board has.
fn tell_limits(own: &OwnTexts, board: &Board) {
    tell!(
        "note: the bound counts what the texts of --firmware do in a tick; that the clock runs at \
         {} Hz, that no DMA uses the cores' memory and that outputs are safe nobody proves \
         (docs/firmware.md)",
        board.clock_hz
    );
    if let Ok(texts) = all_texts(board, own) {
        for path in own.unused(&texts) {
            tell!(
                "note: {path} is not used: no image for {} has such a text",
                board.name
            );
        }
    }
    if board.cores > 1 {
        for path in own.counted() {
            tell!(
                "note: {path}: what it accesses of the other core's memory is charged as what the \
                 bundled text accesses"
            );
        }
    }
}

/// What is wrong with an image that has texts of the user's own.
pub fn own_failure(own: &OwnTexts, error: &ImageError) -> Option<Failure> {
    let is_of_texts = match error {
        ImageError::Firmware(FirmwareError::Assembly(_)) => true,
        ImageError::Link(error) => !matches!(error, LinkError::Full { .. }),
        _ => false,
    };
    if own.is_empty() || !is_of_texts {
        return None;
    }
    let what = match error {
        ImageError::Link(LinkError::Undefined { .. }) => {
            ": give a text of --firmware its `.global` label or `.equ`, or the board's file its \
             address under [device]"
        }
        ImageError::Link(LinkError::Twice { .. }) => {
            ": a text of --firmware has what another one has as well"
        }
        _ => "",
    };
    Some(Failure::Usage(format!("{error}{what}")))
}

/// Why an image has no bound, and in which function that is, where texts are the user's own.
#[derive(Debug)]
pub struct Unbounded {
    pub error: NotBounded,
    inside: Option<String>,
}

impl std::fmt::Display for Unbounded {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.inside {
            Some(name) => write!(f, "{} (in `{name}`)", self.error),
            None => self.error.fmt(f),
        }
    }
}

impl From<NotBounded> for Unbounded {
    fn from(error: NotBounded) -> Self {
        let inside = None;
        Self { error, inside }
    }
}

impl Unbounded {
    pub fn new(error: NotBounded, own: &OwnTexts, image: &FirmwareImage) -> Unbounded {
        let address = error.address().filter(|_| !own.is_empty());
        let symbols = image.image.symbols.iter();
        let inside = address.and_then(|address| {
            let before = symbols.filter(|symbol| symbol.address & !1 <= address);
            let last = before.max_by_key(|symbol| symbol.address);
            last.map(|symbol| symbol.name.clone())
        });
        Unbounded { error, inside }
    }
}

/// Where the bundled texts of a board are to be written.
#[derive(Debug)]
pub struct TextFiles<'a> {
    files: Vec<(PathBuf, &'a str)>,
}

impl<'a> TextFiles<'a> {
    /// Into a folder that has none of them.
    pub fn new(folder: &Path, board: &'a Board) -> Result<TextFiles<'a>, Failure> {
        let texts = all_texts(board, OwnTexts::NONE);
        let texts = texts.map_err(|error| Failure::Usage(error.to_string()))?;
        let file =
            |text: &whippen_compiler::asm::Source<'a>| (folder.join(text_name(text)), text.text);
        let files: Vec<(PathBuf, &str)> = texts.iter().map(file).collect();
        match files.iter().find(|(path, _)| path.exists()) {
            Some((path, _)) => Err(Failure::Usage(format!(
                "--firmware-texts: `{}` is there already; give it another folder",
                path.display()
            ))),
            None => Ok(TextFiles { files }),
        }
    }

    /// Writes them.
    pub fn write(&self) -> Outcome {
        for (path, text) in &self.files {
            let folder = path.parent().unwrap_or(Path::new("."));
            std::fs::create_dir_all(folder)
                .map_err(|e| Failure::Usage(format!("`{}`: {}", folder.display(), reason(&e))))?;
            let written = write_whole(path, |w| w.write_all(text.as_bytes()));
            written.map_err(|error| Failure::Usage(error.to_string()))?;
        }
        Ok(())
    }
}
