//! Writing a certificate.

use std::fmt::{self, Display, Write};

use super::{
    Bus, Call, Certificate, Dma, Frame, Function, HEADER, Helper, KINDS, Memory, Neighbour, Piece,
    Point,
};
use crate::place::Tag;

impl Certificate {
    /// What is claimed of the board and of the image as a whole.
    fn write_board(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{HEADER}\ncore {} {:#x}", self.core, self.table)?;
        let fetches = u8::from(self.fetches);
        writeln!(f, "deadline {}\nfetches {fetches}", self.deadline)?;
        writeln!(f, "cores {}\ndead {:#x}", self.cores, self.dead)?;
        writeln!(f, "kernels {:#x}", self.kernels)?;
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
        if let Some(Dma {
            bus,
            wait,
            accesses,
        }) = self.dma
        {
            writeln!(f, "dma {bus:#x} {wait} {accesses}")?;
        }
        if let Some(Neighbour { bus, waits }) = &self.neighbour {
            let waits: Vec<String> = waits.iter().map(|wait| format!(" {wait}")).collect();
            writeln!(f, "neighbour {bus:#x}{}", waits.concat())?;
        }
        Ok(())
    }
}

impl Display for Certificate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.write_board(f)?;
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
            write_all(f, &frame.functions)?;
            if let Some(helper) = &frame.helper {
                let Helper {
                    vectors, visits, ..
                } = helper;
                writeln!(f, "helper {vectors:#x}{}", list(visits))?;
                write_all(f, &helper.functions)?;
            }
        }
        Ok(())
    }
}

fn write_all<T: Display>(f: &mut fmt::Formatter<'_>, all: &[T]) -> fmt::Result {
    all.iter().try_for_each(|one| write!(f, "{one}"))
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
        if let Some((at, pipe)) = self.until {
            writeln!(f, "until {at:#x} {pipe:#x}")?;
        }
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
        write_all(f, &self.pieces)
    }
}

impl Display for Piece {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Piece {
            entry,
            cycles,
            place,
            begins,
            ..
        } = self;
        writeln!(f, "piece {entry:#x} {cycles} {place} {begins:#x}")?;
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
                    Tag::Return(context, sp) => {
                        let kind = u64::from(context) + 1;
                        write!(f, " {slot} {at} {kind} {sp}")?;
                    }
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
