//! `zones`: programs whose keys play different instruments. Every key is in exactly one zone.

use super::keyboard::Reader;
use super::notes::note_name;
use crate::diag::{Code, Diagnostic};
use crate::syntax::ast;
use crate::syntax::ast::Name;
use whippen_keyboard::{InstrumentId, KeyRange, Program, Zone};
use whippen_source::Span;

/// A program that zones define.
pub struct Zones<'a> {
    /// Its name, as it is declared.
    pub name: &'a Name,
    /// What its keys play, by rising key; empty if something is wrong with it.
    pub zones: Vec<Zone>,
}

impl Zones<'_> {
    /// What the keyboard can play.
    pub fn program(&self) -> Program {
        Program {
            name: self.name.node.clone(),
            zones: self.zones.clone().into(),
        }
    }
}

/// A zone whose notes exist.
#[derive(Clone, Copy)]
struct Found {
    low: u8,
    high: u8,
    /// What it plays, if there is such an instrument.
    instrument: Option<InstrumentId>,
    span: Span,
}

impl Found {
    /// The zone on a keyboard whose lowest key has this note. What lies below has been reported.
    fn on(&self, first_note: u8) -> Option<Zone> {
        let key = |note: u8| u32::from(note.saturating_sub(first_note));
        Some(Zone {
            keys: KeyRange::new(key(self.low), key(self.high) + 1),
            instrument: self.instrument?,
        })
    }
}

impl<'a> Reader<'a, '_, '_> {
    /// Reads one line of `zones`.
    pub fn zones(&mut self, name: &'a Name, given: &'a [ast::Zone]) {
        let first = self
            .zones
            .iter()
            .find(|z| z.name.node == name.node)
            .map(|z| z.name.span);
        if let Some(first) = first {
            let message = format!("the zones `{}` are given twice", name.node);
            let diagnostic =
                Diagnostic::new(Code::RepeatedSetting, name.span, message, "the second time");
            self.diags.push(
                diagnostic
                    .also(first, "the first time")
                    .hint("give one of them another name"),
            );
            return;
        }
        if let Some(index) = self.items.instrument(&name.node) {
            let message = format!(
                "the zones `{0}` have the name of the instrument `{0}`",
                name.node
            );
            let diagnostic = Diagnostic::new(Code::ZonesName, name.span, message, "taken");
            let instrument = self.items.instruments[index].name.span;
            self.diags.push(
                diagnostic
                    .also(instrument, "the instrument")
                    .hint("give the zones another name"),
            );
        }
        let errors = self.diags.errors();
        let mut found: Vec<Found> = given.iter().filter_map(|zone| self.zone(zone)).collect();
        if found.len() == given.len() {
            self.overlaps(name, &found);
            found.sort_by_key(|zone| zone.low);
            if self.keys_known {
                self.outside(&found);
                self.gaps(name, &found);
            }
        }
        let zones = if self.diags.errors() == errors {
            let first_note = self.board.keyboard.layout.first_note;
            found
                .iter()
                .filter_map(|zone| zone.on(first_note))
                .collect()
        } else {
            Vec::new()
        };
        self.zones.push(Zones { name, zones });
    }

    fn zone(&mut self, zone: &'a ast::Zone) -> Option<Found> {
        let (low, high) = (self.note(&zone.low), self.note(&zone.high));
        let instrument = self.instrument(&zone.instrument);
        let (low, high) = (low?, high?);
        let span = zone.low.span.to(zone.high.span);
        if low > high {
            let message = format!("the keys {} .. {} are none", zone.low.node, zone.high.node);
            let diagnostic = Diagnostic::new(Code::EmptyRange, span, message, "empty");
            self.diags
                .push(diagnostic.hint("the lowest key comes first"));
            return None;
        }
        Some(Found {
            low,
            high,
            instrument,
            span,
        })
    }

    /// Keys that a zone and one before it in the text have.
    fn overlaps(&mut self, name: &Name, found: &[Found]) {
        for (at, zone) in found.iter().enumerate() {
            let shares = |other: &&Found| other.low <= zone.high && zone.low <= other.high;
            let Some(other) = found[..at].iter().find(shares) else {
                continue;
            };
            let shared = keys(zone.low.max(other.low), zone.high.min(other.high));
            let message = format!("{shared} in two zones of `{}`", name.node);
            self.diags.push(
                Diagnostic::new(Code::ZoneOverlap, zone.span, message, "this zone")
                    .also(other.span, "and this one")
                    .hint("a key plays one instrument: let one zone end right below where the other begins"),
            );
        }
    }

    /// Zones that reach beyond the keys.
    fn outside(&mut self, found: &[Found]) {
        let layout = &self.board.keyboard.layout;
        let (first, last) = (layout.first_note, layout.last_note());
        for zone in found
            .iter()
            .filter(|zone| zone.low < first || zone.high > last)
        {
            let (low, high) = (note_name(zone.low), note_name(zone.high));
            let (first, last) = (note_name(first), note_name(last));
            let message =
                format!("the zone {low} .. {high} reaches beyond the keys {first} .. {last}");
            let diagnostic =
                Diagnostic::new(Code::ZoneOutside, zone.span, message, "beyond the keys");
            self.diags.push(diagnostic.hint(format!(
                "zones lie within the keyboard's keys, {first} .. {last}"
            )));
        }
    }

    /// Keys in no zone; zones come by their lowest key.
    fn gaps(&mut self, name: &Name, found: &[Found]) {
        let layout = &self.board.keyboard.layout;
        let (first, last) = (layout.first_note, layout.last_note());
        let mut next = u16::from(first);
        let end = u16::from(last) + 1;
        for zone in found
            .iter()
            .map(|zone| (u16::from(zone.low), zone.span))
            .chain([(end, name.span)])
        {
            let (low, span) = (zone.0.min(end), zone.1);
            if low > next {
                let none = keys(next as u8, (low - 1) as u8);
                let message = format!("{none} in no zone of `{}`", name.node);
                let diagnostic = Diagnostic::new(Code::ZoneGap, span, message, "keys are missing");
                let hint = format!(
                    "every key of the keyboard ({} .. {}) is in one zone",
                    note_name(first),
                    note_name(last)
                );
                self.diags.push(diagnostic.hint(hint));
            }
            let behind = found
                .iter()
                .filter(|z| u16::from(z.low) <= low)
                .map(|z| u16::from(z.high) + 1)
                .max();
            next = next.max(behind.unwrap_or(next));
        }
    }

    /// Zones that cannot be played.
    pub fn unused_zones(&mut self, listed: &[String]) {
        for zones in &self.zones {
            if !listed.contains(&zones.name.node) {
                let message = format!("the zones `{}` are not among the programs", zones.name.node);
                let diagnostic =
                    Diagnostic::new(Code::UnusedZones, zones.name.span, message, "never played");
                self.diags.push(diagnostic.hint(format!(
                    "add `{}` to `programs`, or take this line away",
                    zones.name.node
                )));
            }
        }
    }
}

/// Keys, as the subject of a sentence.
fn keys(low: u8, high: u8) -> String {
    if low == high {
        format!("the key {} is", note_name(low))
    } else {
        format!("the keys {} .. {} are", note_name(low), note_name(high))
    }
}
