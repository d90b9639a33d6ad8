//! A whole keyboard: every key with its own motion, all of them at the same time.
//!
//! ```text
//!   keys that play --groups of 8--> [ engine: group ] per thread --> per key: events, greatest force, what was cut off
//! ```
//!
//! Keys do not hear each other, so a group is computed by itself and the outcome does not depend on
//! how many threads there are. Groups are of one size whatever the machine. All go on slice by
//! slice, so whoever stops a performance has all keys up to the same tick. What is kept grows with
//! what happens, not with time: no trace of every tick. A key without moves is not run.
//!
//! Not here: where the moves come from (`stroke`), what the outcome means (`outcome`).

mod outcome;

pub use outcome::{Outcome, PlayedNote, Strike};

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use whippen_compiler::kernel;
use whippen_compiler::keyboard::{KeyRange, Layout, Program, ProgramId, Zone, ZoneId};
use whippen_compiler::lower::LoweredEventKind;
use whippen_compiler::model::Model;
use whippen_compiler::pipeline::{Compiled, compile};

use crate::device::Device;
use crate::emulated::{Emulated, EmulatedBoard, Load};
use crate::engine::{Engine, EngineKind, Happened, decode};
use crate::gesture::{Follower, Move};

/// Keys computed together.
const GROUP: usize = 8;

/// So many events of a key are kept: 36 a second for an hour.
const EVENTS_MAX: usize = 1 << 17;

/// Ticks that a group plays before the next one does: about a tenth of a second.
const SLICE: usize = 4096;

/// A key that plays.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PlayingKey {
    /// Counted from 0 at the lowest of the keyboard.
    pub index: usize,
    /// Its moves, by the time they begin.
    pub moves: Vec<Move>,
}

/// What one key did.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct KeyLog {
    /// Counted from 0 at the lowest of the keyboard.
    pub index: usize,
    /// What was emitted: tick, index of the emission in the Model, arguments (SI).
    pub events: Vec<(usize, usize, Vec<f64>)>,
    /// Events beyond those that are kept of a key.
    pub events_lost: usize,
    /// The distance of neighbouring values of the arguments of each emission (SI).
    pub steps: Vec<Vec<Option<f64>>>,
    /// The greatest force in either direction (N), and its tick.
    pub peak: (f64, usize),
    /// Ticks in which the drive gave all it can.
    pub drive_clipped: usize,
    /// Ticks in which the key was beyond what the instrument senses.
    pub sense_clamped: usize,
}

/// A program of a keyboard, and what its instruments are.
#[derive(Debug, Clone, Copy)]
pub struct PlayedProgram<'a> {
    /// Which keys play what.
    pub program: &'a Program,
    /// The instruments by their numbers, each with the values of all keys of the keyboard.
    pub instruments: &'a [Model],
}

impl<'a> PlayedProgram<'a> {
    /// What a zone's keys play.
    pub fn model_of(&self, zone: &Zone) -> &'a Model {
        &self.instruments[zone.instrument.index()]
    }

    /// What a key plays; what the first zone plays, where there is no such key.
    pub fn model_of_key(&self, key: u32) -> &'a Model {
        let zones = &self.program.zones;
        self.model_of(self.program.zone_of_key(key).unwrap_or(&zones[ZoneId(0)]))
    }
}

/// How long keys play.
#[derive(Debug, Clone, Copy)]
pub struct Playtime<'s> {
    /// To the end.
    pub ticks: usize,
    /// When this is on they end sooner, all at the same tick.
    pub stop: Option<&'s AtomicBool>,
}

impl Playtime<'_> {
    /// So many ticks, whatever happens.
    pub fn of(ticks: usize) -> Playtime<'static> {
        Playtime { ticks, stop: None }
    }

    fn is_stopped(&self) -> bool {
        self.stop.is_some_and(|stop| stop.load(Ordering::Relaxed))
    }
}

/// What keys did.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PlayedKeys {
    /// Of each key, from the lowest up.
    pub logs: Vec<KeyLog>,
    /// The ticks that were played: fewer than wanted where somebody stopped it.
    pub ticks: usize,
}

