//! A piece as a small linear discrete system: the sensed motion in, the force terms out, coupled
//! cells between.
//!
//! ```text
//!   y = (x, x', x'') of every sense      s: cells that the motion moves and the force feels (hammer in contact, bristle)
//!   s[k+1] = A s[k] + B y[k]             bodies by semi-implicit Euler, as a tick does it
//!   f[k]   = C s[k] + D y[k]             one row per force term
//! ```

use super::gradient::{Row, cell_variable, decided, is_point};
use super::pieces::{Law, Piece};
use whippen_ids::IdMap;
use whippen_lang::model::{CellId, Interval, NodeId};

/// How one force term answers.
#[derive(Debug, Clone, PartialEq)]
pub struct Output<T> {
    /// By input.
    pub direct: Vec<T>,
    /// By cell.
    pub cells: Vec<T>,
}

/// A linear discrete system.
#[derive(Debug, Clone, PartialEq)]
pub struct Linear<T> {
    /// One per force term.
    pub outputs: Vec<Output<T>>,
    /// By cell, then by cell.
    pub a: Vec<Vec<T>>,
    /// By cell, then by input.
    pub b: Vec<Vec<T>>,
}

/// With numbers.
pub type System = Linear<f64>;

impl<T: Copy> Linear<T> {
    fn map<U>(&self, f: impl Fn(T) -> U + Copy) -> Linear<U> {
        let row = |row: &Vec<T>| row.iter().map(|v| f(*v)).collect();
        Linear {
            outputs: self
                .outputs
                .iter()
                .map(|o| Output {
                    direct: row(&o.direct),
                    cells: row(&o.cells),
                })
                .collect(),
            a: self.a.iter().map(row).collect(),
            b: self.b.iter().map(row).collect(),
        }
    }
}

impl System {
    /// The same with one output, the sum of all: what the hand feels.
    pub(super) fn summed(&self) -> System {
        let sum = |of: fn(&Output<f64>) -> &Vec<f64>| {
            let mut all: Vec<f64> = self.outputs.first().map_or(Vec::new(), |o| of(o).clone());
            for output in self.outputs.iter().skip(1) {
                all.iter_mut()
                    .zip(of(output))
                    .for_each(|(sum, v)| *sum += v);
            }
            all
        };
        System {
            outputs: vec![Output {
                direct: sum(|o| &o.direct),
                cells: sum(|o| &o.cells),
            }],
            a: self.a.clone(),
            b: self.b.clone(),
        }
    }
}

impl Linear<Interval> {
    /// The system of a piece.
    pub(super) fn of(law: &Law, piece: &Piece, rows: &IdMap<NodeId, Row>) -> Linear<Interval> {
        let inputs = 3 * law.model.senses.len();
        let direct = |row: &Row| (0..inputs).map(|i| row.get(i as u32)).collect();
        let cells = |row: &Row| {
            law.cells
                .iter()
                .map(|&c| row.get(cell_variable(&law.model, c)))
                .collect()
        };
        let next: Vec<Row> = law
            .cells
            .iter()
            .map(|&cell| next(law, piece, rows, cell))
            .collect();
        let outputs = law.model.forces.iter().map(|force| &rows[force.value]);
        Linear {
            outputs: outputs
                .map(|row| Output {
                    direct: direct(row),
                    cells: cells(row),
                })
                .collect(),
            a: next.iter().map(cells).collect(),
            b: next.iter().map(direct).collect(),
        }
        .pruned()
    }

    /// Without cells that the motion does not move, or that no force feels.
    fn pruned(self) -> Linear<Interval> {
        let some = |v: &Interval| v.magnitude() > 0.0;
        let n = self.a.len();
        let mut moved: Vec<bool> = self.b.iter().map(|row| row.iter().any(some)).collect();
        let mut felt: Vec<bool> = (0..n)
            .map(|c| self.outputs.iter().any(|o| some(&o.cells[c])))
            .collect();
        for _ in 0..n {
            for to in 0..n {
                for from in 0..n {
                    if some(&self.a[to][from]) {
                        moved[to] |= moved[from];
                        felt[from] |= felt[to];
                    }
                }
            }
        }
        let kept: Vec<usize> = (0..n).filter(|&c| moved[c] && felt[c]).collect();
        let of = |row: &[Interval]| kept.iter().map(|&c| row[c]).collect::<Vec<_>>();
        let outputs = self.outputs.iter().map(|o| Output {
            direct: o.direct.clone(),
            cells: of(&o.cells),
        });
        Linear {
            outputs: outputs.collect(),
            a: kept.iter().map(|&c| of(&self.a[c])).collect(),
            b: kept.iter().map(|&c| self.b[c].clone()).collect(),
        }
    }

