//! What a program costs on a board: how many keys fit, and the cycles of its lines. It is what
//! `whippen budget` proves, for the instruments and the keyboard of the document.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::Path;

use whippen_compiler::Memo;
use whippen_compiler::board::Board;
use whippen_compiler::check::{Keyboard, Options, Program};
use whippen_compiler::front::compile_front;
use whippen_compiler::image::Place;
use whippen_compiler::keyboard::Layout;
use whippen_compiler::model::Model;
use whippen_compiler::source::{SourceMap, Span};
use whippen_runtime::device::Device;
use whippen_runtime::image::ImageInstrument;

use super::uri;
use crate::beside::Source;
use crate::cmd::proof::{ImageProof, ProgramReport};
use crate::cmd::setup::{FIRST_NOTE, ImageSetup, find_board, usual_keys};
use crate::device;
use crate::exit::Failure;
use crate::table_text::BESIDE_URIS;

/// What is proven of a document's cycles.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Cost {
    /// What fits, by the declaration that it is said of.
    pub fits: Vec<(Span, String)>,
    /// Cycles by line (from 0): the most that an instrument of the document takes there in its
    /// worst mode, with nobody else at the bus.
    pub lines: BTreeMap<u32, u64>,
}

/// What is proven of an instrument or of a chip, wherever its text stands.
#[derive(Debug)]
pub struct Known {
    said: Vec<String>,
    /// Cycles on the worst path through a key, by the number of their place.
    cycles: Vec<(usize, u64)>,
}

/// Proofs that are kept, for a comment or another live value asks for no other: of a dozen
/// documents some of each.
pub const KNOWN_MAX: usize = 64;

/// The cost of the first file of a program on a board; nothing of a program that is not right.
///
/// # Errors
/// There is no such board.
pub fn cost(program: &[Source], board: &OsStr, known: &Memo<Known>) -> Result<Cost, String> {
    let mut map = SourceMap::default();
    for source in program {
        map.add(&source.name, &source.text);
    }
    let options = Options {
        read: BESIDE_URIS,
        ..Options::default()
    };
    let (checked, _) = compile_front(&mut map, &options);
    let mut cost = Cost::default();
    let Some(checked) = checked else {
        return Ok(cost);
    };
    let keyboard = checked.keyboards.first();
    let own = keyboard.filter(|own| own.board.is_some());
    let board = find_board(Some(board).filter(|_| own.is_none()), own).map_err(in_words)?;
    let folder = |uri: &str| uri::path(uri)?.parent().map(Path::to_path_buf);
    let named = keyboard.map(|keyboard| device::of_keyboard(keyboard, &map, folder));
    // A device that cannot be used is told by the diagnostics.
    let Ok(named) = named.unwrap_or(Ok(None)) else {
        return Ok(cost);
    };
    let proofs = Proofs {
        map: &map,
        board: &board,
        named: named.as_ref(),
        known,
    };
    for model in checked.instruments.iter().filter(|m| m.span.file == 0) {
        proofs.add_instrument(&mut cost, &checked, model);
    }
    for keyboard in checked.keyboards.iter().filter(|k| k.span.file == 0) {
        proofs.add_keyboard(&mut cost, &checked, keyboard);
    }
    Ok(cost)
}

/// Proofs of a document, and what they share.
struct Proofs<'a> {
    map: &'a SourceMap,
    board: &'a Board,
    /// The keyboard's device.
    named: Option<&'a Device>,
    known: &'a Memo<Known>,
}

