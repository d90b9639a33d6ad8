//! The handler's calls of the keys: which there are, and what each costs.
//!
//! An image has the keys' code of several programs. A frame is bounded while one of them plays;
//! calls of the others cost nothing in it, because each call goes to the one that plays.

use std::collections::BTreeMap;

use whippen_isa::timing::Target;

use super::program::Program;
use super::tick_handler::{OnCore, ZoneBound, find};
use super::{Annotations, Bound, Known, NotBounded, Query, Step, bound};
use whippen_firmware::{BEGINS, PARTS};

/// All calls, by what they lead to.
pub struct Calls {
    /// Where the keys' tick comes back to.
    pub return_to: Option<Target>,
    /// Address of the tick and of the function that begins a key, of the program that plays.
    tick: u32,
    begin: u32,
    /// Both of all other programs.
    others: Vec<u32>,
    /// Where all keys are ticked; where those are that have begun, one less at most; where one
    /// begins.
    whole: Vec<u32>,
    begun: Vec<u32>,
    beginning: Vec<u32>,
}

impl Calls {
    /// Finds them in the targets that come with the image.
    pub fn find(of: &OnCore) -> Result<Self, NotBounded> {
        let program = of.program;
        let [tick, begin] = entries(program, &of.playing.name)?;
        let mut others = Vec::new();
        for code in of.programs {
            others.extend(entries(program, &code.name)?);
        }
        others.retain(|address| *address != tick && *address != begin);
        let (mut whole, mut begun, mut beginning) = (Vec::new(), Vec::new(), Vec::new());
        for (&at, targets) in &program.annotations.targets {
            let leads = |to: u32| targets.iter().any(|target| target & !1 == to);
            match () {
                () if leads(begin) => beginning.push(at),
                () if leads(tick) && part(program, at) == BEGINS => begun.push(at),
                () if leads(tick) => whole.push(at),
                () => {}
            }
        }
        let returns: Vec<Target> = whole
            .iter()
            .chain(&begun)
            .map(|&at| behind(program, at))
            .collect();
        // One place to return to is right for all if it is the most expensive.
        let worst = returns
            .iter()
            .find(|target| target.wide && target.address & 2 != 0);
        let return_to = worst.or(returns.first()).copied();
        Ok(Self {
            return_to,
            tick,
            begin,
            others,
            whole,
            begun,
            beginning,
        })
    }

    /// What a call costs that begins a key. The code is that of `init`, whose loop over the keys
    /// runs once; of several zones, the most expensive.
    pub fn begin(&self, of: &OnCore) -> Result<Bound, NotBounded> {
        begins(
            of,
            &of.playing.name,
            of.playing.keys.count(),
            BTreeMap::new(),
        )
    }

    /// What the keys of a program cost, where its core has zones: the calls between them are code
    /// like other.
    pub fn costs(&self, of: &OnCore, zones: &[ZoneBound]) -> Result<Costs, NotBounded> {
        let begin = self.begin(of)?;
        if let [zone] = zones {
            let ticked = |keys| Known {
                cycles: zone.tick.cycles_max(keys),
                stack_bytes: zone.tick.stack_bytes_max(),
            };
            return Ok(Costs {
                whole: ticked(zone.keys()),
                begun: ticked(zone.keys().saturating_sub(1)),
                begin,
            });
        }
        let known = |what: &str, cost: &dyn Fn(&ZoneBound) -> Known| {
            let one = |zone: &ZoneBound| {
                Ok((
                    (None, find(of.program, &format!("{}_{what}", zone.name))?),
                    cost(zone),
                ))
            };
            zones
                .iter()
                .map(one)
                .collect::<Result<BTreeMap<_, _>, NotBounded>>()
        };
        let tick = |zone: &ZoneBound| Known {
            cycles: zone.tick.cycles_max(zone.keys()),
            stack_bytes: zone.tick.stack_bytes_max(),
        };
        let annotations = Annotations {
            known: known("tick", &tick)?,
            bases: of.stack_base()?,
            return_to: self.return_to,
            entered: of.entered(&of.playing.name, None),
            ..of.program.annotations.clone()
        };
        let (core, code, interference) = (of.core, &of.program.code, Some(of.interference));
        let all = bound(&Query {
            core,
            code,
            entry: self.tick,
            annotations: &annotations,
            interference,
        })?;
        if !all.settled {
            return Err(NotBounded::Unsettled { address: self.tick });
        }
        let whole = Known {
            cycles: all.cycles_max,
            stack_bytes: all.stack_bytes_max,
        };
        // Some key begins, those below it play, those above it do not: which one costs most?
        let finds = begins(
            of,
            &of.playing.name,
            of.playing.keys.count(),
            known("begin", &|_| Known::default())?,
        )?;
        let (mut above, mut worst) = (0, 0);
        for zone in zones.iter().rev() {
            let own = begins(of, &zone.name, zone.keys(), BTreeMap::new())?;
            let key = zone.tick.key_cycles_max();
            let played = whole.cycles.saturating_sub(above + key);
            worst = worst.max(played + own.cycles_max + finds.cycles_max);
            above += u64::from(zone.keys()) * key;
        }
        // Both are called on the same way, so what one call costs may be charged to the other.
        let begun = Known {
            cycles: worst.saturating_sub(begin.cycles_max),
            ..whole
        };
        Ok(Costs {
            whole,
            begun,
            begin,
        })
    }

