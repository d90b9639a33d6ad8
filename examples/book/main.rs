//! The documents as an mdBook whose programs open in the studio (`docs/release.md`).
//!
//! ```text
//! cargo run --example book -- --out target/book --studio studio.html
//! mdbook build target/book
//! ```
//!
//! Documents, pictures and programs keep their folders, so that the links between them hold.
//!
//! Not here: how a page is drawn (mdBook), the studio (`whippen studio`).

mod address;
mod pages;
mod parts;

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use clap::Parser;

#[derive(Debug, Parser)]
struct Args {
    /// The folder of the book
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
    /// The page that programs open in, which `whippen studio` writes; without it none is linked
    #[arg(long, value_name = "FILE.html")]
    studio: Option<PathBuf>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let args = Args::parse();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let book = pages::book(root, args.studio.is_some())?;
    // What an older book had must not stay in a newer one.
    let sources = args.out.join("src");
    if sources.exists() {
        if !args.out.join("book.toml").exists() {
            return Err(format!("`{}` holds something else", args.out.display()).into());
        }
        fs::remove_dir_all(&sources)?;
    }
    for (path, bytes) in &book.files {
        let path = args.out.join(path);
        fs::create_dir_all(path.parent().expect("a file is in a folder"))?;
        fs::write(path, bytes)?;
    }
    if let Some(studio) = &args.studio {
        fs::copy(studio, sources.join(pages::STUDIO))?;
    }
    println!(
        "{}: {} documents, {} other files, {} programs that open in the studio",
        args.out.display(),
        book.documents,
        book.files.len() - book.documents,
        book.programs
    );
    Ok(())
}