/// Plays keys, which come from the lowest up, on so many threads. `progress` is told keys times
/// ticks that were done since the last time.
///
/// # Errors
/// The instrument cannot be compiled or run on this machine: a defect, in words.
pub fn play(
    played: &PlayedProgram,
    device: &Device,
    kind: EngineKind,
    keys: &[PlayingKey],
    duration: Playtime,
    threads: usize,
    progress: impl Fn(usize) + Sync,
) -> Result<PlayedKeys, String> {
    let playing_in = |zone: &Zone| {
        let at = |key: u32| keys.partition_point(|playing| playing.index < key as usize);
        &keys[at(zone.keys.first)..at(zone.keys.end)]
    };
    let mut groups: Vec<(&Model, &[PlayingKey])> = Vec::new();
    for zone in &played.program.zones {
        let model = played.model_of(zone);
        let of_zone = playing_in(zone).chunks(GROUP);
        groups.extend(of_zone.map(|group| (model, group)));
    }
    let threads = threads.clamp(1, groups.len().max(1));
    let slices = Slices::new(duration);
    let (groups, slices, progress) = (&groups, &slices, &progress);
    let work = |thread: usize| {
        let own = groups.iter().skip(thread).step_by(threads);
        let logs = play_groups(own.copied(), device, kind, slices, progress);
        if logs.is_err() {
            slices.fail();
        }
        logs
    };
    let done = std::thread::scope(|scope| {
        if threads == 1 {
            return Ok(vec![work(0)?]);
        }
        let all: Vec<_> = (0..threads)
            .map(|thread| scope.spawn(move || work(thread)))
            .collect();
        let result = |thread: std::thread::ScopedJoinHandle<'_, Logs>| {
            (thread.join()).unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        };
        let all: Result<Vec<_>, String> = all.into_iter().map(result).collect();
        all
    });
    let mut logs = done?.concat();
    logs.sort_by_key(|log| log.index);
    Ok(PlayedKeys {
        logs,
        ticks: slices.played(),
    })
}

/// What the groups of a thread give.
type Logs = Result<Vec<KeyLog>, String>;

/// How far threads have gone, each for itself, so that all of them end at the same tick.
struct Slices<'s> {
    duration: Playtime<'s>,
    failed: AtomicBool,
    /// The end of the last slice that somebody has begun.
    begun: Mutex<usize>,
}

