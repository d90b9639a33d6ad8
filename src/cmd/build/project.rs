//! Files for another project: a relocatable file or C text, and beside it the header for C and C++
//! and the module for Rust.
//!
//! A program of several zones is several instruments side by side, each with names of its own.

use std::path::Path;

use whippen_compiler::bindings::{Interface, SafetyInterface, c_header, c_source, rust_module};
use whippen_compiler::firmware::{
    FirmwareError, Setup, safety_numbers, safety_object, with_values_from,
};
use whippen_compiler::image::{Input, Object, SectionKind, Variables, link, relocatable};
use whippen_compiler::kernel::{Kernel, verify};
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::thumb::{self, Built};
use whippen_compiler::variables::variables;
use whippen_runtime::fmu::fmu;
use whippen_runtime::image::{self, ImageInstrument};

use super::Args;
use super::files::{Files, put};
use super::tick_bound::{self, TickBound};
use crate::cmd::proof::ANYWAY;
use crate::cmd::setup::{code_failure, link_failure, symbol_prefix};
use crate::exit::{Failure, Outcome};
use crate::say::{say, tell};

/// What C code for another project says of time, in two lines.
const NOT_PROVEN: &str = "Nothing is proven of its time: which instructions run, what surrounds the keys, and where\n\
                          code and data lie, is up to the project that has it. `whippen budget` proves whole images.";

/// Keys that play one instrument.
pub(super) struct Part<'a> {
    /// Prefix of its names.
    pub name: String,
    /// Its number.
    instrument: usize,
    pub compiled: &'a Compiled,
    pub keys: u32,
    /// Its first key, on the keyboard.
    first: u32,
}

impl Part<'_> {
    /// The kernel with the values of its own keys.
    fn kernel(&self, of: &Kernel) -> Kernel {
        with_values_from(of, self.first)
    }
}

