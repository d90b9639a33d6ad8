//! The files of a build, each written whole or not at all.

use std::path::{Path, PathBuf};

use whippen_compiler::c;
use whippen_compiler::firmware::{self, FirmwareError, Midi, WholeError};
use whippen_compiler::image::{
    Board, Image, Input, Interface, LinkError, Object, Place, Start, c_header, executable, link, listing, map, places,
    relocatable, rust_module, uf2,
};
use whippen_compiler::kernel::verify;
use whippen_compiler::modes::{Modes, specialise};
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::thumb::{self, ThumbError};
use whippen_isa::Arch;
use whippen_runtime::files::{FileError, write_whole};
use whippen_runtime::image;

use super::{Args, Setup};
use crate::exit::{Failure, Outcome};
use crate::say::say;

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

impl Output {
    /// Whether it is a whole image, which can have several programs.
    pub fn is_image(&self) -> bool {
        matches!(self.kind, Kind::Elf | Kind::Uf2)
    }
}

impl Setup {
    /// Makes and writes everything.
    pub fn write(&self, args: &Args) -> Outcome {
        match args.output.kind {
            Kind::C if args.map.is_some() || args.listing.is_some() => {
                Err(Failure::Usage("--map and --listing show machine code; C has none: make a .o".to_string()))
            }
            Kind::C => self.write_c(&args.output.path),
            Kind::Object => self.write_object(args),
            Kind::Elf | Kind::Uf2 => self.write_image(args),
        }
    }

    /// The only program, or the first.
    fn compiled(&self) -> &Compiled {
        &self.programs[0]
    }

    /// The prefix of all names.
    fn name(&self) -> String {
        name(self.compiled())
    }

