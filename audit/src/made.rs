//! Small images with certificates, for tests: their code is assembled from text, and what is
//! claimed of it is what the checker itself asks for, so that a test may say what it is and change
//! it.

use std::collections::{BTreeMap, BTreeSet};
use std::mem;

use whippen_isa::timing::{Evidence, Pipe};
use whippen_isa::{Arch, ItState};

use crate::certificate::{Bus, Call, Certificate, Frame, Function, Kind, Memory, Piece, Point};
use crate::elf::Elf;
use crate::facts::Facts;
use crate::memory::Around;
use crate::overlap::Last;
use crate::piece::tests::solve;
use crate::piece::{Arrival, ends, node_of, walk};
use crate::place::{Place, Tag};
use crate::step::{Node, Seen, State, Stepper};
use crate::{Checked, Refusal, audit, core_of, costs, sums, table_of};

/// Where the handler stands, what runs between ticks, the table of vectors and the end of the
/// stack; devices.
pub(crate) const HANDLER: u32 = 0x2000_0000;
pub(crate) const IDLE: u32 = 0x2000_1000;
pub(crate) const VECTORS: u32 = 0x2000_2000;
pub(crate) const DATA: u32 = 0x2000_4000;
pub(crate) const STACK: u32 = 0x2001_1000;
pub(crate) const DEVICES: u32 = 0x4000_0000;
/// The banks of its code.
const FETCHED: u32 = 0xf;
/// Where vectors lead that nobody uses.
const DEAD: u32 = 0x2000_1800;

/// The bytes of texts.
pub(crate) fn assemble(texts: &[&str]) -> Vec<u8> {
    whippen_words::assembled(texts, Arch::V8M)
}

/// What a board is like on which nothing waits: code, data and vectors in four striped banks, the
/// stack in one of its own.
pub(crate) fn board() -> Certificate {
    let memory = |base, size, banks: &[u8]| Memory {
        base,
        size,
        access: 1,
        fetch: 1,
        striped: banks.len() > 1,
        banks: banks.to_vec(),
    };
    Certificate {
        core: "cortex-m33".to_string(),
        table: core_of("cortex-m33").map_or(0, |core| table_of(&core)),
        deadline: 1000,
        cores: 1,
        memories: vec![
            memory(HANDLER, 0x8000, &[0, 1, 2, 3]),
            memory(0x2001_0000, 0x1000, &[4]),
        ],
        buses: vec![Bus {
            base: DEVICES,
            size: 0x1000,
            read: 4,
            write: 3,
        }],
        kernels: crate::number_of(""),
        dead: DEAD,
        ..Certificate::default()
    }
}

/// A function that is entered there, in one piece.
pub(crate) fn function(name: &str, kind: Kind, entry: u32) -> Function {
    Function {
        name: name.to_string(),
        kind,
        contexts: vec![[0, 0, entry]],
        pieces: vec![Piece {
            entry,
            ..Piece::default()
        }],
        ..Function::default()
    }
}

/// A call of a function that is bounded by itself.
pub(crate) fn call(site: u32, callee: u32, number: u32, keys: u32) -> Call {
    Call {
        site,
        callee,
        costs: Some((number, keys)),
    }
}

/// An image and what is claimed of it.
#[derive(Clone)]
pub(crate) struct Image {
    pub elf: Elf,
    pub certificate: Certificate,
}

impl Image {
    /// A core whose handler is that code, beside other code that stands where it is said. The
    /// handler's function is the last; `functions` stand before what runs between ticks.
    pub fn new(handler: &[&str], others: &[(u32, &[&str])], functions: Vec<Function>) -> Self {
        let handling = function("handler", Kind::Handler, HANDLER);
        Self::with(handling, handler, others, functions)
    }

    /// The same with claims of its handler.
    pub fn with(
        handling: Function,
        handler: &[&str],
        others: &[(u32, &[&str])],
        functions: Vec<Function>,
    ) -> Self {
        let words = [STACK, DEAD | 1, 0, DEAD | 1, HANDLER | 1];
        let vectors: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        let code = assemble(handler);
        let idle = assemble(&["wfi", "b .-2"]);
        let others: Vec<(u32, Vec<u8>)> = others
            .iter()
            .map(|(base, texts)| (*base, assemble(texts)))
            .collect();
        let mut sections: Vec<(&str, u32, &[u8])> = vec![
            (".text.handler", HANDLER, &code),
            (".text.idle", IDLE, &idle),
            (".vectors", VECTORS, &vectors),
            (".data", DATA, &[0; 64]),
        ];
        let texts = others
            .iter()
            .map(|(base, bytes)| (".text.more", *base, &bytes[..]));
        sections.extend(texts);
        sections.sort_by_key(|(_, base, _)| *base);
        let mut certificate = board();
        let elf = Elf::of(&sections);
        certificate.sections = elf.constants();
        let mut all = functions;
        all.extend([function("idle", Kind::Idle, IDLE), handling]);
        certificate.frames = vec![Frame {
            vectors: VECTORS,
            functions: all,
            ..Frame::default()
        }];
        Self { elf, certificate }
    }

