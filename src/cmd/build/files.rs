//! The files of a build, each written whole or not at all; whole images.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use whippen_compiler::firmware::{FirmwareImage, ProgramCode};
use whippen_compiler::image::{Board, Executable, Image, Variables, executable, listing, map, uf2};
use whippen_compiler::parallel::both;
use whippen_compiler::pipeline;
use whippen_compiler::variables::variables;
use whippen_runtime::files::{FileError, write_whole};
use whippen_runtime::image::ImageInstrument;
use whippen_runtime::web;

use super::Args;
use crate::cmd::own_firmware::TextFiles;
use crate::cmd::proof;
use crate::cmd::setup::{ImageSetup, file_of_chip};
use crate::cmd::validated::Validated;
use crate::exit::{Failure, Outcome};
use crate::say::say;

/// What kind of file is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Elf,
    Uf2,
    Object,
    C,
    Wasm,
    Fmu,
}

/// The file that was asked for.
#[derive(Debug, Clone)]
pub struct Output {
    pub path: PathBuf,
    kind: Kind,
}

/// A file by its ending.
pub fn output(name: OsString) -> Result<Output, String> {
    let path = PathBuf::from(name);
    let kind = match path.extension().and_then(|e| e.to_str()) {
        Some("elf") => Kind::Elf,
        Some("uf2") => Kind::Uf2,
        Some("o") => Kind::Object,
        Some("c") => Kind::C,
        Some("wasm") => Kind::Wasm,
        Some("fmu") => Kind::Fmu,
        _ => {
            let what = "its ending says what to make: .elf, .uf2, .o, .c, .wasm or .fmu";
            return Err(what.to_string());
        }
    };
    Ok(Output { path, kind })
}

/// The files of all chips.
pub fn files_of_chips(path: &Path, chips: u32) -> Vec<PathBuf> {
    let of_chip = |number| file_of_chip(path, number, chips);
    (1..=chips).map(of_chip).collect()
}

/// An image as it was built, with what it is of.
pub(super) struct BuiltImage {
    pub instruments: Vec<ImageInstrument>,
    pub whole: FirmwareImage,
}

/// An image as it is to be written.
pub(super) struct MadeImage {
    path: PathBuf,
    file: Vec<u8>,
    image: Image,
    /// Of each core.
    keys: Vec<u32>,
    /// Why it is not proven.
    unproven: Option<String>,
    /// What is known of its code, where somebody asked.
    validated: Option<Validated>,
}

/// Makes and writes everything.
pub fn write(setup: &ImageSetup, args: &Args) -> Outcome {
    Files { setup }.write(args)
}

/// The files of one setup.
pub(super) struct Files<'a> {
    pub setup: &'a ImageSetup,
}

impl Output {
    /// Whether it is a whole image, which can have several programs.
    pub fn is_image(&self) -> bool {
        matches!(self.kind, Kind::Elf | Kind::Uf2)
    }

    /// Whether another project has it: a relocatable file or C text.
    pub fn is_for_projects(&self) -> bool {
        matches!(self.kind, Kind::Object | Kind::C)
    }

    /// Whether it is a relocatable file.
    pub fn is_object(&self) -> bool {
        self.kind == Kind::Object
    }

    /// The family of the bootloader that takes it, of a .uf2.
    pub(super) fn family(&self, board: &Board) -> Result<Option<u32>, Failure> {
        match (self.kind, board.uf2_family) {
            (Kind::Uf2, None) => Err(Failure::Usage(format!(
                "`{}` has no `uf2_family`, so no bootloader takes a .uf2: make a .elf",
                board.name
            ))),
            (Kind::Uf2, family) => Ok(family),
            _ => Ok(None),
        }
    }

    /// It, and what is written beside it, for so many chips.
    pub fn files(&self, chips: u32) -> Vec<PathBuf> {
        if chips > 1 {
            return files_of_chips(&self.path, chips);
        }
        let beside: &[&str] = match self.kind {
            Kind::Elf | Kind::Uf2 | Kind::Wasm | Kind::Fmu => &[],
            Kind::C | Kind::Object => &["h", "rs"],
        };
        let beside = beside.iter().map(|ending| self.path.with_extension(ending));
        [self.path.clone()].into_iter().chain(beside).collect()
    }
}