impl<'s> Slices<'s> {
    fn new(duration: Playtime<'s>) -> Slices<'s> {
        Slices {
            duration,
            failed: AtomicBool::new(false),
            begun: Mutex::new(0),
        }
    }

    /// The ticks behind those that somebody has done, if they are to be played: what another has
    /// begun, or more as long as nobody stops.
    fn next(&self, done: usize) -> Option<Range<usize>> {
        let mut begun = self.begun.lock().unwrap_or_else(PoisonError::into_inner);
        let end = self.duration.ticks.min(done + SLICE);
        let ends = self.duration.is_stopped() || self.failed.load(Ordering::Relaxed);
        if end == done || done == *begun && ends {
            return None;
        }
        *begun = end.max(*begun);
        Some(done..end)
    }

    fn fail(&self) {
        self.failed.store(true, Ordering::Relaxed);
    }

    fn played(&self) -> usize {
        *self.begun.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Plays all keys of a keyboard on one emulated board of that kind, and gives what it took besides.
///
/// # Errors
/// There is no image of so many keys, or a tick is missed, in words.
pub fn play_on_board(
    played: &PlayedProgram,
    device: &Device,
    board: EmulatedBoard,
    keys: &[PlayingKey],
    duration: Playtime,
    progress: impl Fn(usize),
) -> Result<(PlayedKeys, Load), String> {
    let all = Layout {
        first_note: 0,
        keys: keys.len() as u32,
        programs: vec![played.program.clone()].into(),
    };
    let (layout, instruments) = all.only(|_| true);
    let compiled: Vec<Compiled> = instruments
        .iter()
        .map(|id| played.instruments[id.index()].clone())
        .map(|model| compile(model, device.scales(), false).map_err(|e| format!("{e:?}")))
        .collect::<Result<_, _>>()?;
    let borrowed: Vec<&Compiled> = compiled.iter().collect();
    let mut engine = Emulated::of_layout(&layout, &borrowed, device, board)?;
    let mut zones: Vec<ZoneGroup> = Vec::new();
    for zone in &layout.program(ProgramId(0)).zones {
        let compiled = &compiled[zone.instrument.index()];
        zones.push(ZoneGroup {
            keys: zone.keys,
            group: Group::new(
                compiled,
                device,
                EngineKind::Emulated(board),
                &keys[zone.keys.indices()],
            ),
        });
    }
    let mut drive = vec![0; keys.len()];
    let (slices, mut ticks) = (Slices::new(duration), 0);
    while let Some(slice) = slices.next(ticks) {
        for tick in slice.clone() {
            play_tick(&mut engine, &mut zones, &mut drive, tick);
        }
        ticks = slice.end;
        progress(slice.len() * keys.len());
        if let Some(trouble) = engine.trouble() {
            return Err(trouble.to_string());
        }
    }
    let logs = zones.into_iter().flat_map(|zone| zone.group.logs).collect();
    Ok((PlayedKeys { logs, ticks }, engine.load()))
}

/// The keys of a zone on a board.
struct ZoneGroup<'a> {
    keys: KeyRange,
    group: Group<'a>,
}

/// One tick of all keys of a board.
fn play_tick(engine: &mut Emulated, zones: &mut [ZoneGroup], drive: &mut [i16], tick: usize) {
    let mut words = Vec::new();
    for zone in zones.iter_mut() {
        zone.group.sense(tick);
        words.extend_from_slice(&zone.group.words);
    }
    if tick == 0 {
        engine.start(&words);
    }
    engine.tick(&words, drive);
    for zone in zones.iter_mut() {
        zone.group.driven(&drive[zone.keys.indices()], tick);
    }
    for happened in engine.drain() {
        let Some(zone) = zones
            .iter_mut()
            .find(|zone| zone.keys.contains(happened.key))
        else {
            continue;
        };
        let key = happened.key - zone.keys.first;
        let of_zone = vec![kernel::Happened { key, ..happened }];
        for decoded in decode(&zone.group.compiled.lowered.events, of_zone) {
            zone.group.happened(decoded, tick);
        }
    }
}

/// The instrument as some keys of a keyboard have it: their values of what is set per key.
pub fn model_of_keys(model: &Model, keys: &[usize]) -> Model {
    let mut model = model.clone();
    for keyed in &mut model.keyed {
        let last = keyed.values.last().copied().unwrap_or_default();
        keyed.values = keys
            .iter()
            .map(|&key| keyed.values.get(key).copied().unwrap_or(last))
            .collect();
    }
    model
}

/// Plays groups of keys, each with the values that its keys have, slice by slice.
fn play_groups<'k>(
    groups: impl Iterator<Item = (&'k Model, &'k [PlayingKey])>,
    device: &Device,
    kind: EngineKind,
    slices: &Slices,
    progress: &impl Fn(usize),
) -> Logs {
    let mut all: Vec<(Compiled, &[PlayingKey])> = Vec::new();
    for (model, keys) in groups {
        let indices: Vec<usize> = keys.iter().map(|key| key.index).collect();
        let model = model_of_keys(model, &indices);
        let compiled = compile(model, device.scales(), false).map_err(|e| format!("{e:?}"))?;
        all.push((compiled, keys));
    }
    let mut playing: Vec<(Engine, Group)> = Vec::new();
    for (compiled, keys) in &all {
        let engine = Engine::new(kind, compiled, device, keys.len())?;
        playing.push((engine, Group::new(compiled, device, kind, keys)));
    }
    let mut done = 0;
    while let Some(slice) = slices.next(done) {
        for (engine, group) in &mut playing {
            for tick in slice.clone() {
                group.tick(engine, tick);
            }
            progress(slice.len() * group.logs.len());
        }
        done = slice.end;
    }
    Ok(playing
        .into_iter()
        .flat_map(|(_, group)| group.logs)
        .collect())
}

/// The distance of neighbouring values of the arguments of each emission (SI); none in an engine
/// that has no words.
fn steps(compiled: &Compiled, kind: EngineKind) -> Vec<Vec<Option<f64>>> {
    let words = kind != EngineKind::Ideal;
    let mut steps = vec![Vec::new(); compiled.model.emissions.len()];
    for event in &compiled.lowered.events {
        if let LoweredEventKind::Emission(e) = event.kind {
            let lsbs = event.arg_lsbs.iter();
            steps[e as usize] = lsbs.map(|lsb| words.then_some(*lsb)).collect();
        }
    }
    steps
}

/// Some keys while they play.
struct Group<'a> {
    compiled: &'a Compiled,
    device: &'a Device,
    followers: Vec<Follower<'a>>,
    words: Vec<u16>,
    drive: Vec<i16>,
    /// The greatest drive word of each key so far, without its sign.
    peaks: Vec<u16>,
    logs: Vec<KeyLog>,
}