    fn write_c(&self, path: &Path) -> Outcome {
        let kernel = verify(&self.compiled().lowered.kernel)
            .map_err(|errors| Failure::Defect(errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")))?;
        let layout = c::Layout::Records;
        let source = c::source(kernel, c::Options { keys: self.keys as usize, layout, events: C_EVENTS });
        let header = path.with_extension("h");
        let include = header.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let body = format!("#include \"{include}\"\n\n{}", source.body);
        write(&header, source.header.as_bytes())?;
        write(path, body.as_bytes())?;
        say!("{}: {} keys of {}, in C, with {}", path.display(), self.keys, self.name(), include);
        Ok(())
    }

    fn write_image(&self, args: &Args) -> Outcome {
        if firmware::support(&self.board).is_none() {
            return Err(not_whole(WholeError::Board(self.board.name.clone())));
        }
        let family = match (args.output.kind, self.board.uf2_family) {
            (Kind::Uf2, None) => {
                let why =
                    format!("`{}` has no `uf2_family`, so no bootloader takes a .uf2: make a .elf", self.board.name);
                return Err(Failure::Usage(why));
            }
            (Kind::Uf2, family) => family,
            _ => None,
        };
        let setup = image::setup(self.compiled(), &self.device, self.keys, self.first_note).map_err(Failure::Usage)?;
        let parts = self.programs.iter().map(|compiled| Part {
            modes: specialise(&compiled.lowered.kernel, args.modes),
            places: places(&compiled.lowered.origins, &self.map),
            midi: image::midi(compiled),
        });
        let parts: Vec<Part> = parts.collect();
        let programs: Vec<firmware::Program> = parts.iter().map(Part::program).collect();
        let whole = firmware::whole(&programs, &setup, &self.board).map_err(not_whole)?;
        self.listings(args, &whole.image, &self.board)?;
        let path = &args.output.path;
        write(path, &family.map_or_else(|| executable(&whole.image), |family| uf2(&whole.image, family)))?;
        self.tell(path, &whole.image, setup.keys);
        Ok(())
    }

    /// What an image is and takes.
    fn tell(&self, path: &Path, image: &Image, keys: [u32; 2]) {
        let names: Vec<String> = self.programs.iter().map(name).collect();
        let stored: usize = image.segments.iter().map(|segment| segment.bytes.len()).sum();
        let run: u32 = image.segments.iter().filter(|s| s.run != s.load || s.writable).map(|s| s.size).sum();
        say!(
            "{}: {} and {} keys of {} on two cores, {stored} bytes of flash, {run} bytes of RAM",
            path.display(),
            keys[0],
            keys[1],
            names.join(", ")
        );
        if names.len() > 1 {
            say!("it begins with {}; programs are numbered from 0 in this order", names[0]);
        }
        if let Some(motor) = &self.device.motor {
            let (peak, torque) = (motor.peak_a, 1000.0 * motor.peak_a * motor.torque_constant);
            let (force, unit) = (self.device.drive.full_scale, if self.device.turns { "N*m" } else { "N" });
            say!("the greatest force, {force} {unit}, is taken to need {peak} A ({torque:.1} mN*m of the motor)");
        }
    }

    fn write_object(&self, args: &Args) -> Outcome {
        if self.board.arch != Arch::V8M {
            return Err(Failure::Usage(format!(
                "code is made for the Cortex-M33, and {} has another core: make a .c for its compiler",
                self.board.name
            )));
        }
        let path = &args.output.path;
        let name = self.name();
        let options = thumb::Options { name: name.clone(), keys: self.keys, gain: false, probes: false };
        let modes = specialise(&self.compiled().lowered.kernel, args.modes);
        let built = thumb::compile(&modes, &options).map_err(no_code)?;
        let places = places(&self.compiled().lowered.origins, &self.map);
        let bytes = relocatable(&built.object, self.board.arch, &places)
            .map_err(|error| Failure::Defect(format!("the object file: an address {error}")))?;
        let interface = Interface::of(self.compiled(), self.device.scales(), &name, self.keys, &built.layout);
        self.tables(args, &Input { object: &built.object, places: &places }, &format!("{name}_tick"))?;
        write(&path.with_extension("h"), c_header(&interface).as_bytes())?;
        write(&path.with_extension("rs"), rust_module(&interface).as_bytes())?;
        write(path, &bytes)?;
        let (code, state) = (code_bytes(&built.object), built.layout.size());
        let each = built.layout.record(1) - built.layout.record(0);
        say!(
            "{}: {} keys of {name}, {code} bytes of code, {state} bytes of state, {each} bytes a key and its history",
            path.display(),
            self.keys
        );
        Ok(())
    }

    /// Map and listing, with addresses as on the board.
    fn tables(&self, args: &Args, input: &Input, entry: &str) -> Outcome {
        if args.map.is_none() && args.listing.is_none() {
            return Ok(());
        }
        // Nobody starts here, so nothing is needed to start.
        let board = Board { start: Start::Vectors, ..self.board.clone() };
        let image: Image = link(&board, &[*input], entry).map_err(told)?;
        self.listings(args, &image, &board)
    }

    fn listings(&self, args: &Args, image: &Image, board: &Board) -> Outcome {
        if let Some(path) = &args.map {
            write(path, map(image, board).as_bytes())?;
        }
        if let Some(path) = &args.listing {
            write(path, listing(image, &self.map).as_bytes())?;
        }
        Ok(())
    }
}

/// What an image is made of, for one program.
struct Part {
    modes: Modes,
    places: Vec<Place>,
    midi: Midi,
}

impl Part {
    fn program(&self) -> firmware::Program<'_> {
        firmware::Program { modes: &self.modes, places: &self.places, midi: &self.midi }
    }
}

fn name(compiled: &Compiled) -> String {
    c::Names::new(&compiled.lowered.kernel).kernel
}

fn code_bytes(object: &Object) -> u32 {
    use whippen_compiler::image::SectionKind;
    object.sections.iter().filter(|section| section.kind == SectionKind::Code).map(|section| section.size).sum()
}

fn write(path: &Path, bytes: &[u8]) -> Outcome {
    write_whole(path, |w| w.write_all(bytes)).map_err(|error: FileError| Failure::Usage(error.to_string()))
}

fn no_code(error: ThumbError) -> Failure {
    match error {
        ThumbError::Bug(_) => Failure::Defect(error.to_string()),
        other => Failure::Usage(other.to_string()),
    }
}

fn not_whole(error: WholeError) -> Failure {
    match error {
        WholeError::Link(error) => told(error),
        WholeError::Code(error) => no_code(error),
        WholeError::Firmware(FirmwareError::Assembly(_)) => Failure::Defect(error.to_string()),
        WholeError::Board(_) => {
            Failure::Usage(format!("{error}; make a .c for your own firmware, or a .o for a Cortex-M33"))
        }
        WholeError::Firmware(FirmwareError::Keys(_)) => Failure::Usage(format!("{error}: give 2 to 510 with --keys")),
        WholeError::Ports(..) | WholeError::Firmware(_) => Failure::Usage(error.to_string()),
    }
}

/// A program that does not fit its board is wrong; anything else is ours.
fn told(error: LinkError) -> Failure {
    match error {
        LinkError::Full { .. } => {
            eprintln!("error: {error}");
            Failure::Program
        }
        LinkError::Nowhere { .. } => Failure::Usage(error.to_string()),
        other => Failure::Defect(other.to_string()),
    }
}
