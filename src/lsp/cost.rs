//! What a program costs on a board: how many keys fit, and the cycles of its lines. It is what
//! `whippen budget` proves, for the instruments and the keyboard of the document.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::Path;

use whippen_compiler::board::Board;
use whippen_compiler::check::{Keyboard, Options, Program};
use whippen_compiler::front::compile_front;
use whippen_compiler::keyboard::Layout;
use whippen_compiler::model::Model;
use whippen_compiler::source::{SourceMap, Span};
use whippen_runtime::device::Device;

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

/// The cost of the first file of a program on a board; nothing of a program that is not right.
///
/// # Errors
/// There is no such board.
pub fn cost(program: &[Source], board: &OsStr) -> Result<Cost, String> {
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
            let instruments = setup.image_instruments()?;
            let (proof, most) = ImageProof::wanted(&setup, &instruments, model.is_of_key())?;
            let played = &proof.programs[0];
            self.add_lines(cost, &proof, played);
            Ok(self.words(played, most))
        });
        let said = said.unwrap_or_else(|why| self.no_budget(why));
        cost.fits.push((model.span, said));
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
                let (keys, own) = (chip.keys, chip.with_own_keys(&instruments));
                let proof = ImageProof::find(&chip, &own, keys)?;
                let of = chip
                    .chip
                    .map_or(String::new(), |chip| format!("{}, ", chip.told()));
                let words = |played: &ProgramReport| {
                    let name = &played.program.name;
                    format!("{name}: {of}{keys} keys, {}", tick(played))
                };
                said.extend(proof.programs.iter().map(words));
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
    fn add_lines(&self, cost: &mut Cost, proof: &ImageProof, played: &ProgramReport) {
        let document = &self.map.files()[0].name;
        let mut lines: BTreeMap<u32, u64> = BTreeMap::new();
        for (place, cycles) in proof.bytes.by_place(&played.worst_case().bound.path) {
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
