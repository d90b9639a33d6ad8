//! What is proven, from which numbers, and everything that it rests on, in words.

#[cfg(test)]
mod tests;

use std::fmt::Write;

use whippen_isa::timing::Evidence;

use crate::certificate::{Certificate, Frame, Function, Kind};
use crate::frame::Checked;
use crate::legs::ROUNDS;
use crate::ranges::Ranges;

/// What no certificate says and this checker does not look at.
pub const NOT_CHECKED: [&str; 3] = [
    "that the code computes what the Kernels say: `whippen build --validate` compares the code of \
     keys with its modes and says of how many it can; that is the compiler's own, and not in the \
     certificate",
    "the start: what runs before the first tick",
    "the ways that data take: that no other code writes where the frame's pointers lead",
];

/// What holds of every image.
const ALWAYS: [&str; 14] = [
    "the decoder and the table of the core's cycles are right, or too large, for the silicon",
    "memories, banks and buses are as the certificate says; each core's stack lies at the end that \
     the first word of its vectors says",
    "a core uses, while it plays, sections of its own name alone (`core1`: core 1; others: core 0; \
     the start's: nobody), but for visits; an address that is not known lies in its core's data, \
     not in a device",
    "whoever is not in the certificate uses neither memory of the image nor a bridge: a debugger, a \
     DMA that is not listed",
    "an access of the other core delays one of ours by one access at most, and an own fetch by a \
     cycle at most; fetches run at most 64 bytes ahead",
    "what points into a section stays there, moved by constants or by a shifted index",
    "nobody but PUSH, STM and STR relative to SP writes the stack's slots in which return \
     addresses and saved pointers lie",
    "nobody writes code, constants or vectors while they run",
    "accesses are aligned to their size",
    "a device answers within the cycles of its bus",
    "what functions are called with, as listed below, is what they are called with",
    "an interrupt is entered and left in the cycles of the core's table (estimates)",
    "a call of keys runs as many modes as the core has keys; where one begins, one less",
    "the deadline is the time from one tick to the next, or to the wrap that the board says",
];

/// Assumptions that are of this image, one by one.
pub fn assumptions(certificate: &Certificate, ranges: &[Ranges]) -> Vec<String> {
    let mut all: Vec<String> = ALWAYS.iter().map(|text| text.to_string()).collect();
    of_board(&mut all, certificate);
    for own in ranges {
        let name = &own.kernel;
        let promised = own.promises.iter();
        all.extend(promised.map(|text| {
            format!("the Kernel `{name}`: `{text}` holds, by an argument beyond intervals")
        }));
    }
    for (at, targets) in &certificate.targets {
        let to: Vec<String> = targets
            .iter()
            .take(3)
            .map(|to| format!("{to:#x}"))
            .collect();
        let more = targets.len().saturating_sub(3);
        let more = if more > 0 {
            format!(" or {more} places more")
        } else {
            String::new()
        };
        all.push(format!(
            "the indirect branch at {at:#x} leads to {}{more}, nowhere else",
            to.join(", ")
        ));
    }
    for frame in &certificate.frames {
        of_frame(&mut all, certificate, frame);
        of_helper(&mut all, frame);
    }
    all
}

/// What is assumed of a core's frame.
fn of_frame(all: &mut Vec<String>, certificate: &Certificate, frame: &Frame) {
    let name = format!("core {}, program {}", frame.core, frame.program);
    all.push(format!(
        "{name}: the table of vectors lies at {:#x}",
        frame.vectors
    ));
    let between = frame.functions.iter().find(|own| own.kind == Kind::Idle);
    if let Some(piece) = between.and_then(|own| own.pieces.first()) {
        let entry = piece.entry;
        all.push(format!(
            "{name}: between ticks runs what begins at {entry:#x}, nothing else"
        ));
    }
    if certificate.cores > 1 {
        all.push(format!(
            "{name}: between two ticks the other core accesses its memory {} times at most",
            frame.visits
        ));
    }
    for core in 0..certificate.cores {
        if core != frame.core && frame.helper.is_none() {
            continue;
        }
        let functions = frame.functions_of(core);
        for function in functions {
            let name = format!(
                "core {core}, program {}, `{}`",
                frame.program, function.name
            );
            of_function(all, &name, function, functions);
        }
    }
}

/// What is assumed of two cores that run parts of one instrument.
fn of_helper(all: &mut Vec<String>, frame: &Frame) {
    let Some(helper) = &frame.helper else {
        return;
    };
    all.push(format!(
        "core 1 runs its legs for ever: its table of vectors lies at {:#x}; nobody but the other \
         core writes the words that a core waits for, and both have one clock",
        helper.vectors
    ));
    all.push(format!(
        "a number that the other core has written is found after {ROUNDS} rounds of a wait at most"
    ));
    let places = |functions: &[Function]| {
        let legs = functions.iter().find(|own| own.kind == Kind::Legs);
        let pieces = legs.map_or(&[][..], |own| &own.pieces[..]);
        let entries = pieces.iter().skip(1).map(|own| format!("{:#x}", own.entry));
        entries.collect::<Vec<String>>().join(", ")
    };
    let visits: Vec<String> = helper.visits.iter().map(u32::to_string).collect();
    all.push(format!(
        "core 0 has written its numbers where it comes to {}, core 1 where it comes to {}",
        places(&frame.functions),
        places(&helper.functions)
    ));
    all.push(format!(
        "core 0 accesses core 1's memory {} times at most in the legs of that, one after the other",
        visits.join(", ")
    ));
}

