//! The files of a build, each written whole or not at all.

use std::path::{Path, PathBuf};

use whippen_compiler::bindings::{Interface, c_header, rust_module};
use whippen_compiler::c99;
use whippen_compiler::image::{
    Board, Image, Input, Object, SectionKind, executable, link, listing, map, relocatable, uf2,
};
use whippen_compiler::kernel::verify;
use whippen_compiler::thumb;
use whippen_runtime::files::{FileError, write_whole};

use super::Args;
use super::tick_bound::{self, TickBound};
use crate::cmd::proof;
use crate::cmd::setup::{ImageSetup, code_failure, link_failure, symbol_prefix};
use crate::exit::{Failure, Outcome};
use crate::say::say;

/// What C code for another project says of time, in two lines.
const NOT_PROVEN: &str = "Nothing is proven of its time: which instructions run, what surrounds the keys, and where\n\
                          code and data lie, is up to the project that has it. `whippen budget` proves whole images.";

/// Events that C code keeps until they are taken.
const C_EVENTS: usize = 64;

/// What kind of file is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Elf,
    Uf2,
    Object,
    C,
}

/// The file that was asked for.
#[derive(Debug, Clone)]
pub struct Output {
    path: PathBuf,
    kind: Kind,
}

/// A file by its ending.
pub fn output(text: &str) -> Result<Output, String> {
    let path = PathBuf::from(text);
    let kind = match path.extension().and_then(|e| e.to_str()) {
        Some("elf") => Kind::Elf,
        Some("uf2") => Kind::Uf2,
        Some("o") => Kind::Object,
        Some("c") => Kind::C,
        _ => return Err("its ending says what to make: .elf, .uf2, .o or .c".to_string()),
    };
    Ok(Output { path, kind })
}

/// Makes and writes everything.
pub fn write(setup: &ImageSetup, args: &Args) -> Outcome {
    Files { setup }.write(args)
}

/// The files of one setup.
struct Files<'a> {
    setup: &'a ImageSetup,
}

impl Output {
    /// Whether it is a whole image, which can have several programs.
    pub fn is_image(&self) -> bool {
        matches!(self.kind, Kind::Elf | Kind::Uf2)
    }

    /// It, and what is written beside it.
    pub fn files(&self) -> Vec<PathBuf> {
        let beside: &[&str] = match self.kind {
            Kind::Elf | Kind::Uf2 => &[],
            Kind::C => &["h"],
            Kind::Object => &["h", "rs"],
        };
        let beside = beside.iter().map(|ending| self.path.with_extension(ending));
        [self.path.clone()].into_iter().chain(beside).collect()
    }
}

