//! The certificate: what is claimed of an image, as text. One line an entry; numbers are decimal or
//! begin with `0x`. `docs/audit.md` lists the lines.

use std::fmt::{self, Display, Write};

use whippen_isa::ItState;
use whippen_isa::timing::Pipe;

use crate::facts::{Facts, PLACES};
use crate::place::{Place, Tag};

/// The first line.
const HEADER: &str = "whippen-certificate 1";

/// A memory: where it lies, and how long an access and a fetch take (0: nobody can say).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Memory {
    /// First address.
    pub base: u32,
    /// Bytes.
    pub size: u32,
    /// Cycles of an access.
    pub access: u16,
    /// Cycles of a fetch.
    pub fetch: u16,
    /// Whether neighbouring words lie in neighbouring banks.
    pub striped: bool,
    /// Its banks.
    pub banks: Vec<u8>,
}

/// Addresses behind which devices are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bus {
    /// First address.
    pub base: u32,
    /// Bytes.
    pub size: u32,
    /// Cycles of a read.
    pub read: u16,
    /// Cycles of a write.
    pub write: u16,
}

/// Everything that is claimed.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Certificate {
    /// The name of the core.
    pub core: String,
    /// A number that stands for its table of cycles.
    pub table: u64,
    /// Cycles that a frame may take.
    pub deadline: u64,
    /// Whether data in a bank that is fetched from cost a cycle.
    pub fetches: bool,
    /// How many cores play.
    pub cores: u32,
    /// Memories, by address.
    pub memories: Vec<Memory>,
    /// Buses.
    pub buses: Vec<Bus>,
    /// Code and constants, by first address, with what stands for their bytes.
    pub sections: Vec<(u32, u64)>,
    /// Where vectors lead that nobody uses.
    pub dead: u32,
    /// Indirect branches, and where they may go.
    pub targets: Vec<(u32, Vec<u32>)>,
    /// The frame of each core, while each program plays.
    pub frames: Vec<Frame>,
}

/// The frame of a core while a program plays.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Frame {
    /// Which core.
    pub core: u32,
    /// Which program.
    pub program: u32,
    /// Where its table of vectors lies.
    pub vectors: u32,
    /// Accesses of the other core between two of its ticks.
    pub visits: u32,
    /// Cycles from the request to the return, at most.
    pub cycles: u64,
    /// Bytes of stack.
    pub stack: u32,
    /// What it runs; who calls stands behind what it calls.
    pub functions: Vec<Function>,
}

/// What a function is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Kind {
    /// One that returns.
    #[default]
    Plain,
    /// The tick of keys: the first piece is the entry, the last one the end, others are modes.
    Keys,
    /// The handler of the tick's interrupt.
    Handler,
    /// What runs between ticks.
    Idle,
}

const KINDS: [(Kind, &str); 4] = [
    (Kind::Plain, "plain"),
    (Kind::Keys, "keys"),
    (Kind::Handler, "handler"),
    (Kind::Idle, "idle"),
];

/// A function.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Function {
    /// Its name, for messages.
    pub name: String,
    /// What it is.
    pub kind: Kind,
    /// Banks that may be fetched from while it runs.
    pub fetched: u32,
    /// Whether it hands out addresses of the stack.
    pub hands_stack: bool,
    /// Bytes of stack.
    pub stack: u32,
    /// Where it returns to, and whether a 32-bit instruction is there: at no less cost than any
    /// place it does return to. None: the most expensive.
    pub returns: Option<(u32, bool)>,
    /// Words that registers hold where it is entered.
    pub entered: Vec<(u8, [i64; 2])>,
    /// Registers that point into the section that begins there, where a piece begins behind the
    /// first.
    pub bases: Vec<(u8, u32)>,
    /// Heads of loops, and their rounds.
    pub loops: Vec<(u32, u32)>,
    /// Calls in it that are followed: the caller's number, the address behind the call, the callee.
    /// The first is its own.
    pub contexts: Vec<[u32; 3]>,
    /// Calls in it that are not followed.
    pub calls: Vec<Call>,
    /// Pieces.
    pub pieces: Vec<Piece>,
}

/// A call whose callee is bounded as a function of its own.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Call {
    /// The address of the call.
    pub site: u32,
    /// The callee.
    pub callee: u32,
    /// The number of the function, and how often a mode of a key runs in it (of others 0); none
    /// where it is never called from there.
    pub costs: Option<(u32, u32)>,
}

