//! A bowed string on both engines of the desktop, behind one door: live values in, slip, force and
//! the force on the bridge out.

use whippen_compiler::ideal::{Ideal, RealStrand};
use whippen_compiler::jit::{JitCode, Options};
use whippen_compiler::pipeline::Compiled;
use whippen_runtime::device::Device;

use crate::strings;

/// Live values of a run.
#[derive(Debug, Clone, Copy)]
pub struct Bow {
    pub speed: f64,
    pub press: f64,
    pub beta: f64,
}

/// One of both engines.
pub trait Player {
    fn set(&mut self, name: &str, value: f64);
    /// One tick: slip, force and the force on the bridge.
    fn tick(&mut self) -> [f64; 3];

    fn bow(&mut self, bow: Bow) {
        self.set("speed", bow.speed);
        self.set("press", bow.press);
        self.set("beta", bow.beta);
    }
}

const NAMES: [&str; 3] = ["slips", "rubs", "bridge"];

pub struct Integers<'c> {
    compiled: &'c Compiled,
    pub jit: JitCode,
    shown: [usize; 3],
}

impl Integers<'_> {
    pub fn new(compiled: &Compiled) -> Integers<'_> {
        let kernel = &compiled.lowered.kernel;
        let mut jit = JitCode::build(kernel, 1, Options { probes: true }).expect("a kernel");
        jit.init(&[0]);
        let exports = &compiled.lowered.exports;
        let at = |name: &str| {
            exports
                .iter()
                .position(|e| e.name == name)
                .expect("is shown")
        };
        Integers {
            compiled,
            jit,
            shown: NAMES.map(at),
        }
    }
}

impl Integers<'_> {
    /// The string.
    pub fn state(&self) -> RealStrand {
        let lowered = self.compiled.lowered.strands[0];
        let parts = self.compiled.model.strands[lowered.strand].parts;
        let memory = self.jit.memory();
        strings::held(&lowered, parts, |cell, point| {
            let word = memory.cell(&self.compiled.lowered.kernel, 0, cell as usize, point);
            word.expect("is a word of the grid")
        })
    }
}

fn live(compiled: &Compiled, name: &str) -> usize {
    let mut lives = compiled.model.lives.iter();
    lives.position(|live| live.name == name).expect("is live")
}

impl Player for Integers<'_> {
    fn set(&mut self, name: &str, value: f64) {
        let live = live(self.compiled, name);
        let word = self.compiled.lowered.lives[live].quantize(value);
        self.jit.set_live(live, word).expect("is live");
    }

    fn tick(&mut self) -> [f64; 3] {
        self.jit.tick(&[0], &mut [0_i16]);
        let exports = &self.compiled.lowered.exports;
        self.shown
            .map(|at| exports[at].value(self.jit.probes()[at]))
    }
}

pub struct Reals<'c> {
    compiled: &'c Compiled,
    ideal: Ideal<'c>,
}

impl Reals<'_> {
    pub fn new(compiled: &Compiled) -> Reals<'_> {
        let scales = Device::of(&compiled.model).scales();
        let ideal = Ideal::new(&compiled.model, &scales, 1);
        Reals { compiled, ideal }
    }
}

impl Player for Reals<'_> {
    fn set(&mut self, name: &str, value: f64) {
        self.ideal.set_live(live(self.compiled, name), value);
    }

    fn tick(&mut self) -> [f64; 3] {
        self.ideal.tick(&[0]);
        NAMES.map(|name| {
            let mut named = self.compiled.model.named.iter();
            let node = named.find(|n| n.name == name).expect("is named").value;
            self.ideal.value(0, node)
        })
    }
}
