//! An image with what is known of its time: whoever divided its keys may have bounded it, or has
//! found that it is late.

use whippen_board::Board;
use whippen_budget::{Bounded, Budget, NotBounded, Program, cores_of};
use whippen_firmware::FirmwareImage;
use whippen_keyboard::{CoreId, ProgramId};
use whippen_rate::Rate;

/// An image, and what is known of it.
#[derive(Debug, Clone)]
pub struct Partitioned {
    /// The image.
    pub image: FirmwareImage,
    /// What is known of its time.
    pub known: KnownTime,
}

/// What is known of the time of an image.
#[derive(Debug, Clone)]
pub enum KnownTime {
    /// Nothing yet.
    Nothing,
    /// One of its cores is late while one of its programs plays.
    Late,
    /// The bounds of its cores while each of its programs plays.
    Bounded(Vec<Vec<Bounded>>),
}

impl From<FirmwareImage> for Partitioned {
    fn from(image: FirmwareImage) -> Partitioned {
        Partitioned {
            image,
            known: KnownTime::Nothing,
        }
    }
}

impl Partitioned {
    /// Whether it is late, as far as that is not known yet: the core with the most keys is bounded
    /// first, and the others only where that one is in time. What has no bound is not known to be
    /// late.
    pub fn is_late(&mut self, board: &Board, rate_hz: Rate) -> bool {
        if matches!(self.known, KnownTime::Nothing) {
            self.known = known_time(&self.image, board, rate_hz).unwrap_or(KnownTime::Nothing);
        }
        matches!(self.known, KnownTime::Late)
    }
}

/// Finds out whether an image is late, and its bounds where it is not.
fn known_time(
    image: &FirmwareImage,
    board: &Board,
    rate_hz: Rate,
) -> Result<KnownTime, NotBounded> {
    let bytes = Program::of(&image.image);
    let keys = |core: &CoreId| image.keys_of_cores.get(core.index()).copied();
    let mut cores: Vec<CoreId> = image.cores().collect();
    cores.sort_by_key(|core| std::cmp::Reverse(keys(core)));
    let mut programs = vec![Vec::new(); image.programs.len()];
    for core in cores {
        for (program, bounded) in (0..).map(ProgramId).zip(&mut programs) {
            let found = cores_of(image, &bytes, board, program, vec![core])?;
            if !Budget::of(&found, board, rate_hz).fits() {
                return Ok(KnownTime::Late);
            }
            bounded.extend(found.into_iter().map(|found| (core, found)));
        }
    }
    let in_order = |mut cores: Vec<(CoreId, Bounded)>| {
        cores.sort_by_key(|(core, _)| *core);
        cores.into_iter().map(|(_, bounded)| bounded).collect()
    };
    Ok(KnownTime::Bounded(
        programs.into_iter().map(in_order).collect(),
    ))
}
