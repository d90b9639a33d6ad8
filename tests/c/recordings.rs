//! Motions of keys that others recorded, as sensor words.

use std::path::{Path, PathBuf};

use whippen_runtime::gesture::Follower;
use whippen_runtime::motion::{Layout, MotionOptions, Stops, load};
use whippen_runtime::{midi, stroke};

use crate::common::{self, RATE_HZ};

/// How much of a performance is played (s).
const PERFORMANCE_S: f64 = 30.0;
/// The dip that a motion is mapped to (m).
const DIP_M: f64 = 0.010;

/// Of so many words one is played: minutes of recordings, and every instrument plays them all.
const THINNED: usize = 4;

/// Names and words: the recordings of a real action, and the busiest key of one performance of each
/// collection; none where they are absent, and the test counts as skipped.
pub fn all() -> Option<Vec<(String, Vec<u16>)>> {
    let positions = common::recording()?;
    let mut all = vec![("key of the Kawai".to_string(), common::words(&positions))];
    all.extend(raw(&whippen_need::recordings("kawai-grand")?));
    let performances = sorted(&whippen_need::recordings("midi")?)
        .into_iter()
        .filter(|path| path.is_dir());
    all.extend(performances.filter_map(|folder| performance(&folder)));
    for (_, words) in &mut all {
        *words = words.iter().copied().step_by(THINNED).collect();
    }
    Some(all)
}

/// Readings as they are, from the least at rest to the greatest at full dip: any motion will do.
fn raw(folder: &Path) -> Vec<(String, Vec<u16>)> {
    // The last number is what 1 reads as.
    let files = [
        ("key_2kHz.txt", 2000.0, 1.0),
        ("key_and_hammer_2kHz.txt", 2000.0, 1.0),
        ("hammer_8kHz_fast.txt", 8000.0, 8_388_608.0),
        ("hammer_8kHz_slow.txt", 8000.0, 8_388_608.0),
    ];
    let read = |(name, rate_hz, full_m): (&str, f64, f64)| {
        let layout = Layout::Raw {
            rate_hz,
            column: 1,
            calibration: None,
        };
        let stops = Some(Stops {
            rest_m: 0.0,
            full_m,
            dip_m: 1.0,
        });
        let options = MotionOptions {
            layout,
            stops,
            ..MotionOptions::default()
        };
        let motion =
            load(&folder.join(name), &options, RATE_HZ.into()).unwrap_or_else(|e| panic!("{e}"));
        let (low, high) = motion
            .positions
            .to_vec()
            .iter()
            .fold((f64::MAX, f64::MIN), |(low, high), &x| {
                (low.min(x), high.max(x))
            });
        let positions: Vec<f64> = motion
            .positions
            .to_vec()
            .iter()
            .map(|x| (x - low) / (high - low) * DIP_M)
            .collect();
        (name.to_string(), common::words(&positions))
    };
    files.into_iter().map(read).collect()
}

/// The key with the most notes in the first file of a folder.
fn performance(folder: &Path) -> Option<(String, Vec<u16>)> {
    let file = sorted(folder)
        .into_iter()
        .find(|path| path.extension().is_some_and(|e| e == "mid"))?;
    let performance = midi::load(&file).unwrap_or_else(|e| panic!("{e}"));
    let of = |key: u8| {
        performance
            .notes
            .iter()
            .copied()
            .enumerate()
            .filter(move |(_, note)| note.key == key)
    };
    let busiest = (0..128).max_by_key(|&key| of(key).count())?;
    let (moves, _) = stroke::strokes(&of(busiest).collect::<Vec<_>>(), 0.5, DIP_M);
    let ticks = (performance.end_s.min(PERFORMANCE_S) * f64::from(RATE_HZ)) as usize;
    let mut key = Follower::new(&moves);
    let positions: Vec<f64> = (0..ticks)
        .map(|tick| key.at(tick as f64 / f64::from(RATE_HZ)))
        .collect();
    let name = file
        .strip_prefix(folder.parent()?)
        .ok()?
        .display()
        .to_string();
    Some((
        format!("key {busiest} of {name}"),
        common::words(&positions),
    ))
}

fn sorted(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    paths.sort();
    paths
}