impl Files<'_> {
    fn write(&self, args: &Args) -> Outcome {
        if self.setup.chips > 1 && (args.self_test || !args.output.is_image()) {
            let why = "several chips are for whole images, .elf and .uf2, that play";
            return Err(Failure::Usage(why.to_string()));
        }
        if args.self_test {
            return self.write_self_test(args);
        }
        if args.safety && !args.output.is_for_projects() {
            let why = "--safety is for a .o or a .c: a whole image guards its keys in any case, and \
                       a .wasm or an .fmu drives no motor";
            return Err(Failure::Usage(why.to_string()));
        }
        if args.validate && !args.output.is_image() {
            let why = "--validate is for a whole image: its bytes are compared";
            return Err(Failure::Usage(why.to_string()));
        }
        if !args.output.is_image() {
            if args.firmware_texts.is_some() {
                let why = "--firmware-texts writes what is in a whole image, .elf or .uf2";
                return Err(Failure::Usage(why.to_string()));
            }
            self.setup.check_asks_for_no_firmware()?;
        }
        match args.output.kind {
            Kind::C | Kind::Wasm | Kind::Fmu if args.map.is_some() || args.listing.is_some() => {
                let why = "--map and --listing show machine code; C, WebAssembly and FMUs have none: make a .o";
                Err(Failure::Usage(why.to_string()))
            }
            Kind::C => self.write_c(args),
            Kind::Wasm => self.write_wasm(&args.output.path),
            Kind::Fmu => self.write_fmu(&args.output.path),
            Kind::Object => self.write_object(args),
            Kind::Elf | Kind::Uf2 => self.write_image(args),
        }
    }

    /// A module for browsers, on which no deadline is proven.
    fn write_wasm(&self, path: &Path) -> Outcome {
        let setup = self.setup;
        let [compiled] = &setup.instruments[..] else {
            let why = "a .wasm has one instrument; name one of them after the files";
            return Err(Failure::Usage(why.to_string()));
        };
        let keys = if compiled.model.is_of_key() {
            setup.keys
        } else {
            1
        };
        let module = web::module(compiled, &setup.device, keys as usize);
        let module = module.map_err(|error| Failure::Usage(error.to_string()))?;
        put(path, &module.bytes)?;
        say!(
            "{}: {} on {keys} {}, {} bytes, {} bytes of memory",
            path.display(),
            compiled.model.name,
            if keys == 1 { "key" } else { "keys" },
            module.bytes.len(),
            module.map.end
        );
        Ok(())
    }

    fn write_image(&self, args: &Args) -> Outcome {
        let setup = self.setup;
        setup.check_supported()?;
        let family = args.output.family(&setup.board)?;
        let texts = args.firmware_texts.as_deref();
        let texts = texts.map(|folder| TextFiles::new(folder, &setup.board));
        let texts = texts.transpose()?;
        let (instruments, chips) = (setup.image_instruments()?, setup.of_chips()?);
        let chips: Vec<Files> = chips.iter().map(|setup| Files { setup }).collect();
        let built = chips.iter().map(|chip| chip.built(&instruments));
        let built: Vec<BuiltImage> = built.collect::<Result<_, _>>()?;
        let made = put_built(args, family, &chips, built)?;
        texts.map_or(Ok(()), |texts| texts.write())?;
        for (chip, made) in chips.iter().zip(&made) {
            chip.report_image(&made.path, &made.image, &made.keys);
            if let Some(validated) = &made.validated {
                say!("{validated}");
            }
            if let Some(why) = &made.unproven {
                say!("it is not proven to be in time, and says so: {why}");
            }
        }
        if chips.len() > 1 {
            say!(
                "MIDI goes into chip 1, out of each chip into the next one, and out of the last \
                 with the notes of all; connect their grounds"
            );
        }
        Ok(())
    }

    /// The image of one chip.
    pub(super) fn built(&self, instruments: &[ImageInstrument]) -> Result<BuiltImage, Failure> {
        let instruments = self.setup.with_own_keys(instruments);
        let whole = self.setup.build(&instruments)?;
        Ok(BuiltImage { instruments, whole })
    }

    /// The image of one chip, proven or marked; nothing is written.
    fn made(&self, args: &Args, of: BuiltImage, family: Option<u32>) -> Result<MadeImage, Failure> {
        let setup = self.setup;
        let BuiltImage { instruments, whole } = of;
        let (image, keys) = (whole.image.clone(), whole.keys_of_cores.clone());
        let variables = self.variables(&instruments, &whole);
        let unproven = proof::check(setup, &instruments, whole.clone(), args.unproven)?;
        let validated = (args.validate)
            .then(|| Validated::of(setup, &whole, &instruments))
            .transpose()?;
        let file = match (family, &unproven) {
            (Some(family), why) => uf2(&image, family, why.as_deref()),
            (None, None) => self.certified(&instruments, &whole, &variables),
            (None, why) => executable(&image, &variables, why.as_deref()),
        };
        Ok(MadeImage {
            path: self.of_chip(&args.output.path),
            file,
            image,
            keys,
            unproven,
            validated,
        })
    }

    /// The file of an image that is proven, with its certificate, where it has one.
    fn certified(
        &self,
        instruments: &[ImageInstrument],
        built: &FirmwareImage,
        variables: &[Variables],
    ) -> Vec<u8> {
        let (image, board) = (&built.image, &self.setup.board);
        let rate_hz = self.setup.first().model.rate_hz;
        let kernels = instruments.iter().map(|own| own.modes.kernel.to_string());
        let kernels = kernels.collect::<String>();
        let (certificate, file) = both(
            || {
                let bare = Executable::bare(image).file(None);
                pipeline::certify(built, board, rate_hz, &kernels, &bare)
            },
            || Executable::new(image, variables),
        );
        match certificate {
            Ok(certificate) => file.certified(&certificate.to_string(), &kernels),
            Err(why) => {
                say!("it has no certificate for `whippen audit`: {why}");
                file.file(None)
            }
        }
    }

    /// The file of this chip, where there are several.
    fn of_chip(&self, path: &Path) -> PathBuf {
        let chip = self
            .setup
            .chip
            .map_or((1, 1), |chip| (chip.number, chip.of));
        file_of_chip(path, chip.0, chip.1)
    }

    /// What debuggers may show of the keys of all programs.
    fn variables(&self, instruments: &[ImageInstrument], built: &FirmwareImage) -> Vec<Variables> {
        let setup = self.setup;
        let zones = built.programs.iter().flat_map(|program| {
            program
                .zones()
                .map(|zone| (program.instrument_of(zone).index(), zone))
        });
        let described = zones.map(|(instrument, zone)| {
            let compiled = &setup.instruments[instrument];
            let modes = instruments[instrument].modes_of_zone();
            variables(compiled, modes, &zone.name, zone.layout())
        });
        let parts = built.programs.iter().flat_map(ProgramCode::parts);
        let modes = instruments.iter().filter_map(|own| own.parts.as_ref());
        let modes = modes.flat_map(|parts| &parts.modes);
        let parts = parts.zip(modes).map(|(part, modes)| {
            let compiled = &setup.instruments[0];
            variables(compiled, modes, &part.name, &part.built.layout)
        });
        described.chain(parts).collect()
    }

    /// Map and listing of an image.
    pub(super) fn listings(&self, args: &Args, image: &Image, board: &Board) -> Outcome {
        if let Some(path) = &args.map {
            put(&self.of_chip(path), map(image, board).as_bytes())?;
        }
        if let Some(path) = &args.listing {
            put(
                &self.of_chip(path),
                listing(image, &self.setup.map).as_bytes(),
            )?;
        }
        Ok(())
    }
}