impl Proofs<'_> {
    fn setup(&self, models: &[&Model], layout: Layout) -> Result<ImageSetup, Failure> {
        let device = Device::fitting(self.named, models[0]);
        let setup = ImageSetup::of_board(self.map, models, layout, &device, self.board.clone())?;
        setup.check_supported()?;
        Ok(setup)
    }

    /// An instrument on as many keys as fit, or once.
    fn add_instrument(&self, cost: &mut Cost, program: &Program, model: &Model) {
        let first_note = program.keyboards.first();
        let first_note = first_note.map_or(FIRST_NOTE, |own| own.layout.first_note);
        let layout = Layout::of_one_instrument(&model.name, usual_keys(model), first_note);
        let said = self.setup(&[model], layout).and_then(|setup| {
            let mut instruments = setup.image_instruments()?;
            let places = numbered_places(&mut instruments[0]);
            let is_of_key = model.is_of_key();
            let prove = || self.prove_most(&setup, &instruments, is_of_key);
            let known = (self.known).get_or_make(&setup.origin(&instruments), prove)?;
            self.add_lines(cost, &known, &places);
            Ok(known.said[0].clone())
        });
        let said = said.unwrap_or_else(|why| self.no_budget(why));
        cost.fits.push((model.span, said));
    }

    /// An instrument on as many keys as fit, or once.
    fn prove_most(
        &self,
        setup: &ImageSetup,
        instruments: &[ImageInstrument],
        is_of_key: bool,
    ) -> Result<Known, Failure> {
        let (proof, most) = ImageProof::wanted(setup, instruments, is_of_key)?;
        let played = &proof.programs[0];
        let of_path = proof.bytes.by_place(&played.worst_case().bound.path);
        let numbered = of_path.into_iter();
        let numbered = numbered.filter_map(|(place, cycles)| Some((place?.line as usize, cycles)));
        Ok(Known {
            said: vec![self.words(played, most)],
            cycles: numbered.collect(),
        })
    }

    /// A keyboard with its keys, by its programs.
    fn add_keyboard(&self, cost: &mut Cost, program: &Program, keyboard: &Keyboard) {
        let (layout, used) = keyboard.layout.only(|_| true);
        let models: Vec<&Model> = (used.iter())
            .map(|id| &program.instruments[id.index()])
            .collect();
        if models.is_empty() {
            return;
        }
        let said = self.setup(&models, layout).and_then(|setup| {
            let instruments = setup.image_instruments()?;
            let mut said = Vec::new();
            for chip in setup.on_chips(keyboard.chips).of_chips()? {
                let own = chip.with_own_keys(&instruments);
                let prove = || prove_chip(&chip, &own);
                let known = self.known.get_or_make(&(CHIP, chip.origin(&own)), prove)?;
                said.extend(known.said.iter().cloned());
            }
            Ok(said)
        });
        let said = said.unwrap_or_else(|why| vec![self.no_budget(why)]);
        let each = said.into_iter().map(|said| (keyboard.span, said));
        cost.fits.extend(each);
    }

    fn words(&self, played: &ProgramReport, most: Option<u32>) -> String {
        let (budget, board) = (&played.budget, &self.board.name);
        let (alone, key) = (budget.key_cycles_max, budget.contended_key_cycles_max);
        match most {
            None => format!("{board}: {}", tick(played)),
            Some(0) => format!(
                "{board}: not one key a core fits, {}: a key takes up to {key}",
                tick(played)
            ),
            Some(keys) => format!(
                "{board}: {keys} keys fit, {alone} + {} cycles a key",
                key - alone
            ),
        }
    }

    fn no_budget(&self, why: Failure) -> String {
        format!("{}: no budget: {}", self.board.name, in_words(why))
    }

    /// Adds the lines of the document on the worst path through a key.
    fn add_lines(&self, cost: &mut Cost, known: &Known, places: &[Place]) {
        let document = &self.map.files()[0].name;
        let mut lines: BTreeMap<u32, u64> = BTreeMap::new();
        for (number, cycles) in &known.cycles {
            let place = places.get(*number);
            if let Some(place) = place.filter(|place| place.file == *document) {
                *lines.entry(place.line - 1).or_default() += cycles;
            }
        }
        for (line, cycles) in lines {
            let most = cost.lines.entry(line).or_default();
            *most = cycles.max(*most);
        }
    }
}

/// The places of an instrument, which is left with their numbers.
fn numbered_places(instrument: &mut ImageInstrument) -> Vec<Place> {
    let number = |line| Place {
        file: String::new(),
        line,
        item: String::new(),
    };
    let numbers = (0..instrument.places.len() as u32).map(number).collect();
    std::mem::replace(&mut instrument.places, numbers)
}

/// What tells the proof of a chip from that of an instrument on as many keys as fit.
const CHIP: &str = "chip";

/// A chip, or the board where there is only one, with its keys.
fn prove_chip(chip: &ImageSetup, own: &[ImageInstrument]) -> Result<Known, Failure> {
    let keys = chip.keys;
    let proof = ImageProof::find(chip, own, keys)?;
    let of = (chip.chip).map_or(String::new(), |chip| format!("{}, ", chip.told()));
    let words = |played: &ProgramReport| {
        let name = &played.program.name;
        format!("{name}: {of}{keys} keys, {}", tick(played))
    };
    Ok(Known {
        said: proof.programs.iter().map(words).collect(),
        cycles: Vec::new(),
    })
}

/// Whether a tick is in time.
fn tick(played: &ProgramReport) -> String {
    let budget = &played.budget;
    let cycles = budget.cores.iter().map(|core| core.cycles_max).max();
    let late = if budget.fits() { "" } else { "too slow, " };
    format!(
        "{late}{} of {} cycles a tick",
        cycles.unwrap_or(0),
        budget.period_cycles
    )
}

