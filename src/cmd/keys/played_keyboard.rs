//! The keyboard of a performance: its keys, and the one program that they play.

use whippen_compiler::check::{Program, note_name};
use whippen_compiler::keyboard::{self, Layout};
use whippen_compiler::model::Model;
use whippen_compiler::rate::Rate;
use whippen_runtime::emulated::EmulatedBoard;
use whippen_runtime::keyboard::PlayedProgram;
use whippen_runtime::session;

use super::{KeysArgs, Setup};
use crate::cmd::load;
use crate::exit::{Failure, Outcome};

/// The keyboard on which a performance is played.
pub struct PlayedKeyboard<'a> {
    pub name: Option<&'a str>,
    /// Its keys, and the one program that plays.
    pub layout: Layout,
    /// All instruments of the checked program.
    pub instruments: &'a [Model],
}

impl<'a> PlayedKeyboard<'a> {
    /// The program of the keyboard that was named, or its first; 88 keys of the named or only
    /// instrument, where there is no keyboard.
    pub fn find(
        program: &'a Program,
        name: Option<&'a str>,
        args: &'a KeysArgs,
    ) -> Result<PlayedKeyboard<'a>, Failure> {
        let name = args.program.as_deref().or(name);
        let Some(keyboard) = program.keyboards.first() else {
            let model = load::instrument(program, name)?;
            return Ok(PlayedKeyboard {
                name: None,
                layout: Layout::of_one_instrument(&model.name, 88, 21),
                instruments: std::slice::from_ref(model),
            });
        };
        let layout = &keyboard.layout;
        let found = match name {
            Some(name) => layout.program_named(name),
            None => layout.programs.first(),
        };
        let Some(found) = found else {
            let names: Vec<&str> = layout.programs.iter().map(|p| p.name.as_str()).collect();
            return Err(Failure::Usage(format!(
                "`{}` is no program of the keyboard `{}`; its programs are: {}",
                name.unwrap_or_default(),
                keyboard.name,
                names.join(", ")
            )));
        };
        Ok(PlayedKeyboard {
            name: Some(&keyboard.name),
            layout: Layout {
                programs: vec![found.clone()].into(),
                ..*layout
            },
            instruments: &program.instruments,
        })
    }

    /// With so many keys.
    pub fn with_keys(self, keys: u32) -> Result<PlayedKeyboard<'a>, Failure> {
        let layout = self.layout.with_keys(keys);
        let layout = layout.map_err(|e| Failure::Usage(format!("{e}: leave --keys away")))?;
        Ok(PlayedKeyboard { layout, ..self })
    }

    /// That its image on a board is proven, or need not be.
    pub fn prove(&self, setup: &Setup, on: EmulatedBoard) -> Outcome {
        let (layout, ids) = self.layout.only(|_| true);
        let models: Vec<&Model> = ids.iter().map(|id| &self.instruments[id.index()]).collect();
        let on_board = setup.on_board;
        on_board
            .prove(setup.map, &models, layout, setup.device, on.kind)
            .map(drop)
    }

    /// The program that plays.
    pub fn program(&self) -> &keyboard::Program {
        self.layout.program(keyboard::ProgramId(0))
    }

    /// What its keys drive: all have one device.
    pub fn driven(&self) -> &'static str {
        session::driven(self.model(0))
    }

    /// That program with its instruments.
    pub fn played(&self) -> PlayedProgram<'_> {
        PlayedProgram {
            program: self.program(),
            instruments: self.instruments,
        }
    }

    /// How many keys it has.
    pub fn keys(&self) -> usize {
        self.layout.keys as usize
    }

    /// What a key plays, by its index.
    pub fn model(&self, index: usize) -> &'a Model {
        let zones = &self.program().zones;
        let zone = self.program().zone_of_key(index as u32);
        &self.instruments[zone
            .unwrap_or(&zones[keyboard::ZoneId(0)])
            .instrument
            .index()]
    }

    /// Its instruments, each once.
    pub fn models(&self) -> impl Iterator<Item = &'a Model> {
        let instruments = self.instruments;
        let ids = self.program().instruments().into_iter();
        ids.map(|id| &instruments[id.index()])
    }

    /// Ticks per second.
    pub fn rate_hz(&self) -> Rate {
        self.model(0).rate_hz
    }

    /// The event of a key that is a strike.
    pub fn strike(&self, index: usize) -> Option<usize> {
        let emissions = &self.model(index).emissions;
        emissions.iter().position(|e| e.name == "note")
    }

    /// The names of its lowest and its highest key.
    pub fn ends(&self) -> (String, String) {
        let layout = &self.layout;
        (note_name(layout.first_note), note_name(layout.last_note()))
    }

    /// The name of a key, by its index.
    pub fn key_name(&self, index: u32) -> String {
        note_name(self.layout.note_of(index))
    }
}