/// From an entry to the next piece's, or to the return.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Piece {
    /// Its first instruction.
    pub entry: u32,
    /// Cycles at most; between ticks of one instruction.
    pub cycles: u64,
    /// The stack and what registers point to at its entry.
    pub place: u32,
    /// States of the pipeline.
    pub pipes: Vec<u128>,
    /// Stacks.
    pub places: Vec<Place>,
    /// Facts.
    pub facts: Vec<Facts>,
    /// Loops: context and head, and the cycles of a round.
    pub rounds: Vec<(u32, u32, u64)>,
    /// Places in the code.
    pub points: Vec<Point>,
}

/// A place in the code: what is claimed wherever execution comes here.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Point {
    /// The call it is in.
    pub context: u32,
    /// The address.
    pub at: u32,
    /// The state of IT.
    pub it: ItState,
    /// Its stack.
    pub place: u32,
    /// The loops it is in, outermost first.
    pub loops: Vec<u32>,
    /// Pipeline, facts, and cycles that remain at most: these, and those of a round for each round
    /// that remains.
    pub states: Vec<(u32, u32, i64)>,
}

struct Words<'a>(std::str::SplitWhitespace<'a>);

impl Words<'_> {
    fn text(&mut self) -> Result<&str, String> {
        self.0.next().ok_or_else(|| "ends too early".to_string())
    }

    fn number<T: TryFrom<i128>>(&mut self) -> Result<T, String> {
        let word = self.text()?;
        let read = match word.strip_prefix("0x") {
            Some(hex) => i128::from_str_radix(hex, 16),
            None => word.parse(),
        };
        let fits = read.ok().and_then(|number| T::try_from(number).ok());
        fits.ok_or_else(|| format!("`{word}` is no such number"))
    }

    fn flag(&mut self) -> Result<bool, String> {
        match self.number::<u8>()? {
            0 => Ok(false),
            1 => Ok(true),
            _ => Err("a flag is 0 or 1".into()),
        }
    }

    fn rest<T: TryFrom<i128>>(&mut self) -> Result<Vec<T>, String> {
        let mut all = Vec::new();
        while self.0.clone().next().is_some() {
            all.push(self.number()?);
        }
        Ok(all)
    }

    fn end(&mut self) -> Result<(), String> {
        self.0
            .next()
            .map_or(Ok(()), |word| Err(format!("`{word}` is too much")))
    }
}

fn last<T>(all: &mut [T]) -> Result<&mut T, String> {
    all.last_mut().ok_or_else(|| "stands nowhere".to_string())
}

impl Certificate {
    /// Reads a certificate.
    ///
    /// # Errors
    /// Which line cannot be read, and why.
    pub fn read(text: &str) -> Result<Self, String> {
        let mut certificate = Self::default();
        let mut lines = text.lines();
        if lines.next() != Some(HEADER) {
            return Err(format!("does not begin with `{HEADER}`"));
        }
        for (number, line) in lines.enumerate() {
            let mut words = Words(line.split_whitespace());
            let read = certificate.line(&mut words).and_then(|()| words.end());
            read.map_err(|why| format!("line {}: {why}", number + 2))?;
        }
        Ok(certificate)
    }

    fn line(&mut self, words: &mut Words) -> Result<(), String> {
        let what = words.text()?.to_string();
        match what.as_str() {
            "core" => (self.core, self.table) = (words.text()?.to_string(), words.number()?),
            "deadline" => self.deadline = words.number()?,
            "fetches" => self.fetches = words.flag()?,
            "cores" => self.cores = words.number()?,
            "dead" => self.dead = words.number()?,
            "memory" => self.memories.push(Memory {
                base: words.number()?,
                size: words.number()?,
                access: words.number()?,
                fetch: words.number()?,
                striped: words.flag()?,
                banks: words.rest()?,
            }),
            "bus" => self.buses.push(Bus {
                base: words.number()?,
                size: words.number()?,
                read: words.number()?,
                write: words.number()?,
            }),
            "section" => self.sections.push((words.number()?, words.number()?)),
            "targets" => self.targets.push((words.number()?, words.rest()?)),
            "frame" => self.frames.push(Frame {
                core: words.number()?,
                program: words.number()?,
                vectors: words.number()?,
                visits: words.number()?,
                cycles: words.number()?,
                stack: words.number()?,
                functions: Vec::new(),
            }),
            "function" => last(&mut self.frames)?
                .functions
                .push(read_function(words)?),
            _ => last(&mut last(&mut self.frames)?.functions)?.line(&what, words)?,
        }
        Ok(())
    }
}

