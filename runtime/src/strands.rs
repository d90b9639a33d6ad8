//! Strings as they are between two ticks, read from an engine's memory.
//!
//! Nothing is computed for it in a tick: slopes and rates are words that lie in memory anyway, so
//! what is read of a string costs a program nothing, on a board too.

use whippen_compiler::ideal::RealStrand;
use whippen_compiler::lower::LoweredStrand;
use whippen_compiler::model::{Reading, Strand};
use whippen_compiler::pipeline::Compiled;

use crate::engine::Engine;

impl Engine<'_> {
    /// A string (its number among the lowered) of the first key, as the next tick finds it, from
    /// end to end.
    ///
    /// # Errors
    /// The memory of a board cannot be read, in words.
    pub fn read_strand(&self, number: usize, into: &mut RealStrand) -> Result<(), String> {
        let (compiled, lowered) = match self {
            Engine::Ideal(c, ideal) => {
                let state = &ideal.state(0).strands[c.lowered.strands[number].strand];
                into.clone_from(state);
                return Ok(());
            }
            Engine::Jit(c, _) | Engine::Interp(c, _) | Engine::Emulated(c, _) => {
                (c, c.lowered.strands[number])
            }
        };
        let points = compiled.model.strands[lowered.strand].parts as usize - 1;
        into.u.resize(points + 2, 0.0);
        into.v.resize(points + 2, 0.0);
        let mut words = [Vec::new(), Vec::new()];
        match self {
            Engine::Jit(_, code) => {
                let word = |cell, point| code.cell(0, cell, point);
                read_cells(&mut words, lowered, points, word);
            }
            Engine::Interp(_, interp) => {
                let word = |cell, point| interp.cell(0, cell, point);
                read_cells(&mut words, lowered, points, word);
            }
            Engine::Emulated(_, board) => {
                for (words, cell) in words.iter_mut().zip(lowered.cells) {
                    let cell = &compiled.lowered.kernel.cells[cell as usize];
                    *words = board.cell_words(&cell.name, cell.len as usize)?;
                }
            }
            Engine::Ideal(..) => {}
        }
        let [slopes, rates] = words;
        let mut sum = 0_i64;
        for (u, word) in into.u[1..].iter_mut().zip(&slopes) {
            sum += i64::from(*word);
            *u = 0.5 * lowered.lsb * sum as f64;
        }
        for (point, word) in rates.iter().enumerate() {
            into.v[point + 1] = lowered.lsb * f64::from(*word);
        }
        Ok(())
    }

    /// The rate of a string (its number among the lowered) of the first key at a place (m from
    /// where it begins), as the next tick finds it (m/s); not a number on a board.
    pub fn strand_rate(&self, number: usize, place_m: f64) -> f64 {
        let (Engine::Jit(c, _)
        | Engine::Interp(c, _)
        | Engine::Ideal(c, _)
        | Engine::Emulated(c, _)) = self;
        let lowered = c.lowered.strands[number];
        let strand = &c.model.strands[lowered.strand];
        let (before, part) = strand.cell(place_m);
        let rate = |point: usize| match self {
            Engine::Ideal(_, ideal) => ideal.state(0).strands[lowered.strand].v[point],
            Engine::Jit(_, code) => word_of(code.cell(0, lowered.cells[1] as usize, point - 1)),
            Engine::Interp(_, interp) => {
                word_of(interp.cell(0, lowered.cells[1] as usize, point - 1))
            }
            Engine::Emulated(..) => f64::NAN,
        };
        let unit = match self {
            Engine::Ideal(..) => 1.0,
            _ => lowered.lsb,
        };
        let weights = Strand::weights(part).into_iter().enumerate();
        let first = before as usize - 1;
        let sum: f64 = weights.map(|(at, weight)| weight * rate(first + at)).sum();
        sum * unit * f64::from(c.model.rate_hz)
    }
}

fn word_of(word: Option<i64>) -> f64 {
    word.map_or(0.0, |word| word as f64)
}

fn read_cells(
    words: &mut [Vec<i32>; 2],
    lowered: LoweredStrand,
    points: usize,
    word: impl Fn(usize, usize) -> Option<i64>,
) {
    for ((words, cell), len) in words
        .iter_mut()
        .zip(lowered.cells)
        .zip([points + 1, points])
    {
        let all = (0..len).map(|at| word(cell as usize, at).unwrap_or_default() as i32);
        words.extend(all);
    }
}

/// The strings of a program, as the next tick finds them.
#[derive(Debug, Clone)]
pub struct Strands<'c> {
    compiled: &'c Compiled,
    /// In the order in which they were lowered.
    states: Vec<RealStrand>,
}

impl<'c> Strands<'c> {
    /// All at rest.
    pub fn new(compiled: &'c Compiled) -> Strands<'c> {
        let lowered = compiled.lowered.strands.iter();
        let states = lowered.map(|one| RealStrand::new(&compiled.model.strands[one.strand]));
        Strands {
            compiled,
            states: states.collect(),
        }
    }

    /// Reads all of them.
    ///
    /// # Errors
    /// As [`Engine::read_strand`].
    pub fn read(&mut self, engine: &Engine) -> Result<(), String> {
        let mut states = self.states.iter_mut().enumerate();
        states.try_for_each(|(number, state)| engine.read_strand(number, state))
    }

    /// What a string is.
    pub fn strand(&self, number: usize) -> &'c Strand {
        let lowered = &self.compiled.lowered.strands[number];
        &self.compiled.model.strands[lowered.strand]
    }

    /// A string from end to end.
    pub fn state(&self, number: usize) -> &RealStrand {
        &self.states[number]
    }

    /// What it does at a place (m from where it begins): as a program reads it, and between an end
    /// and the points next to it, where a program cannot read, along straight lines.
    pub fn at(&self, number: usize, reading: Reading, place_m: f64) -> f64 {
        let (strand, state) = (self.strand(number), &self.states[number]);
        let rate_hz = self.compiled.model.rate_hz;
        let place = (place_m / strand.part()).clamp(0.0, strand.parts.into());
        let nearest = f64::from(Strand::NEAREST);
        if place >= nearest && place <= f64::from(strand.parts) - nearest {
            return state.read(strand, reading, place_m, rate_hz);
        }
        let before = (place as usize).min(state.u.len() - 2);
        let part = place - before as f64;
        let between = |of: &[f64]| of[before] * (1.0 - part) + of[before + 1] * part;
        match reading {
            Reading::Displacement => between(&state.u),
            Reading::Rate => between(&state.v) * f64::from(rate_hz),
            Reading::Slope => (state.u[before + 1] - state.u[before]) / strand.part(),
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.states.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.states.is_empty()
    }
}
