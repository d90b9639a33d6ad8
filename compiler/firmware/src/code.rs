//! The keys' code of all programs and cores: compiled once for each instrument, number of keys and
//! calling convention, under a symbolic owner whose name is put in afterwards.

use whippen_arm::image::{Hint, Object};
use whippen_arm::thumb::{self, Built, ThumbError, TickAbi, compile_for_frame, record_bytes};
use whippen_ids::IdMap;
use whippen_isa::Arch;
use whippen_kernel::Kernel;
use whippen_keyboard::{
    CoreId, CoreKeys, CoreZone, InstrumentId, KeyRange, Layout, Program, ProgramId, Zone, ZoneId,
};

use super::emptying::EmptyPiece;
use super::parts::{self, Cut, InParts, PartCode};
use super::{Instrument, Setup, drive_offset_bytes, keys_name, zone_name};

/// Stands in symbols and names of sections for the name of whose keys they are.
const OWNER: &str = "(owner)";

/// The code of a program.
#[derive(Debug, Clone)]
pub struct ProgramCode {
    /// The zones of the program.
    pub zones: IdMap<ZoneId, Zone>,
    /// Each core.
    pub cores: IdMap<CoreId, CoreCode>,
}

/// The keys of a core in a program.
#[derive(Debug, Clone)]
pub struct CoreCode {
    /// The prefix of the symbols that the frame calls: [`keys_name`].
    pub name: String,
    /// The core.
    pub core: CoreId,
    /// All its keys.
    pub keys: KeyRange,
    /// By rising key, at least one.
    pub zones: Vec<ZoneCode>,
    /// What runs before the only zone, where that is the tail of an instrument in parts.
    pub cut: Option<Cut>,
}

/// The code of the keys that a core has of a zone.
#[derive(Debug, Clone)]
pub struct ZoneCode {
    /// The prefix of its symbols: that of the core, or [`zone_name`] where the core has several.
    pub name: String,
    /// Which keys, of which zone, on which core.
    pub of: CoreZone,
    /// Its first key, counted from the core's first key.
    pub first_on_core: u32,
    /// Code, state, and where the state has what.
    pub built: Built,
    /// What its lines hold when it begins, but for those that a key fills itself.
    pub empty_pieces: Vec<EmptyPiece>,
    /// The cells of what is heard of it: none, one for both sides, or left and right.
    pub channels: Vec<usize>,
}

impl ProgramCode {
    /// The code of a core.
    pub fn core(&self, core: CoreId) -> &CoreCode {
        &self.cores[core]
    }

    /// The zones of all cores, core by core.
    pub fn zones(&self) -> impl Iterator<Item = &ZoneCode> {
        self.cores.iter().flat_map(|core| &core.zones)
    }

    /// The parts of all cores, but for tails, which are zones.
    pub fn parts(&self) -> impl Iterator<Item = &PartCode> {
        let cuts = self.cores.iter().flat_map(|core| &core.cut);
        cuts.flat_map(|cut| &cut.parts)
    }

    /// Whether its instrument is in parts.
    pub fn is_in_parts(&self) -> bool {
        self.cores.iter().any(|core| core.cut.is_some())
    }

    /// Everything that is compiled for a core.
    pub(super) fn built_mut(&mut self, core: CoreId) -> Vec<&mut Built> {
        let mut all = Vec::new();
        for own in &mut self.cores {
            let zones = own.zones.iter_mut().filter(|_| own.core == core);
            all.extend(zones.map(|zone| &mut zone.built));
            let parts = own.cut.iter_mut().flat_map(|cut| &mut cut.parts);
            let parts = parts.filter(|part| part.core == core.index());
            all.extend(parts.map(|part| &mut part.built));
        }
        all
    }

    /// Whether core 1 alone has what is heard, and sums it.
    pub(super) fn cut_has_sound(&self) -> bool {
        let mut cuts = self.cores.iter().flat_map(|core| &core.cut);
        cuts.any(Cut::has_sound)
    }