fn read_function(words: &mut Words) -> Result<Function, String> {
    let name = words.text()?.to_string();
    let kind = words.text()?;
    let known = KINDS.iter().find(|(_, text)| *text == kind);
    Ok(Function {
        kind: known
            .ok_or_else(|| format!("`{kind}` is no kind of function"))?
            .0,
        name,
        fetched: words.number()?,
        hands_stack: words.flag()?,
        stack: words.number()?,
        ..Function::default()
    })
}

impl Function {
    fn line(&mut self, what: &str, words: &mut Words) -> Result<(), String> {
        match what {
            "returns" => self.returns = Some((words.number()?, words.flag()?)),
            "entered" => {
                let known = (words.number()?, [words.number()?, words.number()?]);
                self.entered.push(known);
            }
            "base" => self.bases.push((words.number()?, words.number()?)),
            "loop" => self.loops.push((words.number()?, words.number()?)),
            "context" => {
                let context = [words.number()?, words.number()?, words.number()?];
                self.contexts.push(context);
            }
            "call" => self.calls.push(Call {
                site: words.number()?,
                callee: words.number()?,
                costs: match words.text()? {
                    "never" => None,
                    "costs" => Some((words.number()?, words.number()?)),
                    other => return Err(format!("`{other}` is neither `costs` nor `never`")),
                },
            }),
            "piece" => self.pieces.push(Piece {
                entry: words.number()?,
                cycles: words.number()?,
                place: words.number()?,
                ..Piece::default()
            }),
            _ => last(&mut self.pieces)?.line(what, words)?,
        }
        Ok(())
    }
}

impl Piece {
    fn line(&mut self, what: &str, words: &mut Words) -> Result<(), String> {
        match what {
            "pipe" => self.pipes.push(words.number::<i128>()? as u128),
            "place" => self.places.push(read_place(words)?),
            "facts" => self.facts.push(read_facts(words)?),
            "round" => {
                let round = (words.number()?, words.number()?, words.number()?);
                self.rounds.push(round);
            }
            "point" => self.points.push(Point {
                context: words.number()?,
                at: words.number()?,
                it: it_of_bits(words.number()?).ok_or("is no state of IT")?,
                place: words.number()?,
                loops: words.rest()?,
                states: Vec::new(),
            }),
            "state" => {
                let state = (words.number()?, words.number()?, words.number()?);
                last(&mut self.points)?.states.push(state);
            }
            other => return Err(format!("`{other}` is no entry")),
        }
        Ok(())
    }
}

fn it_of_bits(bits: u8) -> Option<ItState> {
    match bits {
        0 => Some(ItState::OUTSIDE),
        _ => ItState::after_it(bits >> 4, bits & 15),
    }
}

fn read_place(words: &mut Words) -> Result<Place, String> {
    let mut place = Place {
        sp: words.number()?,
        ..Place::default()
    };
    for number in words.rest::<i64>()?.chunks(4) {
        let [slot, at, kind, of] = *number else {
            return Err("ends too early".into());
        };
        let number = |n: i64| u32::try_from(n).map_err(|_| "is no such number".to_string());
        let tag = match kind {
            0 => Tag::Section(number(of)?),
            _ => Tag::Return(number(kind - 1)?, of as i32),
        };
        match (slot, usize::try_from(at)) {
            (0, Ok(register @ 0..15)) => place.registers[register] = Some(tag),
            (1, _) => place.slots.push((at as i32, tag)),
            _ => return Err("is neither register nor slot".into()),
        }
    }
    Ok(place)
}

fn read_facts(words: &mut Words) -> Result<Facts, String> {
    let mut facts = Facts {
        flags: words.number()?,
        ..Facts::default()
    };
    let count = words.number::<u16>()?;
    for _ in 0..count {
        facts.values.push([words.number()?, words.number()?]);
    }
    for pair in words.rest::<u16>()?.chunks(2) {
        match *pair {
            [place, name] if usize::from(place) < PLACES && name < count => {
                facts.names[usize::from(place)] = name;
            }
            _ => return Err("names what is not there".into()),
        }
    }
    Ok(facts)
}

