//! Documents say what is so: their programs compile, their pictures are drawn again, the library's
//! signatures and the tool's words are compared.
//!
//! A block ```` ```whip ```` is a program; the file it is saved under is named in the line before
//! it (`click.whip`). An image after it is its run on the bundled gesture. A block ```` ```sh ````
//! followed by ```` ```text ```` is typed in a folder with the programs so far, and what comes out
//! is the text. A program that is wrong on purpose is ```` ```whip wrong ````. `WHIPPEN_BLESS=1
//! cargo test --test it documents` writes texts and pictures anew.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use whippen_compiler::bundled::{INSTRUMENTS, STD};
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::syntax::ast::Item;
use whippen_compiler::syntax::{parse, pretty};
use whippen_runtime::session;

use crate::common;
use crate::pictures::compare_picture;

/// Documents with programs that stand for themselves. The manual's are one program, which the
/// compiler's own tests read.
const DOCUMENTS: &[&str] = &["README.md", "docs/std.md", "docs/tutorial.md"];

/// A fenced block of a document.
#[derive(Debug, Clone, PartialEq)]
struct Block {
    /// What stands behind the fence (`whip`, `sh`).
    kind: String,
    text: String,
    /// The line before it that is not empty.
    before: String,
    /// The line after it that is not empty.
    after: String,
}

