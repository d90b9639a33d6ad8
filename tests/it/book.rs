//! The book of the documents (`examples/book`): it has every document, its links lead to what is in
//! it, and its programs open in the studio as they stand there.

#[path = "../../examples/book/address.rs"]
pub mod address;
#[path = "../../examples/book/pages.rs"]
mod pages;
#[path = "../../examples/book/parts.rs"]
mod parts;

use std::collections::{BTreeMap, BTreeSet};
use std::io::Read;
use std::path::Path;
use std::sync::OnceLock;

use base64::Engine;
use base64::engine::general_purpose::URL_SAFE_NO_PAD;
use flate2::read::DeflateDecoder;
use serde_json::Value;
use whippen_compiler::bundled::{INSTRUMENTS, KEYBOARDS};
use whippen_compiler::diag::{Code, Severity};

/// The book, by path.
fn book() -> &'static pages::Book {
    static BOOK: OnceLock<pages::Book> = OnceLock::new();
    BOOK.get_or_init(|| {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        pages::book(root, true).expect("every document has its place, every link leads somewhere")
    })
}

/// Its documents as they are written there, by path from the root.
fn written() -> impl Iterator<Item = (&'static str, &'static str)> {
    book().files.iter().filter_map(|(path, bytes)| {
        let path = path.strip_prefix("src/")?;
        let is_document = path.ends_with(".md") && path != "SUMMARY.md";
        is_document.then(|| (path, std::str::from_utf8(bytes).expect("UTF-8")))
    })
}

/// The program of an address, as the studio reads it.
fn program(address: &str) -> (String, String) {
    let packed = URL_SAFE_NO_PAD.decode(address).expect("base64url");
    let mut object = String::new();
    let mut unpacked = DeflateDecoder::new(packed.as_slice());
    unpacked.read_to_string(&mut object).expect("raw deflate");
    let object: Value = serde_json::from_str(&object).expect("JSON");
    let text = |name: &str| object[name].as_str().expect("a text").to_string();
    (text("file"), text("text"))
}

/// The address of a link into the studio.
fn studio_address(link: &str) -> Option<&str> {
    let (page, rest) = link.split_once("studio.html#")?;
    page.replace("../", "")
        .is_empty()
        .then(|| rest.split(')').next().unwrap_or_default())
}

#[test]
fn every_document_is_a_chapter_once() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let summary = String::from_utf8(book().files["src/SUMMARY.md"].clone()).expect("UTF-8");
    let mut chapters: Vec<&str> = pages::links(&summary).collect();
    chapters.sort_unstable();
    let documents = pages::documents(root).expect("they are read");
    assert!(documents.len() > 200, "{} documents", documents.len());
    assert_eq!(chapters, documents.keys().collect::<Vec<_>>());
    let written: Vec<&str> = written().map(|(path, _)| path).collect();
    assert_eq!(written, chapters);
    assert_eq!(book().documents, chapters.len());
}

#[test]
fn without_a_studio_documents_are_as_they_stand_here() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let plain = pages::book(root, false).expect("a book");
    assert_eq!(plain.programs, 0);
    for (path, text) in pages::documents(root).expect("they are read") {
        assert_eq!(
            plain.files[&format!("src/{path}")],
            text.as_bytes(),
            "{path}"
        );
    }
}

#[test]
fn a_document_without_a_place_and_a_place_without_a_document_are_errors() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let documents = pages::documents(root).expect("they are read");
    let why = |documents: &BTreeMap<String, String>| parts::summary(documents).expect_err("wrong");
    let mut more = documents.clone();
    more.insert("lost.md".to_string(), "# Lost\n".to_string());
    assert!(why(&more).contains("lost.md is in no part"));
    let mut fewer = documents.clone();
    fewer.remove("docs/std.md");
    assert!(why(&fewer).contains("no docs/std.md is left"));
    let mut untitled = documents;
    untitled.insert("docs/std.md".to_string(), "Text\n".to_string());
    assert!(why(&untitled).contains("docs/std.md does not begin with its heading"));
}

/// What mdBook, as GitHub, calls the headings of a document.
fn anchors(text: &str) -> BTreeSet<String> {
    let mut fenced = false;
    let headings = text.lines().filter(|line| {
        fenced ^= line.starts_with("```");
        !fenced && line.starts_with('#')
    });
    let plain = |heading: &str| {
        let heading = heading.trim_start_matches('#').trim().to_lowercase();
        let kept = heading
            .chars()
            .filter(|c| c.is_alphanumeric() || " _-".contains(*c));
        kept.map(|c| if c == ' ' { '-' } else { c }).collect()
    };
    headings.map(plain).collect()
}