    /// Everything that is compiled.
    pub(super) fn built(&self) -> impl Iterator<Item = &Built> {
        let zones = self.zones().map(|zone| &zone.built);
        zones.chain(self.parts().map(|part| &part.built))
    }

    /// What a zone's keys play.
    pub fn instrument_of(&self, zone: &ZoneCode) -> InstrumentId {
        self.zones[zone.of.zone].instrument
    }
}

impl CoreCode {
    /// Whether it has keys of several zones.
    pub fn is_split(&self) -> bool {
        self.zones.len() > 1
    }
}

impl ZoneCode {
    /// How many keys it has.
    pub fn keys(&self) -> u32 {
        self.of.keys.count()
    }

    /// Where its state has what.
    pub fn layout(&self) -> &thumb::StateLayout {
        &self.built.layout
    }
}

/// Whether some core has keys of several zones in one program: then records are listed (`zones`).
pub fn is_split(programs: &[ProgramCode]) -> bool {
    let mut cores = programs.iter().flat_map(|program| &program.cores);
    cores.any(CoreCode::is_split)
}

/// Whether a program begins after the start: another one, or the same one behind the tuning of
/// sensors or for the monitor. An instrument in parts, which plays alone, does not.
pub(super) fn begins_later(programs: &[ProgramCode], setup: &Setup) -> bool {
    programs.len() > 1 || setup.tuning.is_some() || begins_anew(programs, setup)
}

/// Whether a program that plays may begin anew.
pub(super) fn begins_anew(programs: &[ProgramCode], setup: &Setup) -> bool {
    setup.monitor.is_some() && !programs.iter().any(ProgramCode::is_in_parts)
}

/// Whether live values that are set wait for a tick that all cores have.
pub(super) fn is_latched(programs: &[ProgramCode]) -> bool {
    let is_shared = |program: &ProgramCode| program.cores.len() > 1;
    let mut zones = programs.iter().flat_map(ProgramCode::zones);
    programs.iter().any(is_shared) && zones.any(|zone| zone.layout().live_param(0).is_some())
}

/// Compiles the keys of all programs on all cores.
pub(super) fn compile_keys(
    layout: &Layout,
    instruments: &[Instrument],
    setup: &Setup,
    arch: Arch,
    division: &[usize],
) -> Result<IdMap<ProgramId, ProgramCode>, ThumbError> {
    let on_cores = |program: &Program| program.on_cores(&setup.keys);
    let plans: Vec<Vec<CoreKeys>> = layout.programs.iter().map(on_cores).collect();
    let split = plans.iter().flatten().any(|core| core.zones.len() > 1);
    let mut compiler = KeysCompiler {
        instruments,
        setup,
        arch,
        division,
        record_bytes: 0,
        compiled: Vec::new(),
    };
    // One size of records for all, so that what runs through the gains need not ask which program
    // plays; or a table of them.
    if !split {
        compiler.record_bytes = compiler.largest_record(layout, setup.keys[0]);
    }
    let numbered = layout.numbered_programs().zip(plans);
    numbered
        .map(|((number, program), plan)| {
            let core = |core: CoreKeys| compiler.core(number.index(), program, core);
            Ok(ProgramCode {
                zones: program.zones.clone(),
                cores: plan.into_iter().map(core).collect::<Result<_, _>>()?,
            })
        })
        .collect()
}

/// What decides about the bytes of a zone's code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct CodeKey {
    instrument: InstrumentId,
    keys: u32,
    abi: TickAbi,
}

/// Compiles keys, and remembers what is compiled.
struct KeysCompiler<'a> {
    instruments: &'a [Instrument<'a>],
    setup: &'a Setup,
    arch: Arch,
    /// The core of every part of an instrument in parts.
    division: &'a [usize],
    /// The least bytes of a record.
    record_bytes: u32,
    /// Under the symbolic owner.
    compiled: Vec<(CodeKey, Built)>,
}