    /// The same image on another core.
    pub fn on(mut self, core: &str) -> Self {
        self.certificate.core = core.to_string();
        self.certificate.table = core_of(core).map_or(0, |core| table_of(&core));
        self
    }

    /// Other code, or data, where something begins that is there.
    pub fn replace(&mut self, name: &str, base: u32, bytes: &[u8]) {
        let sections = &mut self.elf.sections;
        sections.retain(|section| section.base != base);
        sections.extend(Elf::of(&[(name, base, bytes)]).sections);
        sections.sort_by_key(|section| section.base);
        self.certificate.sections = self.elf.constants();
    }

    /// Judges what is claimed.
    pub fn judge(&self) -> Result<Vec<Checked>, Refusal> {
        audit(&self.elf, &self.certificate)
    }

    /// Why what is claimed is refused; empty where it is not.
    pub fn why(&self) -> String {
        self.judge()
            .err()
            .map_or(String::new(), |why| why.to_string())
    }

    /// The handler's function, or another from the last one on.
    pub fn function(&mut self, from_last: usize) -> &mut Function {
        let functions = &mut self.certificate.frames[0].functions;
        let nth = functions.len() - 1 - from_last;
        &mut functions[nth]
    }

    /// Claims whatever the checker asks for.
    ///
    /// # Errors
    /// What it refuses whatever is claimed.
    pub fn prove(mut self) -> Result<Self, Refusal> {
        let count = self.certificate.frames[0].functions.len();
        for number in 0..count {
            self.prove_function(number)?;
        }
        self.sum()?;
        Ok(self)
    }

    /// Claims the frame's cycles and stack.
    ///
    /// # Errors
    /// What they cannot be summed from.
    pub fn sum(&mut self) -> Result<(), Refusal> {
        let core = core_of(&self.certificate.core).expect("a core");
        let (parts, stack) = {
            let around = Around::new(&self.certificate, &self.elf, 0)?;
            sums(&around, &core, &self.certificate.frames[0])?
        };
        let frame = &mut self.certificate.frames[0];
        frame.cycles = parts.iter().map(|(_, cycles)| cycles).sum();
        frame.stack = stack;
        Ok(())
    }

    /// The cycles of a piece of a function, both from the last one on, as claimed.
    pub fn cycles(&self, from_last: usize, piece: usize) -> u64 {
        let functions = &self.certificate.frames[0].functions;
        let pieces = &functions[functions.len() - 1 - from_last].pieces;
        pieces[pieces.len() - 1 - piece].cycles
    }

    fn prove_function(&mut self, number: usize) -> Result<(), Refusal> {
        let pieces = self.certificate.frames[0].functions[number].pieces.len();
        for piece in 0..pieces {
            self.explore(number, piece)?;
        }
        self.solve(number)
    }

    /// Claims the cycles of a function's states.
    ///
    /// # Errors
    /// What is refused whatever is claimed.
    pub fn solve(&mut self, number: usize) -> Result<(), Refusal> {
        let pieces = self.certificate.frames[0].functions[number].pieces.len();
        for piece in 0..pieces {
            let function = self.certificate.frames[0].functions[number].clone();
            let claimed = function.pieces[piece].clone();
            let solved = self.stepping(number, &function, |own| solve(own, claimed))?;
            self.certificate.frames[0].functions[number].pieces[piece] = solved;
        }
        Ok(())
    }

    /// Does something with the steps of a function of that number.
    fn stepping<T>(
        &self,
        number: usize,
        function: &Function,
        does: impl FnOnce(&Stepper) -> Result<T, Refusal>,
    ) -> Result<T, Refusal> {
        let around = Around::new(&self.certificate, &self.elf, 0)?;
        let frame = &self.certificate.frames[0];
        does(&Stepper {
            core: &core_of(&self.certificate.core).expect("a core"),
            around: &around,
            certificate: &self.certificate,
            function,
            costs: &costs(&around, frame, number, &function.calls)?,
            room: Default::default(),
        })
    }

