//! The emulated board of `run`: which it is, how many keys it has, and the proof of its image.

use std::ffi::OsStr;

use whippen_compiler::budget::Budget;
use whippen_compiler::check::Program;
use whippen_compiler::firmware::FirmwareImage;
use whippen_compiler::keyboard::Layout;
use whippen_compiler::model::Model;
use whippen_compiler::source::SourceMap;
use whippen_emulator::BoardKind;
use whippen_runtime::device::Device;
use whippen_runtime::emulated::EmulatedBoard;
use whippen_runtime::engine::EngineKind;

use super::option;
use super::proof;
use super::setup::{FIRST_NOTE, ImageSetup, find_board};
use crate::exit::Failure;

#[derive(Debug, clap::Args)]
#[command(next_help_heading = "The emulated board")]
pub struct BoardArgs {
    /// The board of the engine emulated: rp2350, rp2040 or stm32f4; the keyboard's, or rp2350
    /// otherwise
    #[arg(long, value_name = "NAME", value_parser = emulated_board)]
    board: Option<BoardKind>,
    /// How many keys the board has: all do what the key does. With --midi, the keys of the
    /// keyboard
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = option::keys)]
    pub keys: Option<u32>,
    /// Run an image that is not proven to be in time
    #[arg(long)]
    unproven: bool,
}

impl BoardArgs {
    /// The engine, with its board if it has one.
    ///
    /// # Errors
    /// In words: what only a board has, or a board that cannot be emulated.
    pub fn engine(&self, engine: EngineKind, program: &Program) -> Result<EngineKind, String> {
        let Some(usual) = engine.board() else {
            let given = [
                ("--board", self.board.is_some()),
                ("--keys", self.keys.is_some()),
                ("--unproven", self.unproven),
            ];
            return match given.iter().find(|(_, given)| *given) {
                Some((option, _)) => Err(format!(
                    "{option} is for --engine emulated: the other engines have no board"
                )),
                None => Ok(engine),
            };
        };
        let keyboard = program.keyboards.first();
        let chips = keyboard.map_or(1, |keyboard| keyboard.chips);
        if self.board.is_none() && chips > 1 {
            return Err(format!(
                "the keyboard is on {chips} chips, and this plays on one: give it with --board, or \
                 play the images of `build` with `whippen emulate`"
            ));
        }
        let of_keyboard = keyboard.and_then(|keyboard| keyboard.board.as_deref());
        let kind = match (self.board, of_keyboard) {
            (Some(board), _) => board,
            (None, Some(name)) => emulated_board(name)?,
            (None, None) => usual.kind,
        };
        let keys = self.keys.unwrap_or(usual.keys);
        Ok(EngineKind::Emulated(EmulatedBoard { kind, keys }))
    }

    /// That the image of one instrument is proven, or need not be.
    ///
    /// # Errors
    /// As [`BoardArgs::prove`].
    pub fn prove_instrument(
        &self,
        map: &SourceMap,
        model: &Model,
        device: &Device,
        on: EmulatedBoard,
    ) -> Result<ProvenImage, Failure> {
        // What is no instrument of a key is played once, by the first core.
        let keys = match model.is_of_key() {
            true => on.keys.max(on.cores()),
            false => on.keys,
        };
        let layout = Layout::of_one_instrument(&model.name, keys, FIRST_NOTE);
        self.prove(map, &[model], layout, device, on.kind)
    }

    /// That the image of the first program of a layout is proven, or need not be.
    ///
    /// # Errors
    /// It is not in time, which is reported, or has no bound.
    pub fn prove(
        &self,
        map: &SourceMap,
        models: &[&Model],
        layout: Layout,
        device: &Device,
        kind: BoardKind,
    ) -> Result<ProvenImage, Failure> {
        let board = find_board(Some(OsStr::new(kind.name())), None)?;
        let setup = ImageSetup::of_board(map, models, layout, device, board)?;
        let instruments = setup.image_instruments()?;
        let image = setup.build(&instruments)?;
        let judged = proof::judge(&setup, &instruments, image.clone(), self.unproven)?;
        Ok(ProvenImage {
            image,
            budget: judged.budget,
        })
    }
}

/// An image that may run, whose code knows its lines.
pub struct ProvenImage {
    pub image: FirmwareImage,
    /// What is proven; none where there is no bound, and need not be.
    pub budget: Option<Budget>,
}

/// A board that can be emulated, by its name.
fn emulated_board(name: &str) -> Result<BoardKind, String> {
    let found = BoardKind::ALL.into_iter().find(|kind| kind.name() == name);
    found.ok_or_else(|| {
        let names = BoardKind::ALL.map(BoardKind::name);
        format!(
            "`{name}` cannot be emulated; boards that can are {}",
            names.join(", ")
        )
    })
}
