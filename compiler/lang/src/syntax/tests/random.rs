//! Trees made by chance. The generator is seeded: a failing case comes back.

use super::spans::without;
use super::*;
use crate::bundled::programs;
use crate::syntax::pretty::print;
use crate::syntax::token::SOFT_KEYWORDS;
use whippen_source::Span;

/// Marsaglia's xorshift.
pub(super) struct Dice(pub u64);

impl Dice {
    pub fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as usize % n.max(1)
    }

    pub fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.below(from.len())]
    }

    fn maybe<T>(&mut self, make: impl FnOnce(&mut Dice) -> T) -> Option<T> {
        (self.below(2) == 0).then(|| make(self))
    }

    pub fn some<T>(&mut self, least: usize, make: impl Fn(&mut Dice) -> T) -> Vec<T> {
        (0..least + self.below(3)).map(|_| make(self)).collect()
    }

    fn name(&mut self) -> Name {
        let plain = [
            "x", "k", "B_k", "m", "s", "N", "g", "mm", "e", "e1", "A0", "min", "pi", "_", "note",
        ];
        let text = if self.below(2) == 0 {
            self.pick(&plain)
        } else {
            self.pick(SOFT_KEYWORDS)
        };
        Spanned {
            node: text.to_string(),
            span: Span::default(),
        }
    }

    fn typed(&mut self) -> TypedName {
        TypedName {
            name: self.name(),
            ty: self.ty(),
        }
    }

    fn ty(&mut self) -> Name {
        let node = self.pick(&["length", "force", "bool", "angle"]).to_string();
        Spanned {
            node,
            span: Span::default(),
        }
    }

    fn expr(&mut self, depth: usize) -> Expr {
        let leaves = 4;
        let kind = match self.below(if depth == 0 { leaves } else { 15 }) {
            0 => ExprKind::Name(self.name().node),
            1 => ExprKind::Bool(self.below(2) == 0),
            2 => {
                let text = self.pick(&["0", "1.5", "2e3", "1.54e-4", "12"]).to_string();
                let unit =
                    self.maybe(|d| d.pick(&["N", "N*s/m", "kg*m^2", "s^-1", "mm"]).to_string());
                ExprKind::Number(Number {
                    value: text.parse().unwrap(),
                    text,
                    unit,
                })
            }
            3 => ExprKind::Is {
                machine: self.name(),
                state: self.name(),
                negated: self.below(2) == 0,
            },
            4 => ExprKind::Field(Box::new(self.expr(depth - 1)), self.name()),
            5 => {
                let args = self.some(0, |d| Arg {
                    name: d.maybe(Dice::name),
                    value: d.expr(depth - 1),
                });
                ExprKind::Call(self.name(), args)
            }
            14 => ExprKind::Member(
                Box::new(self.expr(depth - 1)),
                Box::new(self.expr(depth - 1)),
            ),
            6 => ExprKind::Prime(Box::new(self.expr(depth - 1))),
            7 => ExprKind::Neg(Box::new(self.expr(depth - 1))),
            8 => ExprKind::Not(Box::new(self.expr(depth - 1))),
            9 => {
                let mut part = || Box::new(self.expr(depth - 1));
                ExprKind::If(part(), part(), part())
            }
            _ => {
                use BinOp::*;
                let op = self.pick(&[Add, Sub, Mul, Div, Pow, Lt, Le, Gt, Ge, And, Or]);
                ExprKind::Binary(
                    op,
                    Box::new(self.expr(depth - 1)),
                    Box::new(self.expr(depth - 1)),
                )
            }
        };
        Expr {
            kind,
            span: Span::default(),
        }
    }

    fn value(&mut self) -> Expr {
        let depth = self.below(5);
        self.expr(depth)
    }

    fn range(&mut self) -> RangeExpr {
        RangeExpr {
            low: self.value(),
            high: self.value(),
            span: Span::default(),
        }
    }

    fn action(&mut self) -> Action {
        let kind = match self.below(3) {
            0 => ActionKind::Emit {
                name: self.name(),
                args: self.some(0, |d| (d.name(), d.value())),
            },
            1 => ActionKind::Write {
                name: self.name(),
                rate: self.below(2) == 0,
                value: self.value(),
            },
            _ => ActionKind::Fire {
                pulse: self.name(),
                value: self.value(),
            },
        };
        Action {
            kind,
            span: Span::default(),
        }
    }

    fn transition(&mut self) -> Transition {
        let actions = self.some(0, Dice::action);
        Transition {
            from: self.name(),
            to: self.name(),
            guard: self.value(),
            actions,
            span: Span::default(),
        }
    }

    fn part(&mut self) -> BodyPart {
        let (angle, span) = (self.below(2) == 0, Span::default());
        match self.below(4) {
            3 => BodyPart::Friction {
                name: self.name(),
                slip: self.name(),
                against: self.value(),
                law: self.value(),
                span,
            },
            0 => BodyPart::Coordinate {
                angle,
                name: self.name(),
                range: self.range(),
                init: self.maybe(Dice::value),
                rate_range: self.range(),
                rate_init: self.maybe(Dice::value),
                span,
            },
            1 => BodyPart::Inertia {
                angle,
                value: self.value(),
                span,
            },
            _ => BodyPart::Torque {
                angle,
                value: self.value(),
                span,
            },
        }
    }

    fn string_part(&mut self) -> StringPart {
        let (value, span) = (self.value(), Span::default());
        match self.below(8) {
            6 => StringPart::Friction {
                name: self.name(),
                slip: self.name(),
                place: value,
                against: self.value(),
                law: self.value(),
                span,
            },
            0 => StringPart::Coordinate {
                name: self.name(),
                range: self.range(),
                rate_range: self.range(),
                span,
            },
            1 => StringPart::Density { value, span },
            2 => StringPart::Load { value, span },
            3 => StringPart::Force {
                value,
                place: self.value(),
                span,
            },
            4 => StringPart::Ends {
                first: self.name(),
                second: self.maybe(Dice::name),
                span,
            },
            5 => StringPart::Tuned {
                name: self.name(),
                pitch: value,
                span,
            },
            _ => StringPart::Points { value, span },
        }
    }

    fn decl(&mut self) -> Decl {
        let (name, value) = (self.name(), self.value());
        let kind = match self.below(19) {
            0 => {
                let (slew, over) = (self.maybe(Dice::value), self.maybe(Dice::value));
                DeclKind::Sense {
                    name,
                    ty: self.ty(),
                    range: self.range(),
                    slew,
                    over,
                }
            }
            1 => DeclKind::Param {
                live: self.below(2) == 0,
                name,
                value,
                range: self.maybe(Dice::range),
                glide: self.maybe(Dice::value),
            },
            2 => DeclKind::Let { name, value },
            3 => DeclKind::States {
                name,
                transitions: self.some(0, Dice::transition),
            },
            4 => DeclKind::State {
                name,
                ty: self.ty(),
                range: self.range(),
                init: self.maybe(Dice::value),
            },
            5 => DeclKind::Next { name, value },
            6 => DeclKind::Body {
                name,
                parts: self.some(0, Dice::part),
            },
            7 => DeclKind::Event {
                name,
                trigger: match self.below(2) {
                    0 => Trigger::When(value),
                    _ => Trigger::Every(value),
                },
                actions: self.some(0, Dice::action),
            },
            8 => DeclKind::Pulse {
                name,
                ty: self.ty(),
                range: self.range(),
                lasting: value,
            },
            9 => DeclKind::Hold {
                body: name,
                guard: value,
            },
            10 => DeclKind::Force {
                turning: self.below(2) == 0,
                name,
                on: (self.below(2) == 0).then(|| self.name()),
                value,
            },
            11 => DeclKind::Noise { name },
            12 => DeclKind::Delay {
                name,
                ty: self.ty(),
                range: self.range(),
                lasting: value,
            },
            13 => DeclKind::Feed { delay: name, value },
            14 => DeclKind::Sound {
                name,
                side: self.maybe(Dice::name),
                value,
            },
            15 => DeclKind::String {
                name,
                along: self.range(),
                parts: self.some(0, Dice::string_part),
            },
            16 => DeclKind::Bank {
                name,
                index: self.name(),
                range: self.range(),
                decls: self.maybe(Dice::decl).into_iter().collect(),
            },
            17 => DeclKind::Table {
                name,
                ty: self.ty(),
                over: self.ty(),
                cubic: self.below(2) == 0,
                knots: match self.below(2) {
                    0 => Knots::Listed(self.some(0, |d| (d.value(), d.value()))),
                    _ => Knots::File(Spanned {
                        node: "curves/a switch.csv".to_string(),
                        span: Span::default(),
                    }),
                },
            },
            _ => DeclKind::Result { name, value },
        };
        Decl {
            kind,
            span: Span::default(),
        }
    }

    fn setting(&mut self) -> Setting {
        match self.below(8) {
            0 => Setting::Board {
                name: self.name(),
                chips: (self.below(2) == 0).then(|| Spanned {
                    node: (1 + self.below(16)).to_string(),
                    span: Span::default(),
                }),
            },
            1 => Setting::Device(self.name()),
            2 => Setting::Rate(self.value()),
            7 => Setting::DeviceFile(Spanned {
                node: "keys/my key.toml".to_string(),
                span: Span::default(),
            }),
            3 => Setting::Keys(
                self.name(),
                Spanned {
                    node: "C#8".to_string(),
                    span: Span::default(),
                },
            ),
            4 => Setting::Programs(self.some(1, Dice::name)),
            5 => {
                let zone = |d: &mut Dice| Zone {
                    low: d.name(),
                    high: d.name(),
                    instrument: d.name(),
                };
                Setting::Zones {
                    name: self.name(),
                    zones: self.some(0, zone),
                    span: Span::default(),
                }
            }
            _ => {
                let points = self.some(0, |d| (d.name(), d.value()));
                Setting::PerKey {
                    instrument: self.name(),
                    param: self.name(),
                    points,
                }
            }
        }
    }

    pub fn item(&mut self) -> Item {
        let (name, span) = (self.name(), Span::default());
        let doc = self
            .pick(&["", "One line.", "Two\nlines.", "An empty one\n\nbetween."])
            .to_string();
        match self.below(3) {
            0 => Item::Instrument(Instrument {
                doc,
                name,
                decls: self.some(0, Dice::decl),
                span,
            }),
            1 => {
                let (params, results) = (self.some(0, Dice::typed), self.some(1, Dice::typed));
                Item::Term(Term {
                    doc,
                    name,
                    params,
                    results,
                    decls: self.some(0, Dice::decl),
                    span,
                })
            }
            _ => Item::Keyboard(Keyboard {
                doc,
                name,
                settings: self.some(0, Dice::setting),
                span,
            }),
        }
    }
}

#[test]
fn what_is_printed_reads_back() {
    for (name, text) in programs() {
        let file = tree(text);
        assert_eq!(without(tree(&print(&file))), without(file), "{name}");
    }
    let mut dice = Dice(0x5eed);
    for _ in 0..3000 {
        let file = File {
            items: dice.some(1, Dice::item),
        };
        let text = print(&file);
        let again = tree(&text);
        assert_eq!(without(again.clone()), file, "{text}");
        assert_eq!(print(&again), text);
    }
}