impl KeysCompiler<'_> {
    fn largest_record(&self, layout: &Layout, keys: u32) -> u32 {
        let bytes = |id: InstrumentId| {
            let kernel = &self.instruments[id.index()].modes.kernel;
            record_bytes(kernel, &self.options(keys))
        };
        let all = layout.instruments().into_iter().map(bytes);
        all.max().unwrap_or(0)
    }

    fn options(&self, keys: u32) -> thumb::Options {
        thumb::Options {
            name: OWNER.to_string(),
            keys,
            gain: true,
            probes: false,
            arch: self.arch,
        }
    }

    /// The code of a core's keys in the program of that number.
    fn core(
        &mut self,
        number: usize,
        program: &Program,
        core: CoreKeys,
    ) -> Result<CoreCode, ThumbError> {
        let name = keys_name(core.core.index(), number);
        if let [zone] = &core.zones[..] {
            let instrument = program.zone(zone.zone).instrument;
            if let Some(in_parts) = self.instruments[instrument.index()].parts {
                return self.in_parts(name, &core, *zone, in_parts);
            }
        }
        let mut zones = Vec::new();
        for (at, zone) in core.zones.iter().enumerate() {
            let name = match core.zones.len() {
                1 => name.clone(),
                _ => zone_name(&name, at),
            };
            let instrument = program.zone(zone.zone).instrument;
            let first_on_core = core.offset_of(zone);
            let generic = self.zone(instrument, zone.keys.count(), core.keys.count())?;
            let kernel = &self.instruments[instrument.index()].modes.kernel;
            let own = with_values_from(kernel, zone.keys.first);
            zones.push(ZoneCode {
                empty_pieces: EmptyPiece::of(kernel, &generic.layout.lines()),
                built: named(generic, &name).with_keys_of(&own, first_on_core),
                channels: kernel.channels(),
                name,
                of: *zone,
                first_on_core,
            });
        }
        Ok(CoreCode {
            name,
            core: core.core,
            keys: core.keys,
            zones,
            cut: None,
        })
    }

    /// The code of an instrument in parts, whose tail is the zone.
    fn in_parts(
        &self,
        name: String,
        core: &CoreKeys,
        of: CoreZone,
        in_parts: &InParts,
    ) -> Result<CoreCode, ThumbError> {
        let abi = TickAbi {
            drive_offset: drive_offset_bytes(self.setup.words_of(1)),
            record_bytes_min: 0,
            shares: false,
        };
        let numbered = in_parts.modes.iter().zip(&in_parts.parts.parts).enumerate();
        let mut parts = Vec::new();
        for (number, (modes, part)) in numbered {
            let on_core = self.division.get(number).copied().unwrap_or(0);
            let name = parts::part_name(on_core, number);
            let options = thumb::Options {
                name: name.clone(),
                ..self.options(1)
            };
            parts.push(PartCode {
                built: compile_for_frame(modes, &options, &abi)?,
                role: part.role,
                core: on_core,
                name,
            });
        }
        let tail = parts.pop();
        let tail = tail.ok_or_else(|| ThumbError::Bug("no tail".to_string()))?;
        let zone = ZoneCode {
            channels: in_parts.heard().map_or_else(Vec::new, Kernel::channels),
            // An instrument in parts begins once, at the start.
            empty_pieces: Vec::new(),
            built: parts::with_names_of_frame(tail.built, &tail.name, &name),
            name: tail.name,
            of,
            first_on_core: core.offset_of(&of),
        };
        let cut = Cut::new(parts, in_parts);
        parts::check(&cut, &zone)?;
        Ok(CoreCode {
            name,
            core: core.core,
            keys: core.keys,
            zones: vec![zone],
            cut: Some(cut),
        })
    }

    /// The code of so many keys on a core that has so many in all, under the symbolic owner.
    fn zone(
        &mut self,
        instrument: InstrumentId,
        keys: u32,
        keys_of_core: u32,
    ) -> Result<Built, ThumbError> {
        let key = CodeKey {
            instrument,
            keys,
            abi: TickAbi {
                drive_offset: drive_offset_bytes(self.setup.words_of(keys_of_core)),
                record_bytes_min: self.record_bytes,
                shares: true,
            },
        };
        if let Some((_, built)) = self.compiled.iter().find(|(known, _)| *known == key) {
            return Ok(built.clone());
        }
        let modes = self.instruments[instrument.index()].modes;
        let built = compile_for_frame(modes, &self.options(keys), &key.abi)?;
        self.compiled.push((key, built.clone()));
        Ok(built)
    }
}