fn in_words(why: Failure) -> String {
    match why {
        Failure::Full(_) => "it does not fit its memory".to_string(),
        Failure::Usage(message) | Failure::Defect(message) => message,
        Failure::Program => "the program is wrong".to_string(),
        Failure::Interrupted => "it was interrupted".to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use whippen_compiler::bundled::INSTRUMENTS;

    fn cost_of(text: &str, known: &Memo<Known>) -> Cost {
        let source = Source {
            name: "key.whip".to_string(),
            text: text.to_string(),
        };
        let found = cost(&[source], OsStr::new("rp2350"), known);
        found.expect("there is that board")
    }

    fn anew(text: &str) -> Cost {
        cost_of(text, &Memo::new(KNOWN_MAX))
    }

    /// The same program with another first value of each of its live parameters; none where it has
    /// no such parameter.
    fn with_other_values(text: &str) -> Option<String> {
        let other = |line: &str| {
            let (declared, value) = line.split_once('=')?;
            declared.trim_start().strip_prefix("live param ")?;
            let value = value.trim_start();
            let at = line.len() - value.len();
            if let Some(rest) = value.strip_prefix("on").or(value.strip_prefix("off")) {
                let flipped = if value.starts_with("on") { "off" } else { "on" };
                return Some(format!("{}{flipped}{rest}", &line[..at]));
            }
            let (_, range) = value.split_once(" in ")?;
            let high = range.split("//").next()?.split("..").nth(1)?.trim();
            Some(format!("{}{high} in {range}", &line[..at]))
        };
        let lines = text.lines();
        let changed = lines.map(|line| other(line).unwrap_or_else(|| line.to_string()) + "\n");
        let changed: String = changed.collect();
        (changed != text).then_some(changed)
    }

    const FEW: [&str; 6] = [
        "baker.whip",
        "hammond.whip",
        "harpsichord.whip",
        "knob.whip",
        "tracker-organ.whip",
        "virtual-spring.whip",
    ];

    /// Memory alone holds first values, and no bound rests on these: what is proven of some is
    /// what is proven of others.
    #[test]
    fn other_first_values_and_comments_have_the_cost_that_is_known() {
        let mut changed = 0;
        for (name, text) in INSTRUMENTS.iter().filter(|(name, _)| FEW.contains(name)) {
            let known = Memo::new(KNOWN_MAX);
            let first = cost_of(text, &known);
            assert_eq!(first, anew(text), "{name}");
            let proofs = known.kept();
            if let Some(other) = with_other_values(text) {
                changed += 1;
                assert_eq!(cost_of(&other, &known), anew(&other), "{name}");
            }
            let moved = cost_of(&format!("// One line.\n{text}"), &known);
            let lines = moved.lines.iter().map(|(line, cycles)| (line - 1, *cycles));
            assert_eq!(lines.collect::<BTreeMap<_, _>>(), first.lines, "{name}");
            assert_eq!(known.kept(), proofs, "{name}");
        }
        assert_eq!(changed, FEW.len());
    }

    const KEYBOARD: &str = "\
instrument key {
    sense x: length in 0 mm .. 10 mm over 1 ms
    live param k = 100 N/m in 0 N/m .. 1000 N/m
    param stop = 8 mm
    force spring = spring(x, k: k, rest: 0 mm).push
    force wall = spring(x, k: 2e3 N/m, rest: stop).push
}
keyboard small {
    board rp2350
    rate 44100 Hz
    keys A0 .. E1
    programs key
    key.k = { A0: 200 N/m, C1: 220 N/m, E1: 300 N/m }
}
";

    /// And whatever else is changed is proven anew, unless it was proven before.
    #[test]
    fn what_bounds_follow_from_is_proven_anew() {
        let known = Memo::new(KNOWN_MAX);
        let first = cost_of(KEYBOARD, &known);
        assert_eq!(first, anew(KEYBOARD));
        assert_eq!(known.kept(), 2, "an instrument and a keyboard: {first:?}");
        let change = |from: &str, to: &str| {
            let changed = KEYBOARD.replace(from, to);
            assert_ne!(changed, KEYBOARD);
            assert_eq!(cost_of(&changed, &known), anew(&changed), "{changed}");
            known.kept()
        };
        let both = 2;
        let mut proofs = known.kept();
        let mut more = |from: &str, to: &str| {
            let kept = change(from, to);
            kept - std::mem::replace(&mut proofs, kept)
        };
        assert_eq!(more("C1: 220 N/m", "C1: 260 N/m"), 0);
        assert_eq!(more("= 100 N/m in", "= 90 N/m in"), 0);
        assert_eq!(more("stop = 8 mm", "stop = 7 mm"), both);
        assert_eq!(
            more("A0 .. E1\n", "A0 .. D#1\n"),
            both,
            "values per key, and their range"
        );
        assert_eq!(more("    key.k = ", "    // key.k = "), both);
        assert_eq!(more("rp2350\n", "rp2350 * 2\n"), 2, "of each chip");
        assert_eq!(more("rp2350\n", "rp2040\n"), both);
        assert_eq!(more("44100 Hz", "20 kHz"), both);
        assert_eq!(more("small {", "other {"), 0);
        assert_eq!(more("sense x", "sense  x"), 0);
    }
}