fn root(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

fn read(path: &str) -> String {
    std::fs::read_to_string(root(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

fn blessing() -> bool {
    std::env::var_os("WHIPPEN_BLESS").is_some()
}

fn blocks(document: &str) -> Vec<Block> {
    let mut parts = document.split("```");
    let mut before = parts.next().unwrap_or_default();
    let mut blocks = Vec::new();
    while let (Some(block), Some(after)) = (parts.next(), parts.next()) {
        let (kind, text) = block.split_once('\n').unwrap_or((block, ""));
        let last = |text: &str| {
            text.lines()
                .rev()
                .find(|l| !l.trim().is_empty())
                .unwrap_or_default()
                .to_string()
        };
        let first = |text: &str| {
            text.lines()
                .find(|l| !l.trim().is_empty())
                .unwrap_or_default()
                .to_string()
        };
        let (kind, text) = (kind.to_string(), text.to_string());
        blocks.push(Block {
            kind,
            text,
            before: last(before),
            after: first(after),
        });
        before = after;
    }
    blocks
}

/// The name in backquotes that a program is saved under.
fn file_name(line: &str) -> Option<&str> {
    line.split('`')
        .skip(1)
        .step_by(2)
        .find(|name| name.ends_with(".whip"))
}

/// The path of the picture of an image line.
fn picture(line: &str) -> Option<&str> {
    line.strip_prefix("![")?
        .split_once("](")?
        .1
        .strip_suffix(')')
}

/// The picture of a run on the bundled gesture, or the first seconds of it, as `whippen run
/// --plot` draws it.
fn drawn(compiled: &Compiled, seconds: f64) -> String {
    session::figure(compiled, &common::played(compiled, seconds)).svg()
}

#[test]
fn programs_of_the_documents_compile_and_look_as_pictured() {
    let (mut programs, mut pictures) = (0, 0);
    for document in DOCUMENTS {
        let all = blocks(&read(document));
        for (at, block) in all.iter().enumerate().filter(|(_, b)| b.kind == "whip") {
            let name = file_name(&block.before).unwrap_or(document);
            let compiled = common::compiled(name, &block.text, &[]);
            assert!(!compiled.is_empty(), "{document}: {}", block.text);
            programs += compiled.len();
            // Its picture stands before the next program.
            let until = all[at + 1..]
                .iter()
                .position(|b| b.kind.starts_with("whip"))
                .map_or(all.len(), |n| at + 1 + n);
            if let Some(path) = all[at..until].iter().find_map(|b| picture(&b.after)) {
                let folder = document.rsplit_once('/').map_or("", |(folder, _)| folder);
                let path = format!("{folder}/{path}");
                compare_picture(
                    path.trim_start_matches('/'),
                    &drawn(&compiled[0], f64::INFINITY),
                );
                pictures += 1;
            }
        }
    }
    println!("{programs} programs, {pictures} pictures");
    assert!(programs >= 20 && pictures >= 15);
}

#[test]
fn every_instrument_has_a_page_with_its_picture() {
    let index = read("instruments/README.md");
    for (file, _) in INSTRUMENTS {
        let name = file.strip_suffix(".whip").expect("a program");
        let page = read(&format!("instruments/{name}.md"));
        let path = format!("pictures/{name}.svg");
        assert!(
            page.lines().any(|line| picture(line) == Some(&path)),
            "{name}.md shows {path}"
        );
        let typed = format!("whippen run instruments/{file}");
        let command = page.lines().find(|line| line.starts_with(&typed));
        let command = command.unwrap_or_else(|| panic!("{name}.md says how to run it"));
        let words: Vec<&str> = command.split_whitespace().collect();
        let at = words.iter().position(|word| *word == "--seconds");
        let seconds = at.and_then(|at| words[at + 1].parse().ok());
        assert!(
            index.contains(file) && index.contains(&format!("{name}.md")),
            "the index names {name}"
        );
        let drawn = drawn(
            &common::instruments(file, &[])[0],
            seconds.unwrap_or(f64::INFINITY),
        );
        compare_picture(&format!("instruments/{path}"), &drawn);
    }
}

#[test]
fn the_library_is_documented_term_by_term_as_it_is() {
    let manual = read("docs/std.md");
    let mut signatures = BTreeSet::new();
    for (name, text) in STD {
        let file = parse(0, text, &mut Vec::new());
        for item in &file.items {
            let Item::Term(term) = item else {
                panic!("{name} holds something that is no term")
            };
            assert!(
                !term.doc.is_empty(),
                "{name}: `{}` has no documentation",
                term.name.node
            );
            let printed = pretty::print(&whippen_compiler::syntax::ast::File {
                items: vec![item.clone()],
            })
            .to_string();
            // A long head stands on several lines.
            let lines = printed.lines().skip_while(|l| !l.starts_with("term "));
            let head = lines
                .take_while(|l| *l != "{" && !l.starts_with("    let"))
                .collect::<Vec<_>>()
                .join(" ");
            let head = head
                .split('{')
                .next()
                .unwrap_or_default()
                .trim_start_matches("term ");
            let head = head.split_whitespace().collect::<Vec<_>>().join(" ");
            signatures.insert(head.replace("( ", "(").replace(", )", ")"));
        }
    }
    let documented: BTreeSet<String> = manual
        .lines()
        .filter(|l| l.starts_with('`') && l.contains(" -> "))
        .map(|l| l.trim_matches('`').to_string())
        .collect();
    assert_eq!(documented, signatures);
}

/// What a command prints, in a folder; the speed of this machine is nobody's business.
fn typed(line: &str, folder: &Path) -> String {
    let words: Vec<&str> = line.split_whitespace().collect();
    assert_eq!(words[0], "whippen", "{line}");
    let output = Command::new(env!("CARGO_BIN_EXE_whippen"))
        .args(&words[1..])
        .current_dir(folder)
        .output();
    let output = output.expect("the command starts");
    let text = [output.stdout, output.stderr].concat();
    let text = String::from_utf8(text).expect("UTF-8");
    text.lines()
        .map(|line| format!("{}\n", without_speed(line).trim_end()))
        .collect()
}

/// `.. engine jit, 286x real time` without its number.
fn without_speed(line: &str) -> String {
    match line.split_once(" on engine ") {
        Some((before, after)) if after.ends_with("x real time") => {
            format!(
                "{before} on engine {}, ..x real time",
                after.split(',').next().unwrap_or_default()
            )
        }
        _ => line.to_string(),
    }
}

/// The page of the split shows what the budget says of its cores.
#[test]
fn the_budget_of_the_split_is_what_its_page_shows() {
    let path = "instruments/split.md";
    let page = read(path);
    let command = blocks(&page)
        .into_iter()
        .find(|block| block.kind == "sh")
        .expect("a command")
        .text;
    let said = typed(command.trim(), &root("instruments"));
    let is_core = |line: &&str| line.starts_with("core ") || line.starts_with("  ");
    let cores = said
        .lines()
        .skip_while(|line| !line.starts_with("core 0"))
        .take_while(is_core);
    let shown: String = said
        .lines()
        .take(1)
        .chain([""])
        .chain(cores)
        .map(|line| format!("{line}\n"))
        .collect();
    let (before, rest) = page.split_once("```text\n").expect("a text");
    let (_, after) = rest.split_once("```").expect("its end");
    let now = format!("{before}```text\n{shown}```{after}");
    if blessing() {
        std::fs::write(root(path), &now).expect("writable");
    }
    assert_eq!(read(path), now);
}

/// Pages of instruments of an arm show what the budget says of them: what is proven, and how much
/// time they take, or by how much they are late.
#[test]
fn pages_show_what_the_budget_says() {
    let shown = ["core 0:", "numbers:", "stability", "motor:", "[WH0701]"];
    for name in ["rubbed-bank", "keytar", "bowed-violin"] {
        let path = format!("instruments/{name}.md");
        let page = read(&path);
        let said = typed(
            &format!("whippen budget instruments/{name}.whip"),
            &root(""),
        );
        let said: String = said
            .lines()
            .filter(|line| shown.iter().any(|begin| line.starts_with(begin)))
            .map(|line| format!("{line}\n"))
            .collect();
        assert!(said.contains("numbers: no overflow"), "{name}: {said}");
        let (before, rest) = page.split_once("```text\n").expect("a text");
        let (_, after) = rest.split_once("```").expect("its end");
        let now = format!("{before}```text\n{said}```{after}");
        if blessing() {
            std::fs::write(root(&path), &now).expect("writable");
        }
        assert_eq!(read(&path), now);
    }
}

#[test]
fn what_the_tutorial_types_prints_what_it_shows() {
    let path = "docs/tutorial.md";
    let mut document = read(path);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let all = blocks(&document);
    let mut commands = 0;
    for (block, next) in all.iter().zip(all.iter().skip(1).chain([&all[0]])) {
        if let (true, Some(name)) = (block.kind.starts_with("whip"), file_name(&block.before)) {
            std::fs::write(folder.path().join(name), &block.text).expect("writable");
        }
        if block.kind != "sh" {
            continue;
        }
        let said: String = block
            .text
            .lines()
            .map(|line| typed(line, folder.path()))
            .collect();
        assert!(!said.contains("panicked"), "{said}");
        commands += 1;
        if next.kind != "text" {
            continue;
        }
        if blessing() {
            let at = document.find(&block.text).expect("the block") + block.text.len();
            let (from, to) = (
                format!("```text\n{}```", next.text),
                format!("```text\n{said}```"),
            );
            let behind = document[at..].replacen(&from, &to, 1);
            document.truncate(at);
            document += &behind;
        } else {
            assert_eq!(said, next.text, "{}", block.text);
        }
    }
    if blessing() {
        std::fs::write(root(path), document).expect("writable");
    }
    assert!(commands >= 10, "{commands} commands");
}
