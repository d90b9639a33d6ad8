//! `keyboard`: its settings, and what its programs must share.

use super::diags::Diags;
use super::elaborate::Elaborator;
use super::items::Items;
use super::notes::midi_number;
use super::per_key::{PerKey, Point};
use super::scope::{Scope, ScopeId};
use super::sets::{unknown_instrument, unknown_param};
use super::settings::Settings;
use super::types::{Ty, Value};
use super::zones::Zones;
use super::{DeviceName, Keyboard, Options, tick_rate};
use crate::bundled::{boards, devices};
use crate::diag::{Advice, Code, Diagnostic, nearest};
use crate::syntax::ast::{self, DeclKind, Expr, Name, Setting};
use crate::units::Dim;
use whippen_ids::IdMap;
use whippen_keyboard::{InstrumentId, KeyRange, Layout, Program, Zone};
use whippen_source::Span;

/// The device of a keyboard with keys that names none.
const DEFAULT_DEVICE: &str = "mikey";

/// A keyboard and what it sets.
pub struct Board<'a> {
    /// The keyboard.
    pub keyboard: Keyboard,
    /// As written.
    pub ast: &'a ast::Keyboard,
    /// Parameters set per key.
    pub per_key: Vec<PerKey<'a>>,
    /// Where its keys are said; without them it plays an instrument once.
    pub keys: Option<Span>,
}

/// The number of the instrument at a place of the text's list.
pub(super) fn instrument_id(index: usize) -> InstrumentId {
    InstrumentId(index as u32)
}

/// Reads all keyboards.
pub fn read<'a>(items: &Items<'a>, options: &Options, diags: &mut Diags) -> Vec<Board<'a>> {
    items
        .keyboards
        .iter()
        .map(|ast| Reader::new(items, options, diags, ast).read())
        .collect()
}

/// A keyboard while it is read.
pub(super) struct Reader<'a, 'i, 'd> {
    pub items: &'i Items<'a>,
    options: &'i Options,
    pub diags: &'d mut Diags,
    pub board: Board<'a>,
    seen: Vec<(String, Span)>,
    /// Instruments that are not there, which has been told.
    unknown: Vec<String>,
    /// Programs of several instruments.
    pub zones: Vec<Zones<'a>>,
    /// Whether its keys are said, and right.
    pub keys_known: bool,
}