#[test]
fn every_link_leads_to_what_is_in_the_book() {
    let documents: BTreeMap<&str, &str> = written().collect();
    let (mut found, mut looked_at) = (Vec::new(), 0);
    for (path, text) in &documents {
        for link in text.split("](").skip(1) {
            let link = link.split([')', ' ']).next().unwrap_or_default();
            if link.is_empty() || link.contains(':') || studio_address(link).is_some() {
                continue;
            }
            looked_at += 1;
            let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
            let leads_to = match file {
                "" => path.to_string(),
                file => pages::leads_to(path, file),
            };
            let there = book().files.contains_key(&format!("src/{leads_to}"));
            let heading = documents.get(&*leads_to).map(|text| anchors(text));
            let has = heading.is_none_or(|all| anchor.is_empty() || all.contains(anchor));
            if !there || !has {
                found.push(format!("{path}: {link}"));
            }
        }
    }
    assert!(looked_at > 500, "{looked_at} links");
    assert!(found.is_empty(), "links lead nowhere: {found:#?}");
}

/// The blocks of a document that are programs, each with the line behind it that is not empty.
fn blocks(text: &str) -> Vec<(&str, &str)> {
    let parts: Vec<&str> = text.split("\n```").collect();
    let pairs = parts.windows(2).filter_map(|pair| {
        let program = pair[0].strip_prefix("whip\n")?;
        Some((program, pair[1].trim_start().lines().next().unwrap_or("")))
    });
    pairs.collect()
}

#[test]
fn an_address_holds_the_program_above_it() {
    let (mut linked, mut bare) = (0, 0);
    for (path, text) in written() {
        let depth = path.matches('/').count();
        for (block, after) in blocks(text) {
            let Some(link) = after.strip_prefix("[Open in the studio](") else {
                bare += 1;
                continue;
            };
            let address = studio_address(link).unwrap_or_else(|| panic!("{path}: {link}"));
            assert_eq!(link.matches("../").count(), depth, "{path}: {link}");
            let (file, program) = program(address);
            assert_eq!(program.trim_end(), block.trim_end(), "{path}: {file}");
            let plain = |c: char| c.is_ascii_alphanumeric() || "_.-".contains(c);
            assert!(file.ends_with(".whip") && file.chars().all(plain), "{file}");
            linked += 1;
        }
    }
    // What has no link is wrong on purpose, or a part of a program.
    println!("{linked} programs open, {bare} do not");
    assert!(linked > 150 && bare > 50);
}

#[test]
fn a_link_to_a_program_has_the_studio_behind_it() {
    let index = written().find(|(path, _)| *path == "instruments/README.md");
    let (_, index) = index.expect("the index of the instruments");
    for (file, text) in INSTRUMENTS.iter().chain(KEYBOARDS) {
        let behind = index.split(&format!("]({file}) ([studio](")).nth(1);
        // Two have a link to their page alone.
        let Some(behind) = behind else {
            assert!(!index.contains(&format!("]({file})")), "{file}");
            continue;
        };
        let address = studio_address(behind).expect("an address");
        assert_eq!(program(address), (file.to_string(), text.to_string()));
    }
    // A keyboard of instruments that are elsewhere opens only where the studio brings them.
    let register = written().find(|(path, _)| *path == "examples/register/README.md");
    let (_, register) = register.expect("the page of the keyboard");
    assert!(register.contains("](grand-88.whip) is"), "{register}");
}

/// Mistakes of a command line and of a board: the program itself compiles.
const OF_OTHERS: &[&str] = &["WH0609", "WH0701"];

#[test]
fn only_what_compiles_has_a_link() {
    for code in Code::ALL {
        let path = format!("compiler/lang/src/diag/pages/{}.md", code.number());
        let found = written().find(|(known, _)| *known == path);
        let mut links: Vec<bool> = blocks(found.expect("a page").1)
            .iter()
            .map(|(_, after)| after.starts_with("[Open in the studio]("))
            .collect();
        // Whoever is warned may open it; behind the mistake stands its mend.
        let opens = code.severity() != Severity::Error || OF_OTHERS.contains(&code.number());
        assert_eq!(links.pop(), Some(true), "{path}");
        assert!(links.iter().all(|link| *link == opens), "{path}: {links:?}");
    }
}
