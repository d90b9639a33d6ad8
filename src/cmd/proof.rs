//! The proof of an image on the command line: what `budget` shows, and without which `build` writes
//! no image and no board is emulated.

mod most_keys;
mod program;

use whippen_compiler::budget::{Budget, CoreBudget, Program as Bytes};
use whippen_compiler::deadline_diagnostic::deadline_diagnostic;
use whippen_compiler::diag::{Diagnostic, Severity};
use whippen_compiler::firmware::FirmwareImage;
use whippen_compiler::keyboard::ProgramId;
use whippen_compiler::pipeline::{self, Partitioned};
use whippen_runtime::image::ImageInstrument;

use self::most_keys::Between;
pub use self::program::{ProgramReport, ZoneReport};
use super::own_firmware::Unbounded;
use super::setup::ImageSetup;
use super::validated::Validated;
use super::{load, progress};
use crate::exit::{Failure, Outcome};
use crate::say::tell;
/// That an image may be used: it is in time, or `unproven` says that it need not be; then why it is
/// not.
///
/// # Errors
/// The image is not in time, which is reported as a budget does, or it has no bound.
pub fn check(
    setup: &ImageSetup,
    instruments: &[ImageInstrument],
    image: FirmwareImage,
    unproven: bool,
) -> Result<Option<String>, Failure> {
    judge(setup, instruments, image, unproven).map(|judged| judged.why)
}

/// What is known of an image that may be used.
pub struct Judged {
    /// Why it is not proven to be in time, where that need not be.
    pub why: Option<String>,
    /// While it plays its first program; none where there is no bound.
    pub budget: Option<Budget>,
}

/// As [`check`], with what is proven.
///
/// # Errors
/// As [`check`].
pub fn judge(
    setup: &ImageSetup,
    instruments: &[ImageInstrument],
    image: FirmwareImage,
    unproven: bool,
) -> Result<Judged, Failure> {
    match ImageProof::of(setup, instruments, image, setup.keys) {
        Err(error) if unproven => Ok(Judged {
            why: Some(format!("no bound: {error}")),
            budget: None,
        }),
        Err(error) => Err(match setup.not_bounded(&error) {
            Failure::Usage(message) => Failure::Usage(format!("{message}\n{ANYWAY}")),
            other => other,
        }),
        Ok(proof) => {
            if !unproven {
                let reported = proof.report_missed_and_fitting(instruments);
                reported.inspect_err(|_| tell!("{ANYWAY}"))?;
            }
            Ok(Judged {
                why: proof.why_late(),
                budget: proof.programs.first().map(|played| played.budget.clone()),
            })
        }
    }
}

/// Of all cores.
fn sum(budget: &Budget, of: impl Fn(&CoreBudget) -> u32) -> u32 {
    budget.cores.iter().map(of).fold(0, u32::saturating_add)
}

/// What is said of an image that is refused.
pub const ANYWAY: &str =
    "nothing is written or run that is not proven to be in time; --unproven does it anyway";

/// Everything that is proven of an image.
pub struct ImageProof<'a> {
    pub setup: &'a ImageSetup,
    pub image: FirmwareImage,
    pub bytes: Bytes,
    pub keys: u32,
    /// While it plays each of its programs.
    pub programs: Vec<ProgramReport<'a>>,
    /// What is known of its code, where somebody asked.
    pub validated: Option<Validated>,
}

impl<'a> ImageProof<'a> {
    /// Of the keys that are wanted, or of as many as fit. How many that are is also found out where
    /// those that are wanted do not, but for zones, whose keys are their keyboard's.
    pub fn wanted(
        setup: &'a ImageSetup,
        instruments: &[ImageInstrument],
        most: bool,
    ) -> Result<(Self, Option<u32>), Failure> {
        if most {
            let found = Self::most_keys(setup, instruments)?;
            let keys = found.keys_fitting();
            return Ok((found, Some(keys)));
        }
        let found = Self::find(setup, instruments, setup.keys)?;
        if found.fits() || setup.layout.split_program().is_some() {
            return Ok((found, None));
        }
        let most = Self::most_keys(setup, instruments)?;
        Ok((found, Some(most.keys_fitting())))
    }

    /// Bounds the image of so many keys, while it plays each of its programs.
    pub fn find(
        setup: &'a ImageSetup,
        instruments: &[ImageInstrument],
        keys: u32,
    ) -> Result<Self, Failure> {
        let made = setup.build_to_bound(instruments, keys)?;
        Self::of_made(setup, instruments, made, keys)
    }

    fn of_made(
        setup: &'a ImageSetup,
        instruments: &[ImageInstrument],
        made: Partitioned,
        keys: u32,
    ) -> Result<Self, Failure> {
        Self::of(setup, instruments, made, keys).map_err(|error| setup.not_bounded(&error))
    }

