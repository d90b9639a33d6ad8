//! Translation validation on the command line: of which modes and routines the bytes of an image
//! are shown to do what modes and Kernel say.

use std::fmt;

use serde_json::{Value, json};
use whippen_compiler::firmware::FirmwareImage;
use whippen_compiler::keyboard::ProgramId;
use whippen_compiler::mode_names::mode_names;
use whippen_compiler::validation::{NotValidated, Piece, Validation, validate_image};
use whippen_runtime::image::ImageInstrument;

use super::progress;
use super::setup::ImageSetup;
use crate::exit::Failure;

/// What is known of an image, none of whose code is refuted.
#[derive(Clone)]
pub struct Validated {
    all: Validation,
    /// The modes of a key in words, by instrument.
    names: Vec<Vec<String>>,
}

impl Validated {
    /// Validates an image.
    ///
    /// # Errors
    /// Bytes that do something else than their mode.
    pub fn of(
        setup: &ImageSetup,
        image: &FirmwareImage,
        instruments: &[ImageInstrument],
    ) -> Result<Validated, Failure> {
        let all = progress::during("the validation of the code", || {
            validate_image(image, &ImageInstrument::borrow_all(instruments))
        });
        if let Some(why) = all.refuted() {
            let why = format!("the code does not do what it was made of: {why}");
            return Err(Failure::Defect(why));
        }
        let own = setup.instruments.iter().zip(instruments);
        let names = own.map(|(own, image)| mode_names(&own.model, image.modes_of_zone()));
        let names = names.collect();
        Ok(Validated { all, names })
    }

    /// While one program plays.
    pub fn of_program(&self, program: ProgramId) -> Validated {
        Validated {
            all: self.all.of_program(program),
            names: self.names.clone(),
        }
    }

    /// One object.
    pub fn json(&self) -> Value {
        let not = self.all.not_validated();
        let [modes, routines] = self.all.validated();
        json!({
            "modes": self.all.modes(),
            "validated": modes,
            "routines": self.all.routines(),
            "validated_routines": routines,
            "not_validated": not.iter().map(|one| self.piece_json(one)).collect::<Vec<_>>(),
        })
    }

    /// Of a part its role stands for the name.
    fn piece_json(&self, one: &NotValidated) -> Value {
        let names = &self.names[one.zone.instrument.index()];
        let name = match (one.zone.part, one.piece) {
            (Some(part), _) => Some(part.to_string()),
            (None, Piece::Mode(mode)) => names.get(mode.0 as usize).cloned(),
            (None, Piece::Routine(_)) => None,
        };
        json!({
            "symbol": one.zone.symbol(one.piece),
            "mode": name,
            "reason": one.reason.name(),
            "why": one.why,
        })
    }
}

impl fmt::Display for Validated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.all.fmt(f)
    }
}