    /// Finds the states of a piece: those of its entry, of the heads of its loops, and of the
    /// points that it has already, which are in the loops that they say.
    pub fn explore(&mut self, number: usize, nth: usize) -> Result<(), Refusal> {
        let mut function = self.certificate.frames[0].functions[number].clone();
        let mut seen = Seen {
            class: Evidence::Exact,
            stack: function.stack,
            hands_stack: function.hands_stack,
        };
        if function.fetched == 0 {
            function.fetched = FETCHED;
        }
        function.hands_stack = true;
        let (mut piece, mut facts) = (function.pieces[nth].clone(), Facts::default());
        if nth == 0 {
            piece.places = vec![Place::entered()];
        }
        if nth == 0 && matches!(function.kind, Kind::Plain | Kind::Keys) {
            for (register, words) in &function.entered {
                facts.set(*register, *words);
            }
        }
        let handed = self.stepping(number, &function, |own| {
            explore_from(own, &mut piece, facts, &mut seen)
        })?;
        let own = &mut self.certificate.frames[0].functions[number];
        own.fetched = function.fetched;
        (own.stack, own.hands_stack) = (seen.stack, seen.hands_stack);
        own.pieces[nth] = piece;
        for (at, state) in handed {
            if own.kind == Kind::Until {
                own.until = Some((at, state.pipe.to_bits()));
                continue;
            }
            let next = own.pieces.iter_mut().find(|piece| piece.entry == at);
            let next = next.expect("a piece");
            next.begins = state.pipe.to_bits();
            let mut place = Place {
                registers: [None; 16],
                ..state.place
            };
            for (register, section) in &own.bases {
                place.registers[usize::from(*register)] = Some(Tag::Section(*section));
            }
            next.places = vec![place];
        }
        Ok(())
    }
}

/// Adds the states of a piece, which is entered with those facts; gives what comes to the next one.
fn explore_from(
    stepper: &Stepper,
    piece: &mut Piece,
    facts: Facts,
    seen: &mut Seen,
) -> Result<Vec<(u32, State)>, Refusal> {
    let pieces = stepper.function.pieces.iter();
    let entries: Vec<u32> = pieces.map(|piece| piece.entry).collect();
    let ends = ends(stepper.function, &entries, piece.entry);
    let node = |context, at| Node { context, at, it: 0 };
    let heads = piece.rounds.iter().map(|own| node(own.0, own.1));
    let given = mem::take(&mut piece.points).into_iter();
    let given: BTreeMap<Node, Vec<u32>> = given.map(|own| (node_of(&own), own.loops)).collect();
    let nodes = heads.chain([node(0, piece.entry)]);
    let nodes: BTreeSet<Node> = nodes.chain(given.keys().copied()).collect();
    let (place, entry) = (piece.places.first(), piece.entry);
    let none = || Refusal::at(entry, "is never come to");
    let begins = State {
        pipe: Pipe::from_bits(piece.begins),
        facts,
        place: place.cloned().ok_or_else(none)?,
        last: Last::default(),
    };
    let (mut handed, mut open) = (Vec::new(), vec![(node(0, piece.entry), begins)]);
    while let Some((node, state)) = open.pop() {
        // Each loop is within the one before it.
        let head = |own: &(u32, u32, u64)| (own.0, own.1) == (node.context, node.at);
        let nth = piece.rounds.iter().position(head);
        let loops = nth.map_or(Vec::new(), |nth| (0..=nth as u32).collect());
        let loops = given.get(&node).cloned().unwrap_or(loops);
        if !claim(piece, node, &state, loops) {
            continue;
        }
        let is_point = |node: &Node| nodes.contains(node);
        let mut passes = |_, _| Ok(());
        let from = (node, state);
        let arrived = walk(stepper, from, &is_point, &ends, &mut passes, seen)?;
        for (arrival, mut state, _) in arrived {
            state.facts = Facts::default();
            match arrival {
                Arrival::Point(node) => open.push((node, state)),
                Arrival::Piece(at) => handed.push((at, state)),
                Arrival::Return => {}
            }
        }
    }
    Ok(handed)
}

/// Adds a state to a piece; false where it is there.
fn claim(piece: &mut Piece, node: Node, state: &State, loops: Vec<u32>) -> bool {
    let known = piece.points.iter().position(|point| node_of(point) == node);
    let at = known.unwrap_or_else(|| {
        let place = number_in(&mut piece.places, state.place.clone());
        piece.points.push(Point {
            context: node.context,
            at: node.at,
            it: ItState::OUTSIDE,
            place,
            loops,
            states: Vec::new(),
        });
        piece.points.len() - 1
    });
    let pipe = number_in(&mut piece.pipes, state.pipe.to_bits());
    let facts = number_in(&mut piece.facts, state.facts.clone());
    let states = &mut piece.points[at].states;
    let new = !states.iter().any(|own| (own.0, own.1) == (pipe, facts));
    if new {
        // From below, for the least that is enough.
        states.push((pipe, facts, -1_000_000));
    }
    new
}

/// The number of something in a table, to which it is added.
fn number_in<T: PartialEq>(all: &mut Vec<T>, one: T) -> u32 {
    let known = all.iter().position(|own| *own == one);
    known.unwrap_or_else(|| {
        all.push(one);
        all.len() - 1
    }) as u32
}