impl Files<'_> {
    fn write(&self, args: &Args) -> Outcome {
        match args.output.kind {
            Kind::C if args.map.is_some() || args.listing.is_some() => Err(Failure::Usage(
                "--map and --listing show machine code; C has none: make a .o".to_string(),
            )),
            Kind::C => self.write_c(&args.output.path),
            Kind::Object => self.write_object(args),
            Kind::Elf | Kind::Uf2 => self.write_image(args),
        }
    }

    fn write_c(&self, path: &Path) -> Outcome {
        let setup = self.setup;
        let kernel = verify(&setup.first().lowered.kernel).map_err(|errors| {
            Failure::Defect(
                errors
                    .iter()
                    .map(ToString::to_string)
                    .collect::<Vec<_>>()
                    .join("; "),
            )
        })?;
        let layout = c99::Layout::Records;
        let source = c99::source(
            kernel,
            c99::Options {
                keys: setup.keys as usize,
                layout,
                events: C_EVENTS,
            },
        );
        let header = path.with_extension("h");
        let include = header
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        let body = format!("#include \"{include}\"\n\n{}", source.body);
        put(&header, &with_c_note(NOT_PROVEN, &source.header))?;
        put(path, body.as_bytes())?;
        say!(
            "{}: {} keys of {}, in C, with {}",
            path.display(),
            setup.keys,
            symbol_prefix(setup.first()),
            include
        );
        Ok(())
    }

    fn write_image(&self, args: &Args) -> Outcome {
        let setup = self.setup;
        setup.check_supported()?;
        let family = match (args.output.kind, setup.board.uf2_family) {
            (Kind::Uf2, None) => {
                let why = format!(
                    "`{}` has no `uf2_family`, so no bootloader takes a .uf2: make a .elf",
                    setup.board.name
                );
                return Err(Failure::Usage(why));
            }
            (Kind::Uf2, family) => family,
            _ => None,
        };
        let instruments = setup.image_instruments()?;
        let built = setup.build(&instruments)?;
        let (image, keys) = (built.image.clone(), built.keys_of_cores.clone());
        let unproven = proof::check(setup, &instruments, built, args.unproven)?;
        self.listings(args, &image, &setup.board)?;
        let (path, why) = (&args.output.path, unproven.as_deref());
        let file = match family {
            Some(family) => uf2(&image, family, why),
            None => executable(&image, why),
        };
        put(path, &file)?;
        self.report_image(path, &image, &keys);
        if let Some(why) = why {
            say!("it is not proven to be in time, and says so: {why}");
        }
        Ok(())
    }

    /// What an image is and takes.
    fn report_image(&self, path: &Path, image: &Image, keys: &[u32]) {
        let setup = self.setup;
        let names: Vec<&str> = setup
            .layout
            .programs
            .iter()
            .map(|program| program.name.as_str())
            .collect();
        let (stored, run) = (image.stored_bytes(), image.run_bytes());
        say!(
            "{}: {} keys of {} on {}, {stored} bytes of flash, {run} bytes of RAM",
            path.display(),
            keys.iter()
                .map(u32::to_string)
                .collect::<Vec<_>>()
                .join(" and "),
            names.join(", "),
            if keys.len() == 1 {
                "one core"
            } else {
                "two cores"
            }
        );
        if names.len() > 1 {
            say!(
                "it begins with {}; programs are numbered from 0 in this order",
                names[0]
            );
        }
        if let Some(motor) = &setup.device.motor {
            let (peak, torque) = (motor.peak_a, 1000.0 * motor.peak_a * motor.torque_constant);
            let (force, unit) = (
                setup.device.drive.full_scale,
                if setup.device.turns { "N*m" } else { "N" },
            );
            say!(
                "the greatest force, {force} {unit}, is taken to need {peak} A ({torque:.1} mN*m of the motor)"
            );
        }
    }

    fn write_object(&self, args: &Args) -> Outcome {
        let setup = self.setup;
        let path = &args.output.path;
        let name = symbol_prefix(setup.first());
        let instruments = setup.image_instruments()?;
        let options = thumb::Options {
            name: name.clone(),
            keys: setup.keys,
            gain: false,
            probes: false,
            arch: setup.board.arch,
        };
        let built = thumb::compile(&instruments[0].modes, &options).map_err(code_failure)?;
        let places = &instruments[0].places;
        let input = Input {
            object: &built.object,
            places,
        };
        let bound = TickBound::of(setup, &instruments[0], &input);
        let of_time = tick_bound::check(setup, bound, args.unproven)?;
        let bytes = relocatable(&built.object, setup.board.arch, places)
            .map_err(|error| Failure::Defect(format!("the object file: an address {error}")))?;
        let interface = Interface::of(
            setup.first(),
            setup.device.scales(),
            &name,
            setup.keys,
            &built.layout,
        );
        self.tables(args, &input, &format!("{name}_tick"))?;
        let header = with_c_note(&of_time, &c_header(&interface));
        put(&path.with_extension("h"), &header)?;
        let note: String = of_time.lines().map(|line| format!("// {line}\n")).collect();
        let module = note + &rust_module(&interface);
        put(&path.with_extension("rs"), module.as_bytes())?;
        put(path, &bytes)?;
        let (code, state) = (code_bytes(&built.object), built.layout.size());
        let each = built.layout.record(1) - built.layout.record(0);
        say!(
            "{}: {} keys of {name}, {code} bytes of code, {state} bytes of state, {each} bytes a key and its history",
            path.display(),
            setup.keys
        );
        say!("{of_time}");
        Ok(())
    }

    /// Map and listing, with addresses as on the board.
    fn tables(&self, args: &Args, input: &Input, entry: &str) -> Outcome {
        let setup = self.setup;
        if args.map.is_none() && args.listing.is_none() {
            return Ok(());
        }
        let board = tick_bound::board_to_link_for(setup);
        self.listings(
            args,
            &link(&board, &[*input], entry).map_err(link_failure)?,
            &board,
        )
    }

    fn listings(&self, args: &Args, image: &Image, board: &Board) -> Outcome {
        if let Some(path) = &args.map {
            put(path, map(image, board).as_bytes())?;
        }
        if let Some(path) = &args.listing {
            put(path, listing(image, &self.setup.map).as_bytes())?;
        }
        Ok(())
    }
}

/// A header, with what is to be said of time before it.
fn with_c_note(of_time: &str, header: &str) -> Vec<u8> {
    let note = of_time.replace('\n', "\n   ");
    format!("/* {note} */\n{header}").into_bytes()
}

fn code_bytes(object: &Object) -> u32 {
    object
        .sections
        .iter()
        .filter(|section| section.kind == SectionKind::Code)
        .map(|section| section.size)
        .sum()
}

fn put(path: &Path, bytes: &[u8]) -> Outcome {
    write_whole(path, |w| w.write_all(bytes))
        .map_err(|error: FileError| Failure::Usage(error.to_string()))
}