/// Proves what was built, validates it where that is asked, and writes it, with its listings: all
/// images or none.
pub(super) fn put_built(
    args: &Args,
    family: Option<u32>,
    chips: &[Files],
    built: Vec<BuiltImage>,
) -> Result<Vec<MadeImage>, Failure> {
    let made = chips.iter().zip(built);
    let made = made.map(|(chip, built)| chip.made(args, built, family));
    let made: Vec<MadeImage> = made.collect::<Result<_, _>>()?;
    for (chip, made) in chips.iter().zip(&made) {
        chip.listings(args, &made.image, &chip.setup.board)?;
    }
    put_together(&made)?;
    Ok(made)
}

/// All images or none: where one cannot be written those before it go.
fn put_together(all: &[MadeImage]) -> Outcome {
    for (count, own) in all.iter().enumerate() {
        if let Err(error) = put(&own.path, &own.file) {
            for written in &all[..count] {
                // What cannot be removed either has its error told already.
                let _ = std::fs::remove_file(&written.path);
            }
            return Err(error);
        }
    }
    Ok(())
}

pub(super) fn put(path: &Path, bytes: &[u8]) -> Outcome {
    write_whole(path, |w| w.write_all(bytes))
        .map_err(|error: FileError| Failure::Usage(error.to_string()))
}