/// The kernel for keys from one on: values per key begin there.
pub fn with_values_from(kernel: &Kernel, first: u32) -> Kernel {
    let mut own = kernel.clone();
    for keyed in &mut own.keyed {
        // A list that is too short goes on with its last value.
        let from = (first as usize).min(keyed.values.len().saturating_sub(1));
        keyed.values.drain(..from);
    }
    own
}

/// The code with a name for the symbolic owner.
fn named(mut built: Built, owner: &str) -> Built {
    name_owner(&mut built.object, owner);
    built
}

fn name_owner(object: &mut Object, owner: &str) {
    let name = |text: &mut String| *text = text.replace(OWNER, owner);
    for section in &mut object.sections {
        name(&mut section.name);
        let fixups = section.fixups.iter_mut();
        fixups.for_each(|fixup| name(&mut fixup.symbol));
        for hint in &mut section.hints {
            if let Hint::Targets { symbols, .. } = hint {
                symbols.iter_mut().for_each(name);
            }
        }
    }
    let symbols = object.symbols.iter_mut();
    symbols.for_each(|symbol| name(&mut symbol.name));
}

#[cfg(test)]
mod tests {
    use super::*;
    use whippen_kernel::parse;
    use whippen_modes::Modes;

    const TEXT: &str = "kernel direct @44100 {
  in x: u16 [0..65535]
  out f: i16 [-32768..32767]
  keyed weight: i32 [0..9] = { 1, 2, 3, 4, 5, 6, 7, 8, 9 }
  event loud(1)
  tick {
    v0: i32 [0..65535] = in x
    v1: i32 [32768..32768] = const 32768
    v2: i32 [0..9] = keyed weight
    v3: i32 [-32768..32767] = sub v0 v1
    v4: i32 [-32777..32767] = sub v3 v2
    v5: i32 [-32768..-32768] = const -32768
    v6: i32 [-32768..32767] = max v4 v5
    out f v6
  }
}
";

    /// Code under the symbolic owner, named and with other keys, is what would have been compiled
    /// under that name for these keys.
    #[test]
    fn named_code_is_what_the_name_would_have_been_compiled_to() {
        let kernel = parse(TEXT).unwrap_or_else(|error| panic!("{error:?}"));
        let keys = [0, 7].map(|first| with_values_from(&kernel, first));
        assert_ne!(keys[0].keyed, keys[1].keyed);
        let compiled = |name: &str, kernel: &Kernel| {
            let options = thumb::Options {
                name: name.to_string(),
                keys: 7,
                gain: true,
                probes: false,
                arch: Arch::V8M,
            };
            let abi = TickAbi {
                drive_offset: 28,
                record_bytes_min: 40,
                shares: true,
            };
            compile_for_frame(&Modes::single(kernel), &options, &abi)
                .unwrap_or_else(|error| panic!("{error}"))
        };
        for program in [0, 3] {
            let name = keys_name(1, program);
            assert_eq!(
                named(compiled(OWNER, &keys[0]), &name).with_keys_of(&keys[1], 0),
                compiled(&name, &keys[1])
            );
        }
    }
}
