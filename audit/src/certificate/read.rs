//! Reading a certificate, line by line.

use whippen_isa::ItState;

use super::{
    Bus, Call, Certificate, Dma, Frame, Function, HEADER, Helper, KINDS, Memory, Neighbour, Piece,
    Point,
};
use crate::facts::{Facts, PLACES};
use crate::place::{Place, Tag};

pub(super) struct Words<'a>(pub(super) std::str::SplitWhitespace<'a>);

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

    /// A state of the pipeline.
    fn bits(&mut self) -> Result<u128, String> {
        self.number::<i128>().map(|bits| bits as u128)
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
        // One way to say a thing: whatever is said twice, or in other words, is refused.
        let same = certificate.to_string().lines().eq(text.lines());
        same.then_some(certificate)
            .ok_or_else(|| "says something twice, or otherwise".into())
    }

    pub(super) fn line(&mut self, words: &mut Words) -> Result<(), String> {
        let what = words.text()?.to_string();
        match what.as_str() {
            "core" => (self.core, self.table) = (words.text()?.to_string(), words.number()?),
            "deadline" => self.deadline = words.number()?,
            "fetches" => self.fetches = words.flag()?,
            "cores" => self.cores = words.number()?,
            "dead" => self.dead = words.number()?,
            "kernels" => self.kernels = words.number()?,
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
            "dma" => {
                self.dma = Some(Dma {
                    bus: words.number()?,
                    wait: words.number()?,
                    accesses: words.number()?,
                })
            }
            "neighbour" => {
                self.neighbour = Some(Neighbour {
                    bus: words.number()?,
                    waits: words.rest()?,
                })
            }
            "section" => self.sections.push((words.number()?, words.number()?)),
            "targets" => self.targets.push((words.number()?, words.rest()?)),
            "frame" => self.frames.push(Frame {
                core: words.number()?,
                program: words.number()?,
                vectors: words.number()?,
                visits: words.number()?,
                cycles: words.number()?,
                stack: words.number()?,
                ..Frame::default()
            }),
            "helper" => {
                last(&mut self.frames)?.helper = Some(Helper {
                    vectors: words.number()?,
                    visits: words.rest()?,
                    functions: Vec::new(),
                })
            }
            "function" => self.being_read()?.push(read_function(words)?),
            _ => last(self.being_read()?)?.line(&what, words)?,
        }
        Ok(())
    }
}

impl Certificate {
    /// The functions that are being read: of the last frame, or of the core that helps in it.
    fn being_read(&mut self) -> Result<&mut Vec<Function>, String> {
        let frame = last(&mut self.frames)?;
        Ok(match &mut frame.helper {
            Some(helper) => &mut helper.functions,
            None => &mut frame.functions,
        })
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
            "until" => self.until = Some((words.number()?, words.bits()?)),
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
                begins: words.bits()?,
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
            "pipe" => self.pipes.push(words.bits()?),
            "place" => self.places.push(read_place(words)?),
            "facts" => self.facts.push(read_facts(words)?),
            "round" => {
                let round = (words.number()?, words.number()?, words.number()?);
                self.rounds.push(round);
            }
            "point" => self.points.push(Point {
                context: words.number()?,
                at: words.number()?,
                it: ItState::from_bits(words.number()?).ok_or("is no state of IT")?,
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

fn fits<T: TryFrom<i64>>(number: i64) -> Result<T, String> {
    T::try_from(number).map_err(|_| format!("`{number}` is no such number"))
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
        let tag = match fits::<u32>(kind)? {
            0 => Tag::Section(fits(of)?),
            kind => Tag::Return(kind - 1, fits(of)?),
        };
        match (slot, usize::try_from(at)) {
            (0, Ok(register @ 0..15)) => place.registers[register] = Some(tag),
            (1, _) => place.slots.push((fits(at)?, tag)),
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