impl<'a, 'i, 'd> Reader<'a, 'i, 'd> {
    fn new(
        items: &'i Items<'a>,
        options: &'i Options,
        diags: &'d mut Diags,
        ast: &'a ast::Keyboard,
    ) -> Reader<'a, 'i, 'd> {
        let keyboard = Keyboard {
            name: ast.name.node.clone(),
            span: ast.name.span,
            board: None,
            chips: 1,
            device: DeviceName::Bundled(DEFAULT_DEVICE.to_string()),
            rate_hz: options.usual_rate_hz(),
            layout: Layout {
                first_note: 21,
                keys: 88,
                programs: IdMap::new(),
            },
        };
        let board = Board {
            keyboard,
            ast,
            per_key: Vec::new(),
            keys: None,
        };
        Reader {
            items,
            options,
            diags,
            board,
            seen: Vec::new(),
            unknown: Vec::new(),
            zones: Vec::new(),
            keys_known: false,
        }
    }

    fn read(mut self) -> Board<'a> {
        let ast = self.board.ast;
        for setting in &ast.settings {
            self.setting(setting);
        }
        if self.board.keys.is_none() {
            self.board.keyboard.layout.keys = 1;
            if self.seen.iter().all(|(seen, _)| seen != "device") {
                self.board.keyboard.device = DeviceName::Usual;
            }
        }
        for setting in &ast.settings {
            if let Setting::Zones { name, zones, .. } = setting {
                self.zones(name, zones);
            }
        }
        self.programs();
        for setting in &ast.settings {
            if let Setting::PerKey {
                instrument,
                param,
                points,
            } = setting
            {
                self.per_key(instrument, param, points);
            }
        }
        let of_keys = |s: &Setting| matches!(s, Setting::Zones { .. } | Setting::PerKey { .. });
        let missing = [
            ("rate", "rate 44100 Hz", true),
            ("keys", "keys A0 .. C8", ast.settings.iter().any(of_keys)),
            ("programs", "programs name, name", true),
        ];
        for (what, example, is_needed) in missing {
            if is_needed && self.seen.iter().all(|(seen, _)| seen != what) {
                let message = format!("the keyboard `{}` has no `{what}`", ast.name.node);
                let diagnostic =
                    Diagnostic::new(Code::MissingSetting, ast.name.span, message, "incomplete");
                self.diags
                    .push(diagnostic.hint(format!("add a line such as `{example}`")));
            }
        }
        self.board
    }

    fn setting(&mut self, setting: &'a Setting) {
        match setting {
            Setting::Board { name, chips } => {
                if self.is_first("board", name.span) {
                    self.is_bundled("board", name, &boards());
                    self.board.keyboard.board = Some(name.node.clone());
                    if let Some(chips) = chips {
                        self.chips(chips);
                    }
                }
            }
            Setting::Device(name) => {
                if self.is_first("device", name.span) {
                    self.is_bundled("device", name, &devices());
                    self.board.keyboard.device = DeviceName::Bundled(name.node.clone());
                }
            }
            Setting::DeviceFile(file) => {
                if self.is_first("device", file.span) {
                    self.device_file(file);
                }
            }
            Setting::Rate(expr) => {
                if self.is_first("rate", expr.span) {
                    self.rate(expr);
                }
            }
            Setting::Keys(first, last) => {
                if self.is_first("keys", first.span) {
                    self.board.keys = Some(first.span.to(last.span));
                    self.keys(first, last);
                }
            }
            Setting::Programs(_) | Setting::Zones { .. } | Setting::PerKey { .. } => {}
        }
    }

    fn is_first(&mut self, what: &str, span: Span) -> bool {
        let first = self
            .seen
            .iter()
            .find(|(seen, _)| seen == what)
            .map(|(_, span)| *span);
        if let Some(first) = first {
            let message = format!("`{what}` is set twice");
            self.diags.push(
                Diagnostic::new(Code::RepeatedSetting, span, message, "the second time")
                    .also(first, "the first time")
                    .hint("take one of them away"),
            );
        }
        self.seen.push((what.to_string(), span));
        first.is_none()
    }

    /// The value of a number in the keyboard; a bool counts as 0 or 1, its type tells.
    fn number(&mut self, expr: &'a Expr) -> Option<(f64, Ty)> {
        let errors = self.diags.errors();
        let settings = Settings::bare(self.options);
        let mut elaborator = Elaborator::new(self.items, settings, self.diags, "", "");
        elaborator
            .scopes
            .push(Scope::new(String::new(), &[], None, None));
        let found = elaborator.expr(ScopeId(0), expr);
        let dag = &elaborator.model.dag;
        let value = |node| dag.real(node).or_else(|| dag.bool(node).map(f64::from));
        let number = found.and_then(|Value { node, ty }| Some((value(node)?, ty)));
        if number.is_none() && self.diags.errors() == errors {
            let diagnostic = Diagnostic::new(
                Code::NotConstant,
                expr.span,
                "a number is needed here",
                "not a number",
            );
            self.diags
                .push(diagnostic.hint("write a number with its unit"));
        }
        number
    }

    fn rate(&mut self, expr: &'a Expr) {
        let Some((rate, ty)) = self.number(expr) else {
            return;
        };
        if ty != Ty::Real(Dim::PER_TIME) {
            let message = format!("`rate` is a frequency (Hz), not {}", ty.words());
            let code = if ty == Ty::Real(Dim::NUMBER) {
                Code::MissingUnit
            } else {
                Code::WrongType
            };
            let diagnostic = Diagnostic::new(code, expr.span, message, ty.words());
            self.diags
                .push(diagnostic.hint("write it in Hz, such as `rate 44100 Hz`"));
            return;
        }
        match tick_rate(rate) {
            Ok(rate_hz) => {
                // The caller's wins, as any value that is set from outside.
                self.board.keyboard.rate_hz = self.options.rate_hz.unwrap_or(rate_hz);
            }
            Err(rule) => {
                let message = format!("`rate` cannot be {rate} Hz: {rule}");
                let diagnostic = Diagnostic::new(Code::BadRate, expr.span, message, "this rate");
                self.diags.push(diagnostic.hint("44100 Hz is usual"));
            }
        }
    }

    fn keys(&mut self, first: &Name, last: &Name) {
        let (low, high) = (self.note(first), self.note(last));
        let (Some(low), Some(high)) = (low, high) else {
            return;
        };
        if low > high {
            let message = format!("the keys {} .. {} are none", first.node, last.node);
            let diagnostic =
                Diagnostic::new(Code::EmptyRange, first.span.to(last.span), message, "empty");
            self.diags
                .push(diagnostic.hint("the lowest key comes first"));
            return;
        }
        let layout = &mut self.board.keyboard.layout;
        layout.first_note = low;
        layout.keys = u32::from(high - low) + 1;
        self.keys_known = true;
    }

    /// MIDI number of a note.
    pub fn note(&mut self, name: &Name) -> Option<u8> {
        let number = midi_number(&name.node);
        if number.is_none() {
            let message = format!("`{}` is not a note", name.node);
            let hint =
                "notes are `C4`, `C#4`, `Db4`: a letter A to G and an octave 0 to 9, up to `G9`";
            self.diags.push(
                Diagnostic::new(Code::UnknownNote, name.span, message, "unknown note").hint(hint),
            );
        }
        number
    }

    fn programs(&mut self) {
        let mut listed: Vec<String> = Vec::new();
        for setting in &self.board.ast.settings {
            let Setting::Programs(names) = setting else {
                continue;
            };
            let span = names.first().map_or(self.board.ast.name.span, |n| n.span);
            if self.is_first("programs", span) {
                for name in names {
                    self.program(name, &listed);
                    listed.push(name.node.clone());
                }
            }
        }
        self.unused_zones(&listed);
    }

    /// A program, behind those that are listed before it.
    fn program(&mut self, name: &Name, listed: &[String]) {
        if listed.contains(&name.node) {
            let message = format!("the program `{}` is listed twice", name.node);
            let diagnostic =
                Diagnostic::new(Code::RepeatedSetting, name.span, message, "the second time");
            self.diags.push(diagnostic.hint("take it away"));
            return;
        }
        if let Some(zones) = self.zones.iter().find(|zones| zones.name.node == name.node) {
            self.board.keyboard.layout.programs.push(zones.program());
            return;
        }
        if let Some(instrument) = self.instrument(name) {
            let layout = &mut self.board.keyboard.layout;
            let keys = KeyRange::new(0, layout.keys);
            layout.programs.push(Program {
                name: name.node.clone(),
                zones: vec![Zone { keys, instrument }].into(),
            });
        }
    }

    /// The number of an instrument; that there is none is told once.
    pub fn instrument(&mut self, name: &Name) -> Option<InstrumentId> {
        let found = self.items.instrument(&name.node);
        if found.is_none() && !self.unknown.contains(&name.node) {
            self.unknown.push(name.node.clone());
            let zones = self.zones.iter().map(|zones| zones.name.node.as_str());
            let near = nearest(&name.node, zones)
                .filter(|_| self.items.nearest_instrument(&name.node).is_none());
            self.diags.push(match near {
                None => unknown_instrument(&name.node, name.span, self.items),
                Some(near) => {
                    let message = format!(
                        "there is no instrument `{}`, and there are no such zones",
                        name.node
                    );
                    let diagnostic = Diagnostic::new(
                        Code::UnknownInstrument,
                        name.span,
                        message,
                        "unknown program",
                    );
                    diagnostic.hint(Advice::did_you_mean(near))
                }
            });
        }
        found.map(instrument_id)
    }

    fn per_key(&mut self, instrument: &Name, param: &'a Name, points: &'a [(Name, Expr)]) {
        let points = self.points(param, points);
        if let Some(zones) = self
            .zones
            .iter()
            .find(|zones| zones.name.node == instrument.node)
        {
            let message = format!(
                "`{}` are zones, and values per key belong to an instrument",
                instrument.node
            );
            let diagnostic = Diagnostic::new(
                Code::UnknownInstrument,
                instrument.span,
                message,
                "no instrument",
            );
            let diagnostic = diagnostic.also(zones.name.span, "the zones");
            self.diags.push(
                diagnostic.hint("name the instrument: its keys find their values in any zone"),
            );
            return;
        }
        let Some(id) = self.instrument(instrument) else {
            return;
        };
        if !self.board.keyboard.layout.instruments().contains(&id) {
            let message = format!("`{}` is not a program of this keyboard", instrument.node);
            let diagnostic = Diagnostic::new(
                Code::UnknownInstrument,
                instrument.span,
                message,
                "not listed",
            );
            self.diags.push(
                diagnostic.hint("add it to `programs` or to its zones, or take this line away"),
            );
            return;
        }
        let ast = self.items.instruments[id.index()];
        if !ast
            .decls
            .iter()
            .any(|d| matches!(&d.kind, DeclKind::Param { name, .. } if name.node == param.node))
        {
            self.diags
                .push(unknown_param(&param.node, param.span, &[ast]));
            return;
        }
        if self.is_first(&format!("{}.{}", instrument.node, param.node), param.span) {
            self.board.per_key.push(PerKey {
                instrument: id,
                param,
                points,
            });
        }
    }

    /// The given values by rising note; empty if one is in error.
    fn points(&mut self, param: &Name, given: &'a [(Name, Expr)]) -> Vec<Point> {
        if given.is_empty() {
            let message = format!("no values are given for `{}`", param.node);
            let diagnostic = Diagnostic::new(Code::MissingSetting, param.span, message, "empty");
            self.diags.push(
                diagnostic.hint("give at least one note and its value, such as `{ A0: 0.1 N }`"),
            );
        }
        let mut points: Vec<Point> = Vec::new();
        for (name, expr) in given {
            let (note, number) = (self.note(name), self.number(expr));
            let (Some(note), Some((value, ty))) = (note, number) else {
                continue;
            };
            match points.iter().find(|p| p.note == note) {
                None => points.push(Point {
                    note,
                    value,
                    ty,
                    span: expr.span,
                }),
                Some(first) => {
                    let message = format!("the note `{}` is given twice", name.node);
                    let diagnostic = Diagnostic::new(
                        Code::RepeatedSetting,
                        name.span,
                        message,
                        "the second time",
                    );
                    self.diags.push(
                        diagnostic
                            .also(first.span, "the first value")
                            .hint("take one of them away"),
                    );
                }
            }
        }
        points.sort_by_key(|p| p.note);
        if points.len() == given.len() {
            points
        } else {
            Vec::new()
        }
    }
}