impl Display for Certificate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{HEADER}\ncore {} {:#x}", self.core, self.table)?;
        writeln!(
            f,
            "deadline {}\nfetches {}",
            self.deadline,
            u8::from(self.fetches)
        )?;
        writeln!(f, "cores {}\ndead {:#x}", self.cores, self.dead)?;
        for own in &self.memories {
            let Memory {
                base,
                size,
                access,
                fetch,
                ..
            } = own;
            write!(
                f,
                "memory {base:#x} {size:#x} {access} {fetch} {}",
                u8::from(own.striped)
            )?;
            writeln!(f, "{}", list(&own.banks))?;
        }
        for Bus {
            base,
            size,
            read,
            write,
        } in &self.buses
        {
            writeln!(f, "bus {base:#x} {size:#x} {read} {write}")?;
        }
        for (base, hash) in &self.sections {
            writeln!(f, "section {base:#x} {hash:#x}")?;
        }
        for (at, to) in &self.targets {
            let to: Vec<String> = to.iter().map(|to| format!(" {to:#x}")).collect();
            writeln!(f, "targets {at:#x}{}", to.concat())?;
        }
        for frame in &self.frames {
            let Frame {
                core,
                program,
                vectors,
                visits,
                cycles,
                stack,
                ..
            } = frame;
            writeln!(
                f,
                "frame {core} {program} {vectors:#x} {visits} {cycles} {stack}"
            )?;
            frame
                .functions
                .iter()
                .try_for_each(|function| write!(f, "{function}"))?;
        }
        Ok(())
    }
}

fn list<T: Display>(all: &[T]) -> String {
    all.iter().fold(String::new(), |mut text, one| {
        let _ = write!(text, " {one}");
        text
    })
}

impl Display for Function {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = KINDS
            .iter()
            .find(|(kind, _)| *kind == self.kind)
            .map_or("", |(_, text)| text);
        let hands = u8::from(self.hands_stack);
        writeln!(
            f,
            "function {} {kind} {:#x} {hands} {}",
            self.name, self.fetched, self.stack
        )?;
        if let Some((at, wide)) = self.returns {
            writeln!(f, "returns {at:#x} {}", u8::from(wide))?;
        }
        for (register, [low, high]) in &self.entered {
            writeln!(f, "entered {register} {low} {high}")?;
        }
        for (register, section) in &self.bases {
            writeln!(f, "base {register} {section:#x}")?;
        }
        for (head, rounds) in &self.loops {
            writeln!(f, "loop {head:#x} {rounds}")?;
        }
        for [caller, back, callee] in &self.contexts {
            writeln!(f, "context {caller} {back:#x} {callee:#x}")?;
        }
        for Call {
            site,
            callee,
            costs,
        } in &self.calls
        {
            match costs {
                Some((function, keys)) => {
                    writeln!(f, "call {site:#x} {callee:#x} costs {function} {keys}")?;
                }
                None => writeln!(f, "call {site:#x} {callee:#x} never")?,
            }
        }
        self.pieces
            .iter()
            .try_for_each(|piece| write!(f, "{piece}"))
    }
}

impl Display for Piece {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "piece {:#x} {} {}", self.entry, self.cycles, self.place)?;
        self.pipes
            .iter()
            .try_for_each(|pipe| writeln!(f, "pipe {pipe:#x}"))?;
        for place in &self.places {
            write!(f, "place {}", place.sp)?;
            let registers = place.registers.iter().enumerate();
            let registers = registers.filter_map(|(at, tag)| Some((0, at as i32, (*tag)?)));
            let slots = place.slots.iter().map(|(at, tag)| (1, *at, *tag));
            for (slot, at, tag) in registers.chain(slots) {
                match tag {
                    Tag::Section(of) => write!(f, " {slot} {at} 0 {of:#x}")?,
                    Tag::Return(context, sp) => write!(f, " {slot} {at} {} {sp}", context + 1)?,
                }
            }
            writeln!(f)?;
        }
        for facts in &self.facts {
            write!(f, "facts {:#x} {}", facts.flags, facts.values.len())?;
            for [low, high] in &facts.values {
                write!(f, " {low} {high}")?;
            }
            for (place, name) in facts
                .names
                .iter()
                .enumerate()
                .filter(|(_, n)| **n != u16::MAX)
            {
                write!(f, " {place} {name}")?;
            }
            writeln!(f)?;
        }
        for (context, head, cycles) in &self.rounds {
            writeln!(f, "round {context} {head:#x} {cycles}")?;
        }
        for point in &self.points {
            let Point {
                context, at, place, ..
            } = point;
            write!(f, "point {context} {at:#x} {} {place}", point.it.bits())?;
            writeln!(f, "{}", list(&point.loops))?;
            for (pipe, facts, remains) in &point.states {
                writeln!(f, "state {pipe} {facts} {remains}")?;
            }
        }
        Ok(())
    }
}

impl Piece {
    /// A state of the pipeline by its number.
    pub(crate) fn pipe(&self, number: u32) -> Option<Pipe> {
        self.pipes
            .get(number as usize)
            .map(|bits| Pipe::from_bits(*bits))
    }
}
