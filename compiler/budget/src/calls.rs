//! The handler's calls of the keys: which there are, and what each costs.
//!
//! An image has the keys' code of several programs. A frame is bounded while one of them plays;
//! calls of the others cost nothing in it, because each call goes to the one that plays.

use std::collections::BTreeMap;

use whippen_audit::Call as Certified;
use whippen_isa::timing::Target;

use super::parts::CutBound;
use super::program::Program;
use super::tick_handler::{OnCore, ZoneBound, find};
use super::{Annotations, Bound, Known, NotBounded, Step, bound};
use whippen_firmware::{BEGINS, PARTS};

/// All calls, by what they lead to.
pub struct Calls {
    /// Where the keys' tick comes back to.
    pub return_to: Option<Target>,
    /// Address of the tick and of the function that begins a key, of the program that plays.
    pub(super) tick: u32,
    pub(super) begin: u32,
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
        Ok(Self {
            return_to: most_expensive(&returns),
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

    /// What the keys of a program cost. Where its core has several zones, or its instrument parts,
    /// the calls between them are code like other.
    pub fn costs(
        &self,
        of: &OnCore,
        zones: &[ZoneBound],
        cut: Option<&CutBound>,
    ) -> Result<Costs, NotBounded> {
        let begin = self.begin(of)?;
        if let ([tail], Some(cut)) = (zones, cut) {
            let row = self.bound_row(of, of.known_of_row(tail, cut)?)?;
            let whole = Known {
                cycles: row.cycles_max,
                stack_bytes: row.stack_bytes_max,
            };
            return Ok(Costs {
                whole,
                begun: whole,
                begin,
                begin_at: self.begin,
                row: Some(row),
            });
        }
        if let [zone] = zones {
            return Ok(Costs {
                whole: zone.known(zone.keys()),
                begun: zone.known(zone.keys().saturating_sub(1)),
                begin,
                begin_at: self.begin,
                row: None,
            });
        }
        let ticked = |zone: &ZoneBound| zone.known(zone.keys());
        let row = self.bound_row(of, known_by_zone(of, zones, "tick", ticked)?)?;
        let whole = Known {
            cycles: row.cycles_max,
            stack_bytes: row.stack_bytes_max,
        };
        let worst = worst_beginning(of, zones, whole.cycles)?;
        // Both are called on the same path, so what one call costs may be charged to the other.
        let begun = Known {
            cycles: worst.saturating_sub(begin.cycles_max),
            ..whole
        };
        Ok(Costs {
            whole,
            begun,
            begin,
            begin_at: self.begin,
            row: Some(row),
        })
    }

    /// The row of calls that ticks one zone, or part, after the other.
    fn bound_row(&self, of: &OnCore, known: KnownCalls) -> Result<Bound, NotBounded> {
        let annotations = Annotations {
            known,
            bases: of.stack_base()?,
            return_to: self.return_to,
            entered: of.entered(&of.playing.name, None),
            ..of.program.annotations.clone()
        };
        let all = bound(&of.query(self.tick, &annotations))?;
        if !all.settled {
            return Err(NotBounded::Unsettled { address: self.tick });
        }
        Ok(all)
    }

    /// The costs of all calls.
    pub fn known(&self, costs: &Costs) -> KnownCalls {
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

    /// The same for a certificate: what ticks all keys, those that have begun where one begins, and
    /// the one that begins, each as the number of a function and how many keys it ticks.
    pub fn certified(&self, [whole, begun, begin]: [(u32, u32); 3]) -> Vec<Certified> {
        let to = |sites: &[u32], callee, costs| {
            let call = |site: &u32| Certified {
                site: *site,
                callee,
                costs,
            };
            sites.iter().map(call).collect::<Vec<_>>()
        };
        let mut all = to(&self.whole, self.tick, Some(whole));
        all.extend(to(&self.begun, self.tick, Some(begun)));
        all.extend(to(&self.beginning, self.begin, Some(begin)));
        for sites in [&self.whole, &self.begun, &self.beginning] {
            all.extend(self.others.iter().flat_map(|other| to(sites, *other, None)));
        }
        all
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
    /// Where that one begins.
    begin_at: u32,
    /// The calls of several zones.
    pub row: Option<Bound>,
}

impl Costs {
    /// The bound of the key that begins, where one does on a path.
    pub fn begins_on(&self, path: &[Step]) -> Option<&Bound> {
        let begins = path.iter().any(|step| step.address == self.begin_at);
        begins.then_some(&self.begin)
    }
}

/// What is known of called functions: by the address of the call (none: wherever it is) and of the
/// function.
pub type KnownCalls = BTreeMap<(Option<u32>, u32), Known>;

impl ZoneBound {
    /// What a tick of so many of its keys costs.
    fn known(&self, keys: u32) -> Known {
        Known {
            cycles: self.tick.cycles_max(keys),
            stack_bytes: self.tick.stack_bytes_max(),
        }
    }
}

/// The costs of the function `what` of each zone.
fn known_by_zone(
    of: &OnCore,
    zones: &[ZoneBound],
    what: &str,
    cost: impl Fn(&ZoneBound) -> Known,
) -> Result<KnownCalls, NotBounded> {
    let of_zone = |zone: &ZoneBound| {
        let entry = find(of.program, &format!("{}_{what}", zone.name))?;
        Ok(((None, entry), cost(zone)))
    };
    zones.iter().map(of_zone).collect()
}

/// Cycles of a tick in which a key begins, at most, where all keys together take `whole`: those
/// below it play, those above it do not.
fn worst_beginning(of: &OnCore, zones: &[ZoneBound], whole: u64) -> Result<u64, NotBounded> {
    let finds = begins(
        of,
        &of.playing.name,
        of.playing.keys.count(),
        known_by_zone(of, zones, "begin", |_| Known::default())?,
    )?;
    let row = zones.iter().map(|zone| {
        let own = begins(of, &zone.name, zone.keys(), BTreeMap::new())?;
        let key = zone.tick.key_cycles_max();
        Ok((zone.keys(), key, own.cycles_max + finds.cycles_max))
    });
    Ok(worst_of_row(
        &row.collect::<Result<Vec<_>, NotBounded>>()?,
        whole,
    ))
}

/// The same of zones by their keys, what a key takes, and what it takes to begin one: most where
/// the last key of a zone begins.
fn worst_of_row(row: &[(u32, u64, u64)], whole: u64) -> u64 {
    let mut above = 0;
    let mut worst = 0;
    for (keys, key, begin) in row.iter().rev() {
        worst = worst.max(whole.saturating_sub(above + key) + begin);
        above += u64::from(*keys) * key;
    }
    worst
}

/// The bound of the function that begins one of so many keys of that name: each of its loops over
/// keys runs once.
fn begins(of: &OnCore, name: &str, keys: u32, known: KnownCalls) -> Result<Bound, NotBounded> {
    let entry = find(of.program, &format!("{name}_begin"))?;
    let entered = of.entered(name, Some(keys));
    let bases = of.stack_base()?;
    let mut annotations = Annotations {
        known,
        entered,
        bases,
        ..of.program.annotations.clone()
    };
    loop {
        match bound(&of.query(entry, &annotations)) {
            Err(NotBounded::NoRounds { head }) => {
                annotations.loops.insert(head, 1);
            }
            found => return found,
        }
    }
}

/// The place to return to that is right for all of these: the most expensive.
fn most_expensive(returns: &[Target]) -> Option<Target> {
    let worst = returns
        .iter()
        .find(|target| target.wide && target.address & 2 != 0);
    worst.or(returns.first()).copied()
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cores::tests::{section, whole};
    use crate::{Code, Query};
    use whippen_isa::Arch;
    use whippen_isa::timing::Core;
    use whippen_words::assembled;

    /// By what a return there takes.
    #[test]
    fn the_most_expensive_return_is_right_for_all() {
        let place = |(address, wide)| Target { address, wide };
        let places = [(8, false), (10, false), (12, true), (14, true)].map(place);
        let cycles = |to: Target| {
            let annotations = Annotations {
                return_to: Some(to),
                ..Annotations::default()
            };
            let query = Query {
                core: &Core::cortex_m33(),
                code: &Code::new(0x100, vec![0x70, 0x47]),
                entry: 0x100,
                annotations: &annotations,
                interference: None,
            };
            bound(&query).expect("a bound").cycles_max
        };
        for some in places.iter().flat_map(|a| places.map(|b| [*a, b])) {
            let found = most_expensive(&some).expect("one");
            let most = some.map(cycles).into_iter().max();
            assert!(some.contains(&found) && Some(cycles(found)) == most);
        }
        assert!(cycles(places[3]) > cycles(places[2]));
        assert_eq!(most_expensive(&[]), None);
    }

    #[test]
    fn a_call_comes_back_behind_itself() {
        let bytes = assembled(&["blx r3", "nop.w", "nop"], Arch::V8M);
        let mut text = section(".text.core0", 0x2000_0000, bytes.len() as u32);
        text.bytes = bytes;
        let program = Program::of(&whole(1, vec![text]).image);
        let narrow = Target {
            address: 0x2000_0002,
            wide: true,
        };
        let wide = Target {
            address: 0x2000_0006,
            wide: false,
        };
        assert_eq!(
            [0, 2].map(|at| behind(&program, 0x2000_0000 + at)),
            [narrow, wide]
        );
    }

    /// By each key of a row that may begin: those above it do not play.
    #[test]
    fn a_key_begins_where_it_costs_most() {
        let rows: [&[(u32, u64, u64)]; 4] = [
            &[(2, 30, 100)],
            &[(2, 30, 100), (5, 20, 90), (3, 7, 400)],
            &[(2, 30, 900), (5, 20, 90), (3, 7, 40)],
            &[(4, 10, 300), (2, 50, 310), (1, 60, 10)],
        ];
        for row in rows {
            let zone = |&(keys, key, begin): &(u32, u64, u64)| {
                std::iter::repeat_n((key, begin), keys as usize)
            };
            let keys: Vec<(u64, u64)> = row.iter().flat_map(zone).collect();
            let around = 25;
            let below = |at: usize| keys[..at].iter().map(|(key, _)| key).sum::<u64>();
            let beginning = (0..keys.len()).map(|at| around + below(at) + keys[at].1);
            let whole = around + below(keys.len());
            assert_eq!(Some(worst_of_row(row, whole)), beginning.max(), "{row:?}");
        }
    }
}