    /// What holds of it if one of these does, too; none of them has cells.
    pub(super) fn within(mut self, parts: &[Linear<Interval>]) -> Linear<Interval> {
        if parts.is_empty() || parts.iter().any(|part| !part.a.is_empty()) {
            return self;
        }
        for (number, output) in self.outputs.iter_mut().enumerate() {
            for (input, own) in output.direct.iter_mut().enumerate() {
                let all = parts.iter().map(|part| part.outputs[number].direct[input]);
                if let Some(hull) = all.reduce(Interval::union) {
                    let (low, high) = (own.low.max(hull.low), own.high.min(hull.high));
                    if low <= high {
                        *own = Interval { low, high };
                    }
                }
            }
        }
        self
    }

    /// Sum over the force terms by input.
    pub(super) fn total(&self, input: usize) -> Interval {
        let zero = Interval::point(0.0);
        self.outputs
            .iter()
            .map(|o| o.direct[input])
            .filter(|v| v.magnitude() > 0.0)
            .fold(zero, |sum, v| sum + v)
    }

    /// Systems at the corners: each direct derivative at both its ends; what cells hold at both
    /// ends and in the middle.
    pub(super) fn corners(&self) -> Vec<System> {
        let inputs = self.outputs.first().map_or(0, |o| o.direct.len());
        let open: Vec<usize> = (0..inputs).filter(|&i| !is_point(self.total(i))).collect();
        let all = |rows: &[Vec<Interval>]| rows.iter().flatten().all(|v| is_point(*v));
        let fixed = all(&self.a)
            && all(&self.b)
            && self
                .outputs
                .iter()
                .all(|o| o.cells.iter().all(|v| is_point(*v)));
        let mut systems = Vec::new();
        for part in if fixed { &[0.5][..] } else { &[0.0, 0.5, 1.0] } {
            let between = |v: Interval| v.low + part * (v.high - v.low);
            for corner in 0..1usize << open.len() {
                let mut system = self.map(between);
                for (bit, &input) in open.iter().enumerate() {
                    let high = corner >> bit & 1 == 1;
                    let end = |v: Interval| if high { v.high } else { v.low };
                    for (output, own) in system.outputs.iter_mut().zip(&self.outputs) {
                        output.direct[input] = end(own.direct[input]);
                    }
                }
                systems.push(system);
            }
        }
        systems
    }
}

/// What a cell holds in the next tick.
fn next(law: &Law, piece: &Piece, rows: &IdMap<NodeId, Row>, cell: CellId) -> Row {
    let row = |node: NodeId| &rows[node];
    let unit = |cell: CellId| Row::unit(cell_variable(&law.model, cell));
    let period_s = Interval::point(1.0 / f64::from(law.model.rate_hz));
    if let Some((_, value)) = law.model.nexts.iter().find(|(c, _)| *c == cell) {
        return row(*value).clone();
    }
    let body = law
        .model
        .bodies
        .iter()
        .find(|b| b.coordinate == cell || b.rate == cell);
    let Some(body) = body else { return unit(cell) };
    let coordinate = body.coordinate;
    let rate = body.rate;
    if body
        .hold
        .is_some_and(|hold| decided(&piece.at, hold) == Some(true))
    {
        return if cell == rate {
            Row::default()
        } else {
            unit(coordinate)
        };
    }
    let new_rate = unit(rate).plus(&row(body.acceleration).scaled(period_s));
    if cell == rate {
        new_rate
    } else {
        unit(coordinate).plus(&new_rate.scaled(period_s))
    }
}