impl<'a> Group<'a> {
    fn new(
        compiled: &'a Compiled,
        device: &'a Device,
        kind: EngineKind,
        keys: &'a [PlayingKey],
    ) -> Group<'a> {
        let steps = steps(compiled, kind);
        Group {
            compiled,
            device,
            followers: keys.iter().map(|key| Follower::new(&key.moves)).collect(),
            words: vec![0; keys.len() * compiled.model.senses.len()],
            drive: vec![0; keys.len()],
            peaks: vec![0; keys.len()],
            logs: keys
                .iter()
                .map(|key| KeyLog {
                    index: key.index,
                    steps: steps.clone(),
                    ..KeyLog::default()
                })
                .collect(),
        }
    }

    /// The words of a tick.
    fn sense(&mut self, tick: usize) {
        let model = &self.compiled.model;
        let (t_s, senses) = (tick as f64 / f64::from(model.rate_hz), model.senses.len());
        for (key, follower) in self.followers.iter_mut().enumerate() {
            let position_m = follower.at(t_s);
            let read_m = self
                .device
                .port()
                .read(self.logs[key].index, tick, position_m);
            let word = self.device.word_of_position(read_m).0;
            self.words[key * senses..(key + 1) * senses].fill(word);
            let outside = model
                .senses
                .first()
                .is_some_and(|s| position_m < s.range.low || position_m > s.range.high);
            self.logs[key].sense_clamped += usize::from(outside);
        }
    }

    fn tick(&mut self, engine: &mut Engine, tick: usize) {
        self.sense(tick);
        if tick == 0 {
            engine.start(&self.words);
        }
        let mut drive = std::mem::take(&mut self.drive);
        engine.tick(&self.words, &mut drive);
        self.driven(&drive, tick);
        self.drive = drive;
        for happened in engine.drain() {
            self.happened(happened, tick);
        }
    }

    /// What the drives were told in a tick.
    fn driven(&mut self, drive: &[i16], tick: usize) {
        for (key, &word) in drive.iter().enumerate() {
            if word.unsigned_abs() > self.peaks[key] {
                self.peaks[key] = word.unsigned_abs();
                self.logs[key].peak = (self.device.force_of_word(word), tick);
            }
            self.logs[key].drive_clipped += usize::from(word == i16::MIN || word == i16::MAX);
        }
    }

    fn happened(&mut self, happened: Happened, tick: usize) {
        if let LoweredEventKind::Emission(e) = self.compiled.lowered.events[happened.event].kind {
            let log = &mut self.logs[happened.key as usize];
            if log.events.len() < EVENTS_MAX {
                log.events.push((tick, e as usize, happened.args));
            } else {
                log.events_lost += 1;
            }
        }
    }
}
