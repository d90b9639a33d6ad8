//! The grammar for Tree-sitter against the compiler's parser: which texts are right, and where
//! units end.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use whippen_lang::bundled::{INSTRUMENTS, STD};
use whippen_lang::syntax::parse;
use whippen_lang::syntax::token::{Token, lex};
use whippen_lang::units::unit_names;

/// Folders with programs, right and wrong, from the top of the repository.
const FOLDERS: &[&str] = &[
    "fuzz/corpus/check",
    "fuzz/corpus/lex",
    "fuzz/corpus/lower",
    "fuzz/corpus/parse",
    "src/cmd/new",
    "tests/filetests/whip/check",
    "tests/filetests/whip/lower",
    "tests/filetests/whip/mistakes",
    "tests/filetests/whip/parse",
    "tests/filetests/whip/simplify",
    "tests/programs",
];

/// Texts that Tree-sitter takes and the compiler does not, and why.
const DIFFERENT: &[(&str, &str)] = &[
    ("fuzz/corpus/parse/nested.whip", "nested too deep"),
    ("fuzz/corpus/parse/not.whip", "nested too deep"),
    (
        "tests/filetests/whip/mistakes/chained.whip",
        "comparisons in a chain",
    ),
    (
        "tests/filetests/whip/mistakes/unknown_unit.whip",
        "a number whose unit goes on with what is none",
    ),
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Every text with its name; of a filetest what stands above its expectations.
fn texts() -> Vec<(String, String)> {
    let bundled = INSTRUMENTS.iter().chain(STD);
    let mut texts: Vec<_> = bundled
        .map(|(name, text)| (name.to_string(), text.to_string()))
        .collect();
    for folder in FOLDERS {
        let entries =
            std::fs::read_dir(root().join(folder)).unwrap_or_else(|e| panic!("{folder}: {e}"));
        let mut paths: Vec<PathBuf> = entries
            .map(|entry| entry.expect("it is read").path())
            .collect();
        paths.retain(|path| path.extension().is_some_and(|ending| ending == "whip"));
        paths.sort();
        assert!(!paths.is_empty(), "{folder}");
        for path in paths {
            let bytes = std::fs::read(&path).expect("it is there");
            // What is no text reaches neither of them.
            let Ok(text) = String::from_utf8(bytes) else {
                continue;
            };
            let body = text.find("\n==== ").map_or(&text[..], |end| &text[..end]);
            let name = path.strip_prefix(root()).expect("it lies there");
            texts.push((name.display().to_string(), body.to_string()));
        }
    }
    texts
}

/// The shared library of both C files.
fn library(folder: &Path) -> Option<PathBuf> {
    let gcc = whippen_need::tool("gcc")?;
    let source = root().join("editors/tree-sitter-whip/src");
    let made = folder.join("whip.so");
    let output = Command::new(gcc)
        .args([
            "-shared", "-fPIC", "-O1", "-Wall", "-Wextra", "-Werror", "-I",
        ])
        .arg(&source)
        .args([source.join("parser.c"), source.join("scanner.c")])
        .arg("-o")
        .arg(&made)
        .output()
        .expect("gcc starts");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    Some(made)
}

/// For each text whether Tree-sitter reads all of it, where not, how many places have a colour, and
/// the units.
fn read_by_tree_sitter(texts: &[(String, String)]) -> Option<Vec<[String; 4]>> {
    let folder = tempfile::tempdir().expect("a folder");
    let library = library(folder.path())?;
    let python = whippen_need::python("tree_sitter")?;
    let mut list = String::new();
    for (index, (_, text)) in texts.iter().enumerate() {
        let path = folder.path().join(index.to_string());
        std::fs::write(&path, text).expect("it is written");
        list += &format!("{}\n", path.display());
    }
    let mut child = Command::new(python)
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/tree_sitter/parse.py"))
        .arg(library)
        .arg(root().join("editors/tree-sitter-whip/queries/highlights.scm"))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("python starts");
    let mut input = child.stdin.take().expect("it is piped");
    std::io::Write::write_all(&mut input, list.as_bytes()).expect("it reads");
    drop(input);
    let output = child.wait_with_output().expect("it ends");
    assert!(output.status.success());
    let lines = String::from_utf8(output.stdout).expect("it is text");
    let parts = |line: &str| {
        let mut parts = line.splitn(4, ' ').map(str::to_string);
        std::array::from_fn(|_| parts.next().unwrap_or_default())
    };
    Some(lines.lines().map(parts).collect())
}

#[test]
fn both_take_the_same_texts_and_the_same_units() {
    let texts = texts();
    assert!(texts.len() > 200, "only {} texts", texts.len());
    let Some(read) = read_by_tree_sitter(&texts) else {
        return;
    };
    assert_eq!(read.len(), texts.len());
    let mut found = Vec::new();
    let mut seen = [0, 0];
    for ((name, text), [wrong, place, colours, units]) in texts.iter().zip(&read) {
        let mut diagnostics = Vec::new();
        parse(0, text, &mut diagnostics);
        let right = diagnostics.is_empty();
        seen[usize::from(right)] += 1;
        let known = DIFFERENT.iter().any(|(file, _)| file == name);
        if (right == (wrong == "0")) == known {
            found.push(format!(
                "{name}: the compiler {right}, tree-sitter at {place}"
            ));
        }
        let tokens = lex(0, text, &mut Vec::new()).tokens;
        let expected: Vec<&str> = tokens
            .iter()
            .filter_map(|token| match token.node {
                Token::Number(number) if !number.unit.is_empty() => Some(number.unit),
                _ => None,
            })
            .collect();
        let coloured: usize = colours.parse().expect("a number");
        if right && coloured < tokens.len() {
            found.push(format!(
                "{name}: {coloured} colours, {} tokens",
                tokens.len()
            ));
        }
        if right && expected.join(" ") != *units {
            found.push(format!(
                "{name}: units {units} and not {}",
                expected.join(" ")
            ));
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
    assert!(
        seen.iter().all(|count| *count > 30),
        "{seen:?} wrong and right"
    );
}

#[test]
fn the_scanner_knows_the_units_of_the_compiler() {
    let scanner = root().join("editors/tree-sitter-whip/src/scanner.c");
    let text = std::fs::read_to_string(scanner).expect("it is there");
    let table = text
        .split("UNITS[] = {")
        .nth(1)
        .and_then(|rest| rest.split('}').next())
        .expect("a table");
    let mut listed: Vec<&str> = table.split('"').skip(1).step_by(2).collect();
    let mut known: Vec<&str> = unit_names().collect();
    listed.sort_unstable();
    known.sort_unstable();
    assert_eq!(listed, known);
}
