//! Inputs to begin with: the repository's own texts, and what once failed.

use std::path::{Path, PathBuf};

use whippen_compiler::diag::Code;

use crate::targets::Target;

/// Files of the repository that are good seeds, by their endings, below these folders.
const FOLDERS: &[&str] = &["instruments", "tests/filetests"];

/// Larger files slow everything down and show nothing new.
const LARGEST: u64 = 20_000;

/// A small recording, with titles and bare.
const TABLES: &[&str] = &[
    "t_s,x_mm\n0,0\n0.01,1\n0.02,2.5\n0.03,9\n",
    "t_ms,x_m,note\n0,0,a\n1e1,1e-3,b\n30,-0.0005,c\n",
    "0.1,5\n0.2,6\n0.3,7\n0.3,8\n",
    "mm,reading\n0,100\n5,200\n10,400\n",
];

/// The repository.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The inputs that once failed a target, by name.
pub fn findings(target: &Target) -> Vec<(String, Vec<u8>)> {
    let mut files = Vec::new();
    walk(&root().join("fuzz/corpus").join(target.name), &mut files);
    let named = |path: PathBuf| Some((path.display().to_string(), std::fs::read(&path).ok()?));
    files.into_iter().filter_map(named).collect()
}

/// Everything to begin with, in a fixed order.
pub fn of(target: &Target) -> Vec<Vec<u8>> {
    let mut files = Vec::new();
    FOLDERS
        .iter()
        .for_each(|folder| walk(&root().join(folder), &mut files));
    let fits = |path: &PathBuf| path.extension().is_some_and(|e| e == target.ending);
    let small = |path: &PathBuf| path.metadata().is_ok_and(|m| m.len() < LARGEST);
    let texts = files
        .into_iter()
        .filter(|p| fits(p) && small(p))
        .filter_map(|path| std::fs::read(path).ok());
    // Filetests end in what they print.
    let mut seeds: Vec<Vec<u8>> = texts
        .map(|text| before(&text, b"\n==== ").to_vec())
        .collect();
    match target.ending {
        "whip" => seeds.extend(
            Code::ALL
                .iter()
                .flat_map(|c| c.examples())
                .map(|(_, text)| text.as_bytes().to_vec()),
        ),
        "csv" => seeds.extend(TABLES.iter().map(|t| t.as_bytes().to_vec())),
        _ => {}
    }
    seeds.extend(findings(target).into_iter().map(|(_, bytes)| bytes));
    seeds
}

fn before<'b>(bytes: &'b [u8], mark: &[u8]) -> &'b [u8] {
    let at = bytes.windows(mark.len()).position(|window| window == mark);
    &bytes[..at.map_or(bytes.len(), |at| at + 1)]
}

fn walk(folder: &Path, found: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else {
        return;
    };
    let mut paths: Vec<PathBuf> = entries.flatten().map(|e| e.path()).collect();
    paths.sort();
    for path in paths {
        if path.is_dir() {
            walk(&path, found)
        } else {
            found.push(path)
        }
    }
}
