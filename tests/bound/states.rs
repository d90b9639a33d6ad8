//! The keys of one core on a bare machine: every key's mode, cells, live values and words can be
//! set.

use std::collections::HashMap;

use whippen_compiler::kernel::{Range, Type};
use whippen_compiler::keyboard::{CoreId, ProgramId};
use whippen_compiler::modes::ModeId;
use whippen_emulator::{Board, BoardKind, CoreKind, Machine, Observer, Register, Step, Stop};

use crate::image::Image;

/// No tick takes longer.
const CYCLES_MAX: u64 = 10_000_000;

/// What one key does next.
#[derive(Clone)]
pub struct Case {
    pub mode: usize,
    /// Word 0 of each cell.
    pub cells: Vec<i64>,
    pub word: u16,
}

struct Watch {
    places: HashMap<u32, Option<usize>>,
    began: Option<u64>,
    cycles: Vec<u64>,
}

impl Observer for Watch {
    fn instruction(&mut self, step: &Step<'_>) {
        if !self.places.contains_key(&step.address) {
            return;
        }
        self.cycles
            .extend(self.began.map(|began| step.cycle - began));
        self.began = Some(step.cycle);
    }
}

pub struct Keys<'a> {
    pub image: &'a Image,
    machine: Machine,
    state: u32,
    words: u32,
    watch: Watch,
}

impl<'a> Keys<'a> {
    /// Core 0 of an image with nobody else at the bus, its keys started.
    pub fn new(image: &'a Image) -> Keys<'a> {
        let board = Board::generic(CoreKind::CortexM33);
        Keys::on(Machine::new(board).expect("a board"), image)
    }

    /// The same where data wait for own fetches wherever they may.
    pub fn meeting_fetches(image: &'a Image) -> Keys<'a> {
        let board = Board {
            banks: BoardKind::Rp2350.board().banks,
            ..Board::generic(CoreKind::CortexM33)
        };
        let mut machine = Machine::new(board).expect("a board");
        machine.set_meets_fetches(true);
        Keys::on(machine, image)
    }

    fn on(mut machine: Machine, image: &'a Image) -> Keys<'a> {
        for section in image
            .whole
            .image
            .sections
            .iter()
            .filter(|section| !image.is_flash(&section.memory))
        {
            machine
                .bus
                .memory
                .write(section.run, &section.bytes)
                .expect("memory");
        }
        machine
            .cpu_mut(0)
            .set(Register::named("sp").expect("a register"), 0x2010_0000);
        let (state, words) = (image.symbol("core0_state"), image.symbol("words0"));
        let watch = Watch {
            places: image.places(0),
            began: None,
            cycles: Vec::new(),
        };
        let mut keys = Keys {
            image,
            machine,
            state,
            words,
            watch,
        };
        keys.call("core0_init");
        keys
    }

    fn call(&mut self, function: &str) {
        let (function, arguments) = (self.image.symbol(function), [self.state, self.words, 0, 0]);
        self.watch.began = None;
        self.watch.cycles.clear();
        let stop = self
            .machine
            .call_observed(function, arguments, CYCLES_MAX, &mut self.watch);
        assert!(
            matches!(stop, Stop::Returned { .. }),
            "{}: {stop}",
            self.image.name()
        );
    }

    fn write(&mut self, at: u32, word: u32) {
        self.machine
            .bus
            .memory
            .write(self.state + at, &word.to_le_bytes())
            .expect("memory");
    }

    /// One tick of these cases, key by key; the cycles of each. The ring of events is full or
    /// empty.
    pub fn tick(&mut self, cases: &[Case], lives: &[i64], full: bool) -> Vec<u64> {
        let layout = self.image.whole.program(ProgramId(0)).core(CoreId(0)).zones[0].layout();
        let (ring, modes) = (layout.events(), &self.image.modes);
        let kernel = &modes.kernel;
        let mut words: Vec<(u32, u32)> = Vec::new();
        for (live, value) in lives.iter().enumerate() {
            words.push((layout.live_param(live).expect("a place"), *value as u32));
        }
        for (key, case) in (0..).zip(cases) {
            words.push((
                layout.record(key),
                self.image.symbol(&format!("core0.mode.{}", case.mode)) | 1,
            ));
            for (index, (cell, value)) in kernel.cells.iter().zip(&case.cells).enumerate() {
                let at = layout.cell(key, index).expect("a place");
                words.push((at, *value as u32));
                if cell.ty == Type::I64 {
                    words.push((at + 4, (*value >> 32) as u32));
                }
            }
        }
        if let Some(ring) = ring {
            words.push((ring.tail, 0));
            words.push((ring.head, if full { ring.bytes } else { 0 }));
        }
        words
            .into_iter()
            .for_each(|(at, word)| self.write(at, word));
        for (key, case) in (0..).zip(cases) {
            self.machine
                .bus
                .memory
                .write(self.words + 2 * key, &case.word.to_le_bytes())
                .expect("memory");
        }
        self.call("core0_tick");
        assert_eq!(
            self.watch.cycles.len(),
            cases.len(),
            "{}: every key has been done",
            self.image.name()
        );
        self.watch.cycles.clone()
    }

    /// How many keys there are.
    pub fn count(&self) -> usize {
        self.image.keys[0] as usize
    }

    /// Where a mode's cells lie.
    pub fn ranges(&self, mode: usize) -> &[Range] {
        &self.image.modes.modes[ModeId(mode as u32)].cells
    }
}