    /// Bounds an image, which has so many keys, as far as it is not yet.
    ///
    /// # Errors
    /// It has no bound.
    pub fn of(
        setup: &'a ImageSetup,
        instruments: &[ImageInstrument],
        made: impl Into<Partitioned>,
        keys: u32,
    ) -> Result<Self, Unbounded> {
        let mut made = made.into();
        let rate_hz = setup.first().model.rate_hz;
        let proof = progress::during(&format!("the proof of {keys} keys"), || {
            pipeline::prove_bounded(&mut made, &setup.board, rate_hz)
        });
        let image = made.image;
        let proof = proof.map_err(|error| Unbounded::new(error, setup.own_texts(), &image))?;
        let numbered = (0..).map(ProgramId).zip(&setup.layout.programs);
        let all = numbered.zip(proof.programs);
        let programs =
            all.map(|(program, proof)| ProgramReport::new(setup, instruments, program, proof));
        Ok(Self {
            setup,
            programs: programs.collect(),
            bytes: proof.bytes,
            image,
            keys,
            validated: None,
        })
    }

    /// Validates the code of the image.
    ///
    /// # Errors
    /// It is refuted.
    pub fn validate(&mut self, instruments: &[ImageInstrument]) -> Outcome {
        let validated = Validated::of(self.setup, &self.image, instruments)?;
        self.validated = Some(validated);
        Ok(())
    }

    /// The image of as many keys as fit; of the fewest where none fit.
    fn most_keys(setup: &'a ImageSetup, instruments: &[ImageInstrument]) -> Result<Self, Failure> {
        progress::during("how many keys fit", || {
            Self::search_most_keys(setup, instruments)
        })
    }

    fn search_most_keys(
        setup: &'a ImageSetup,
        instruments: &[ImageInstrument],
    ) -> Result<Self, Failure> {
        let [least, most] = setup.keys_possible();
        let mut between = Between::new(least, most);
        // The most keys that fit so far, or the least that do not.
        let mut found: Result<Self, Failure> = Err(Failure::Defect("no keys".to_string()));
        while let Some(keys) = between.next() {
            let mut made = setup.build_to_bound(instruments, keys);
            // The last try tells nothing but whether it is late.
            if let Ok(made) = &mut made
                && between.is_last(keys)
                && made.is_late(&setup.board, setup.first().model.rate_hz)
            {
                between.exceed(keys, None);
                continue;
            }
            let tried = made.and_then(|made| Self::of_made(setup, instruments, made, keys));
            match &tried {
                Ok(tried) if tried.fits() => between.fit(keys, tried.more_keys()),
                Ok(tried) => between.exceed(keys, Some(tried.surplus_keys())),
                Err(Failure::Usage(_) | Failure::Full(_)) => between.exceed(keys, None),
                Err(_) => return tried,
            }
            if between.fits() == Some(keys) || between.fits().is_none() {
                found = tried;
            }
        }
        found
    }

    /// What is left, in keys: right but for what grows around them.
    fn more_keys(&self) -> u32 {
        let more = |core: &CoreBudget| core.more_keys;
        let left = self.programs.iter().map(|played| sum(&played.budget, more));
        left.min().unwrap_or(0)
    }

    /// How many keys are too many, as well as that can be told.
    fn surplus_keys(&self) -> u32 {
        let late = self.programs.iter();
        let surplus = late.map(|played| sum(&played.budget, CoreBudget::surplus_keys));
        surplus.max().unwrap_or(0)
    }

    /// Whether every program is in time.
    pub fn fits(&self) -> bool {
        self.programs.iter().all(|played| played.budget.fits())
    }

    /// Why it is not in time, in one line: of the first program that is not.
    pub fn why_late(&self) -> Option<String> {
        let mut late = self.programs.iter().filter_map(|p| self.missed(p, None));
        late.next().map(|diagnostic| diagnostic.message)
    }

    /// Reports every program that is not in time, with what would be enough: so many keys are
    /// proven to fit, where that was found out.
    ///
    /// # Errors
    /// There is such a program.
    pub fn report_missed(&self, keys_fitting: Option<u32>) -> Outcome {
        let programs = self.programs.iter();
        let missed: Vec<Diagnostic> = programs
            .filter_map(|played| self.missed(played, keys_fitting))
            .collect();
        load::print(&self.setup.map, &missed, Severity::Error);
        if missed.is_empty() {
            Ok(())
        } else {
            Err(Failure::Program)
        }
    }

    /// As [`ImageProof::report_missed`], and finds out how many keys fit, but for zones.
    pub fn report_missed_and_fitting(&self, instruments: &[ImageInstrument]) -> Outcome {
        if self.fits() || self.setup.layout.split_program().is_some() {
            return self.report_missed(None);
        }
        let most = Self::most_keys(self.setup, instruments)?;
        self.report_missed(Some(most.keys_fitting()))
    }

    fn keys_fitting(&self) -> u32 {
        if self.fits() { self.keys } else { 0 }
    }

    /// A deadline that is missed, with the lines that cost most and what would be enough.
    fn missed(&self, played: &ProgramReport, keys_fitting: Option<u32>) -> Option<Diagnostic> {
        let zone = played.zone(played.slowest_zone());
        let place = (
            played.program.name.as_str(),
            zone.compiled.model.span,
            played.is_once(),
        );
        deadline_diagnostic(
            &self.setup.map,
            place,
            &played.budget,
            &self.bytes,
            played.worst_case(),
            keys_fitting,
        )
    }
}