    /// The costs of all calls.
    pub fn known(&self, costs: &Costs) -> BTreeMap<(Option<u32>, u32), Known> {
        let begins = Known {
            cycles: costs.begin.cycles_max,
            stack_bytes: costs.begin.stack_bytes_max,
        };
        let whole = self
            .whole
            .iter()
            .map(|&at| ((Some(at), self.tick), costs.whole));
        let begun = self
            .begun
            .iter()
            .map(|&at| ((Some(at), self.tick), costs.begun));
        let beginning = self
            .beginning
            .iter()
            .map(|&at| ((Some(at), self.begin), begins));
        let sites = self.whole.iter().chain(&self.begun).chain(&self.beginning);
        let nobody = sites.flat_map(|&at| {
            self.others
                .iter()
                .map(move |&other| ((Some(at), other), Known::default()))
        });
        whole.chain(begun).chain(beginning).chain(nobody).collect()
    }

    /// The cycles of the handler's worst-case path by part, without those of so many cycles of
    /// keys.
    pub fn parts(&self, program: &Program, path: &[Step], keys_cycles: u64) -> Vec<(String, u64)> {
        let mut parts: Vec<(String, i64)> = Vec::new();
        let begins = path.iter().any(|step| step.address == self.begin);
        for step in path {
            let name = match step.address {
                at if at != self.tick && at != self.begin => part(program, at),
                _ if begins => BEGINS,
                _ => "to the first key and from the last",
            };
            let keys = if step.address == self.tick {
                keys_cycles
            } else {
                0
            };
            let cycles = step.cycles as i64 - keys as i64;
            match parts.iter_mut().find(|(known, _)| *known == name) {
                Some((_, sum)) => *sum += cycles,
                None => parts.push((name.to_string(), cycles)),
            }
        }
        parts
            .into_iter()
            .map(|(name, cycles)| (name, cycles.max(0) as u64))
            .collect()
    }
}

/// Addresses of the tick of keys of that name, and of the function that begins one of them.
fn entries(program: &Program, name: &str) -> Result<[u32; 2], NotBounded> {
    Ok([
        find(program, &format!("{name}_tick"))?,
        find(program, &format!("{name}_begin"))?,
    ])
}

/// What a program's keys cost.
pub struct Costs {
    /// All of them.
    whole: Known,
    /// Those that have begun, one less at most.
    begun: Known,
    /// One that begins.
    begin: Bound,
}

/// The bound of the function that begins one of so many keys of that name: each of its loops over
/// keys runs once.
fn begins(
    of: &OnCore,
    name: &str,
    keys: u32,
    known: BTreeMap<(Option<u32>, u32), Known>,
) -> Result<Bound, NotBounded> {
    let entry = find(of.program, &format!("{name}_begin"))?;
    let entered = of.entered(name, Some(keys));
    let bases = of.stack_base()?;
    let mut annotations = Annotations {
        known,
        entered,
        bases,
        ..of.program.annotations.clone()
    };
    let (core, code, interference) = (of.core, &of.program.code, Some(of.interference));
    loop {
        let found = bound(&Query {
            core,
            code,
            entry,
            annotations: &annotations,
            interference,
        });
        match found {
            Err(NotBounded::NoRounds { head }) if !annotations.loops.contains_key(&head) => {
                annotations.loops.insert(head, 1);
            }
            found => return found,
        }
    }
}

/// Where a call through a register comes back to.
fn behind(program: &Program, call: u32) -> Target {
    let address = call + if program.code.is_wide_at(call) { 4 } else { 2 };
    Target {
        address,
        wide: program.code.is_wide_at(address),
    }
}

/// The part of the handler that an address belongs to.
fn part(program: &Program, address: u32) -> &'static str {
    let before = program
        .names
        .range(..=address)
        .rev()
        .flat_map(|(_, names)| names);
    let known = before
        .filter_map(|name| PARTS.iter().find(|(symbol, _)| symbol == name))
        .next();
    known.map_or("elsewhere", |(_, words)| words)
}