/// What no byte says: the cores that play, memories and buses.
fn of_board(all: &mut Vec<String>, certificate: &Certificate) {
    let cores = certificate.cores;
    all.push(format!(
        "{cores} cores play; no other one fetches or accesses anything"
    ));
    all.push(match certificate.fetches {
        true => "a core fetches and accesses data through a port each".to_string(),
        false => "a core fetches and accesses data through one port".to_string(),
    });
    let dead = certificate.dead;
    all.push(format!(
        "an interrupt that leads to {dead:#x} is the end: nothing has to be in time behind it"
    ));
    for own in &certificate.memories {
        let banks: Vec<String> = own.banks.iter().map(u8::to_string).collect();
        let cycles = |cycles: u16| match cycles {
            0 => "in a time that nobody knows".to_string(),
            cycles => format!("in {cycles} cycles"),
        };
        all.push(format!(
            "{} bytes of memory at {:#x} are accessed {} and fetched {}, {} banks {}",
            own.size,
            own.base,
            cycles(own.access),
            cycles(own.fetch),
            if own.striped { "word by word in" } else { "in" },
            banks.join(", ")
        ));
    }
    for own in &certificate.buses {
        all.push(format!(
            "devices in {} bytes at {:#x} are read in {} cycles and written in {}",
            own.size, own.base, own.read, own.write
        ));
    }
    if let Some(dma) = certificate.dma {
        all.push(format!(
            "a DMA makes an access of a core behind the bridge at {:#x} wait {} cycles at most",
            dma.bus, dma.wait
        ));
        all.push(match dma.accesses {
            0 => "at memory the cores go before the DMA".to_string(),
            more => format!("the DMA accesses memory {more} times at most between two ticks"),
        });
    }
    if let Some(other) = &certificate.neighbour {
        let waits: Vec<String> = other.waits.iter().map(u16::to_string).collect();
        all.push(format!(
            "an access of a core behind the bridge at {:#x} waits {} cycles at most for the other \
             core, core by core",
            other.bus,
            waits.join(" and ")
        ));
    }
}

fn of_function(all: &mut Vec<String>, name: &str, function: &Function, functions: &[Function]) {
    if let Some((place, _)) = function.until {
        all.push(format!(
            "{name}: no way that does not come to {place:#x} starts core 1"
        ));
    }
    for (register, [low, high]) in &function.entered {
        let [low, high] = [low, high].map(|word| *word as u32);
        all.push(format!(
            "{name}: R{register} is {low:#x} to {high:#x} where it is entered"
        ));
    }
    for (register, section) in &function.bases {
        let at = format!("the section at {section:#x}");
        all.push(format!(
            "{name}: R{register} points into {at} where a key's mode begins"
        ));
    }
    for (head, rounds) in &function.loops {
        all.push(format!(
            "{name}: the loop at {head:#x} runs {rounds} times at most each time it is entered"
        ));
    }
    for call in &function.calls {
        let (site, callee) = (call.site, call.callee);
        let Some((number, keys)) = call.costs else {
            all.push(format!(
                "{name}: the call at {site:#x} never leads to {callee:#x}"
            ));
            continue;
        };
        let ticks = functions
            .get(number as usize)
            .filter(|own| own.kind == Kind::Keys);
        if ticks.is_some() {
            all.push(format!(
                "{name}: the call at {site:#x} ticks {keys} keys at most"
            ));
        }
    }
}

/// The text.
pub fn explain(certificate: &Certificate, checked: &[Checked], ranges: &[Ranges]) -> String {
    let mut text = String::from("\nproven:\n");
    for frame in checked {
        let sure = match frame.class {
            Evidence::Exact => "exact: published counts are reproduced",
            Evidence::Rule => "rule: documented, without an independent count",
            Evidence::Estimate => "estimate: the least sure number is by analogy, or a bound",
        };
        let _ = writeln!(
            text,
            "  core {} takes at most {} of {} cycles from a tick's request to the return from its \
             handler\n    while program {} plays, {} keys or parts of at most {} cycles; {sure}",
            frame.core, frame.cycles, certificate.deadline, frame.program, frame.keys, frame.key
        );
        for (what, cycles) in &frame.parts {
            let _ = writeln!(text, "    {cycles:>8}  {what}");
        }
        let _ = writeln!(
            text,
            "    its stack takes {} bytes at most and meets nothing; {} states were checked",
            frame.stack, frame.states
        );
    }
    text += "  every instruction that is reached decodes and lies in code of its core, fetched in a \
             cycle;\n  every cycle of the code is in a loop with a bound; every return goes back \
             to its caller;\n  no vector leads elsewhere than to the handler or to the end\n";
    for own in ranges {
        let _ = writeln!(
            text,
            "  no value of the Kernel `{}` leaves its interval: {} values follow from those that \
             they are made of, {} stores have room for what is stored",
            own.kernel, own.values, own.stores
        );
    }
    text += "\nnot checked:\n";
    for what in NOT_CHECKED {
        let _ = writeln!(text, "  {what}");
    }
    let all = assumptions(certificate, ranges);
    let _ = writeln!(text, "\nassumed ({}):", all.len());
    for what in all {
        let _ = writeln!(text, "  {what}");
    }
    text.truncate(text.trim_end().len());
    text
}