impl Files<'_> {
    /// The zones of the program, by rising key.
    fn parts(&self) -> Result<Vec<Part<'_>>, Failure> {
        let setup = self.setup;
        let layout = setup
            .layout
            .with_keys(setup.keys)
            .map_err(|error| Failure::Usage(format!("{error}: leave --keys away")))?;
        let mut parts: Vec<Part> = Vec::new();
        let zones = layout.programs.iter().flat_map(|program| &program.zones);
        for zone in zones {
            let instrument = zone.instrument.index();
            let compiled = &setup.instruments[instrument];
            let own = symbol_prefix(compiled);
            let is_taken = |name: &str| parts.iter().any(|part| part.name == name);
            let numbered = (2..).map(|nth| format!("{own}_{nth}"));
            let name = std::iter::once(own.clone())
                .chain(numbered)
                .find(|n| !is_taken(n));
            parts.push(Part {
                name: name.unwrap_or(own),
                instrument,
                compiled,
                keys: zone.keys.count(),
                first: zone.keys.first,
            });
        }
        Ok(parts)
    }

    pub(super) fn write_c(&self, args: &Args) -> Outcome {
        let path = &args.output.path;
        let header = path.with_extension("h");
        let include = header.file_name().unwrap_or_default().to_string_lossy();
        let module = path.with_extension("rs");
        let module = module.file_name().unwrap_or_default().to_string_lossy();
        let parts = self.parts()?;
        self.check_names(args, &parts)?;
        let mut interfaces = Vec::new();
        for part in &parts {
            let kernel = part.kernel(&part.compiled.lowered.kernel);
            let kernel = verify(&kernel).map_err(|errors| {
                let told: Vec<String> = errors.iter().map(ToString::to_string).collect();
                Failure::Defect(told.join("; "))
            })?;
            let own = Interface::of_c(part.compiled, kernel, &part.name, part.keys);
            let safety = self.guarded(args, part)?.map(|setup| {
                let numbers = safety_numbers(&setup).map_err(refused)?;
                Ok::<_, Failure>(SafetyInterface::of_c(numbers))
            });
            let own = own.with_safety(safety.transpose()?);
            interfaces.push(own.with_first_key(part.first));
        }
        let sources = interfaces.iter().filter_map(c_source);
        let sources: Vec<String> = sources.collect();
        put_interfaces(path, NOT_PROVEN, &interfaces)?;
        let text = format!("#include \"{include}\"\n\n{}", sources.join("\n"));
        put(path, text.as_bytes())?;
        for part in &parts {
            let (path, keys) = (path.display(), part.keys);
            say!(
                "{path}: {keys} keys of {}, in C, with {include} and {module}",
                part.name
            );
        }
        Ok(())
    }

    /// A source FMU of one key, or of what is played once.
    pub(super) fn write_fmu(&self, path: &Path) -> Outcome {
        let parts = self.parts()?;
        let [part] = &parts[..] else {
            let why = "an .fmu has one instrument; name one of them after the files";
            return Err(Failure::Usage(why.to_string()));
        };
        let kernel = part.kernel(&part.compiled.lowered.kernel);
        let kernel = verify(&kernel).map_err(|errors| {
            let told: Vec<String> = errors.iter().map(ToString::to_string).collect();
            Failure::Defect(told.join("; "))
        })?;
        let own = Interface::of_c(part.compiled, kernel, &part.name, 1);
        let source = c_source(&own).unwrap_or_default();
        let source = format!("#include \"{}.h\"\n\n{source}", own.name);
        let texts = [&source[..], &c_header(&own)];
        let bytes = fmu(part.compiled, &self.setup.device, &own, texts);
        put(path, &bytes)?;
        say!(
            "{}: a key of {} as a source FMU for FMI 3.0, {} bytes",
            path.display(),
            part.name,
            bytes.len()
        );
        Ok(())
    }

    pub(super) fn write_object(&self, args: &Args) -> Outcome {
        let (setup, path) = (self.setup, &args.output.path);
        let parts = self.parts()?;
        self.check_names(args, &parts)?;
        let instruments = self.setup.image_instruments()?;
        let built: Vec<Built> = parts
            .iter()
            .map(|part| self.compiled(part, &instruments[part.instrument], args.safety))
            .collect::<Result<_, _>>()?;
        let safety = self.safety(args, &parts, &built)?;
        let each = || parts.iter().zip(&built);
        let own: Vec<Variables> = each()
            .map(|(part, built)| {
                let modes = &instruments[part.instrument].modes;
                variables(part.compiled, modes, &part.name, &built.layout)
            })
            .collect();
        let interfaces: Vec<Interface> = each()
            .map(|(part, built)| {
                let layout = &built.layout;
                Interface::of(
                    part.compiled,
                    &part.name,
                    part.keys,
                    layout,
                    setup.board.arch,
                )
                .with_first_key(part.first)
                .with_safety(args.safety.then(SafetyInterface::of_object))
            })
            .collect();
        let inputs: Vec<Input> = each()
            .map(|(part, built)| Input {
                object: &built.object,
                places: &instruments[part.instrument].places,
            })
            .collect();
        let mut of_parts: Vec<Vec<Input>> = inputs.iter().map(|input| vec![*input]).collect();
        for (of_part, object) in of_parts.iter_mut().zip(&safety) {
            of_part.push(Input {
                object,
                places: &[],
            });
        }
        let of_time = self.of_time(args, &parts, &instruments, &of_parts)?;
        let inputs = of_parts.concat();
        let (object, places) = Object::joined(&inputs);
        let bytes = relocatable(&object, setup.board.arch, &places, &own)
            .map_err(|error| Failure::Defect(format!("the object file: an address {error}")))?;
        self.tables(args, &inputs, &format!("{}_tick", parts[0].name))?;
        put_interfaces(path, &of_time, &interfaces)?;
        put(path, &bytes)?;
        each().for_each(|(part, built)| report(path, part, built));
        say!("{of_time}");
        Ok(())
    }

    /// What is to be said of the time of all ticks, which one core calls one after the other.
    fn of_time(
        &self,
        args: &Args,
        parts: &[Part],
        instruments: &[ImageInstrument],
        inputs: &[Vec<Input>],
    ) -> Result<String, Failure> {
        let (mut told, mut all, mut period) = (Vec::new(), 0, u64::MAX);
        for (part, input) in parts.iter().zip(inputs) {
            let of = (self.setup, part);
            let bound = TickBound::of(of, &instruments[part.instrument], input);
            if let Ok(bound) = &bound {
                let (most, between) = bound.cycles();
                (all, period) = (all + most, period.min(between));
            }
            told.push(tick_bound::check(of, bound, args.unproven)?);
        }
        if parts.len() > 1 && all > period {
            let why =
                format!("all zones together take up to {all} cycles, and a tick has {period}");
            if !args.unproven {
                tell!("error: {why}\n{ANYWAY}");
                return Err(Failure::Program);
            }
            told.push(format!("Not proven to be in time: {why}."));
        }
        Ok(told.join("\n"))
    }

    fn compiled(
        &self,
        part: &Part,
        instrument: &ImageInstrument,
        gain: bool,
    ) -> Result<Built, Failure> {
        let options = thumb::Options {
            name: part.name.clone(),
            keys: part.keys,
            gain,
            probes: false,
            arch: self.setup.board.arch,
        };
        let built = thumb::compile(&instrument.modes, &options).map_err(code_failure)?;
        let own = part.kernel(&instrument.modes.kernel);
        Ok(built.with_keys_of(&own, part.first))
    }

    /// What guards a part's keys, where that is asked for.
    fn guarded(&self, args: &Args, part: &Part) -> Result<Option<Setup>, Failure> {
        if !args.safety {
            return Ok(None);
        }
        let (device, first) = (&self.setup.device, part.first.try_into().unwrap_or(0));
        let setup = image::setup(part.compiled, device, part.keys, 1, first);
        setup.map(Some).map_err(Failure::Usage)
    }

    /// The code that guards the keys of each part; none where it is not asked for.
    fn safety(&self, args: &Args, parts: &[Part], built: &[Built]) -> Result<Vec<Object>, Failure> {
        let of_part = |(part, built): (&Part, &Built)| {
            let setup = self.guarded(args, part).transpose()?;
            let arch = self.setup.board.arch;
            Some(setup.and_then(|setup| {
                safety_object(&part.name, &built.layout, &setup, arch).map_err(refused)
            }))
        };
        parts.iter().zip(built).filter_map(of_part).collect()
    }

    /// That the names of one part's safety are not those of another part.
    fn check_names(&self, args: &Args, parts: &[Part]) -> Outcome {
        let is_safety_of = |part: &Part, other: &Part| part.name == format!("{}_safe", other.name);
        let taken = parts.iter().find(|part| {
            let mut others = parts.iter();
            args.safety && others.any(|other| is_safety_of(part, other))
        });
        taken.map_or(Ok(()), |part| {
            Err(Failure::Usage(format!(
                "--safety: `{}` is what the safety of another zone is called: give it another name",
                part.name
            )))
        })
    }

    /// Map and listing, with addresses as on the board.
    fn tables(&self, args: &Args, inputs: &[Input], entry: &str) -> Outcome {
        if args.map.is_none() && args.listing.is_none() {
            return Ok(());
        }
        let board = tick_bound::board_to_link_for(self.setup);
        let image = link(&board, inputs, entry).map_err(link_failure)?;
        self.listings(args, &image, &board)
    }
}

