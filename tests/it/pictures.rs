//! Pictures of documents: what they show stands in a table (`tests/it/pictures.txt`), and the files
//! are those that it is about.
//!
//! ```text
//!   docs/pictures/click.svg: 27125 bytes, 63a1..    how large, and a hash of the bytes
//!     texts: click | travel (mm) | ..               every text, in the order of the page
//!     #0077bb: 3 lines, 812 knots, 58 .. 780 by 75.2 .. 419    per colour, with their extents
//! ```
//!
//! A picture that is not what a run draws fails with that text, old and new; `WHIPPEN_BLESS=1`
//! writes it and the picture.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Bytes of a picture, and of those whose forces swing as fast as they sound.
const BYTES_MAX: usize = 120_000;
const SOUNDING: [&str; 2] = [
    "instruments/pictures/bowed-violin.svg",
    "instruments/pictures/rubbed-bank.svg",
];
const BYTES_MAX_SOUNDING: usize = 450_000;

/// Tests on several threads rewrite one table.
static TABLE: Mutex<()> = Mutex::new(());

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn table_path() -> PathBuf {
    root().join("tests/it/pictures.txt")
}

/// A picture is what a run draws now. Its path is relative to the root.
#[track_caller]
pub fn compare_picture(path: &str, now: &str) {
    let _guard = TABLE.lock().unwrap_or_else(PoisonError::into_inner);
    let file = root().join(path);
    if std::env::var_os("WHIPPEN_BLESS").is_some() {
        std::fs::write(&file, now).unwrap_or_else(|e| panic!("{path}: {e}"));
        let mut table = entries();
        table.insert(path.to_string(), shown(now));
        let text = table
            .iter()
            .map(|(path, shown)| format!("{path}: {shown}\n"));
        std::fs::write(table_path(), text.collect::<String>()).expect("a writable table");
    }
    let listed = entries().remove(path);
    let listed = listed.unwrap_or_else(|| panic!("{path} is not in tests/it/pictures.txt"));
    assert_eq!(listed, shown(now), "{path} is not what a run draws now");
    let kept = std::fs::read_to_string(&file).unwrap_or_else(|e| panic!("{path}: {e}"));
    assert_eq!(
        shown(&kept),
        listed,
        "{path} is not the picture of the table"
    );
    let most = if SOUNDING.contains(&path) {
        BYTES_MAX_SOUNDING
    } else {
        BYTES_MAX
    };
    assert!(now.len() < most, "{path}: {} bytes", now.len());
}

/// The table: by path what a picture shows.
fn entries() -> BTreeMap<String, String> {
    let text = std::fs::read_to_string(table_path()).unwrap_or_default();
    let text = text.replace("\n ", "\u{0} ");
    let entry = |line: &str| {
        let (path, shown) = line.split_once(": ").expect("a path and what it shows");
        (path.to_string(), shown.replace('\u{0}', "\n"))
    };
    text.lines().map(entry).collect()
}

/// Lines of one colour.
#[derive(Default)]
struct Lines {
    count: usize,
    knots: usize,
    x: Option<(f64, f64)>,
    y: Option<(f64, f64)>,
}

/// What an SVG document shows.
fn shown(svg: &str) -> String {
    let mut texts = Vec::new();
    let mut colours: BTreeMap<&str, Lines> = BTreeMap::new();
    for line in svg.lines() {
        if let Some(text) = line.strip_suffix("</text>") {
            texts.extend(text.rsplit_once('>').map(|(_, text)| text));
        } else if let Some(rest) = line.strip_prefix("<path d=\"") {
            let (points, style) = rest.split_once('"').expect("a path ends");
            let colour = style.split('#').nth(1).map_or("", |colour| &colour[..6]);
            add(colours.entry(colour).or_default(), points);
        }
    }
    let mut text = format!("{} bytes, {:016x}", svg.len(), hash(svg.as_bytes()));
    let _ = write!(text, "\n  texts: {}", texts.join(" | "));
    for (colour, lines) in colours {
        let (x, y) = (lines.x.unwrap_or_default(), lines.y.unwrap_or_default());
        let _ = write!(
            text,
            "\n  #{colour}: {} lines, {} knots, {} .. {} by {} .. {}",
            lines.count, lines.knots, x.0, x.1, y.0, y.1
        );
    }
    text
}

fn add(lines: &mut Lines, path: &str) {
    let number = |text: &str| text.parse().unwrap_or_else(|e| panic!("{text}: {e}"));
    let wider = |range: &mut Option<(f64, f64)>, value: f64| {
        let (low, high) = range.unwrap_or((value, value));
        *range = Some((low.min(value), high.max(value)));
    };
    lines.count += path.matches('M').count();
    let knots = path.trim_end_matches('z').split(['M', 'L']);
    for knot in knots.filter(|knot| !knot.is_empty()) {
        let (x, y) = knot.split_once(' ').expect("two coordinates");
        lines.knots += 1;
        wider(&mut lines.x, number(x));
        wider(&mut lines.y, number(y));
    }
}

/// FNV-1a of 64 bits.
fn hash(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3)
    })
}

#[test]
fn what_a_picture_shows_is_told() {
    let svg = "<svg>\n<path d=\"M1 2L3 4.5M5 0L1 1\" stroke=\"#0077bb\"/>\n\
               <path d=\"M1 1L2 2L0 9z\" fill=\"#ffffff\"/>\n<text x=\"1\">travel (mm)</text>\n</svg>\n";
    let told = shown(svg);
    let (_, told) = told.split_once('\n').expect("lines");
    assert_eq!(
        told,
        "  texts: travel (mm)\n  #0077bb: 2 lines, 4 knots, 1 .. 5 by 0 .. 4.5\n  \
         #ffffff: 1 lines, 3 knots, 0 .. 2 by 1 .. 9"
    );
    assert_ne!(shown(svg), shown(&svg.replace("4.5", "4.4")));
    assert_ne!(hash(b"ab"), hash(b"ba"));
}

#[test]
fn every_picture_of_the_table_is_a_file_and_the_other_way_round() {
    let mut files = Vec::new();
    for folder in ["docs/pictures", "instruments/pictures"] {
        for entry in std::fs::read_dir(root().join(folder)).expect("a folder") {
            let name = entry.expect("an entry").file_name();
            files.push(format!("{folder}/{}", name.display()));
        }
    }
    files.sort();
    assert_eq!(files, entries().into_keys().collect::<Vec<_>>());
}