/// Why keys cannot be guarded.
fn refused(why: FirmwareError) -> Failure {
    Failure::Usage(why.to_string())
}

/// The header and the module beside a file; of several instruments, a module for each.
fn put_interfaces(path: &Path, of_time: &str, all: &[Interface]) -> Outcome {
    let headers: Vec<String> = all.iter().map(c_header).collect();
    let header = format!(
        "/* {} */\n{}",
        of_time.replace('\n', "\n   "),
        headers.join("\n")
    );
    let before = std::fs::read_to_string(path.with_extension("h")).unwrap_or_default();
    tell_of_other(path, &before, &header);
    put(&path.with_extension("h"), header.as_bytes())?;
    let module = |own: &Interface| match all.len() {
        1 => rust_module(own),
        _ => format!("pub mod {} {{\n{}}}\n", own.name, rust_module(own)),
    };
    let modules: Vec<String> = all.iter().map(module).collect();
    let note: String = of_time.lines().map(|line| format!("// {line}\n")).collect();
    put(
        &path.with_extension("rs"),
        (note + &modules.join("\n")).as_bytes(),
    )
}

/// Tells that a header is replaced which belongs to the other kind of file: both have one name, and
/// the memory of the keys lies differently.
fn tell_of_other(path: &Path, before: &str, now: &str) {
    let is_of_object = |header: &str| header.contains("private_");
    let ending = if is_of_object(now) { "c" } else { "o" };
    let other = path.with_extension(ending);
    let is_ours = before.contains("Written by Whippen");
    if is_ours && is_of_object(before) != is_of_object(now) && other.exists() {
        tell!(
            "note: {} and {} are for {} now, and do not fit {}: give one of them another name",
            path.with_extension("h").display(),
            path.with_extension("rs").display(),
            path.display(),
            other.display()
        );
    }
}

fn report(path: &Path, part: &Part, built: &Built) {
    let code = built.object.sections.iter();
    let code = code.filter(|section| section.kind == SectionKind::Code);
    let code: u32 = code.map(|section| section.size).sum();
    let state = built.layout.size();
    let each = built.layout.record(1) - built.layout.record(0);
    say!(
        "{}: {} keys of {}, {code} bytes of code, {state} bytes of state, {each} bytes a key and its history",
        path.display(),
        part.keys,
        part.name
    );
}
