//! The force law in pieces: places of its memory and its sensors at which every choice that matters
//! is decided.
//!
//! ```text
//!   everything --friction slides?--+-- yes --in contact?--+-- yes ..
//!                                  |                      `-- no  ..   intervals are narrowed at each step (`lint::together`);
//!                                  `-- no  ..                          what is empty then does not occur and is left out
//! ```
//!
//! So states that exclude each other by what their conditions ask do not meet here. That a
//! combination of states is never entered for another reason is not seen: then a piece is judged
//! that does not occur, which is on the safe side.

use super::gradient::{Deciders, Gradient, Row, add_deciders, cell_variable, decided};
use std::sync::OnceLock;
use whippen_ids::IdMap;
use whippen_lang::lint::together::{Facts, narrow};
use whippen_lang::model::{Body, CellId, CellKind, Interval, Model, Node, NodeId};
use whippen_lang::range::{self, Ranges};

/// So many pieces are looked at; what is open beyond is taken with both branches at once.
const PIECES_MAX: usize = 1500;

/// So many values are narrowed to make them.
const WORK_MAX: usize = 1_000_000;

/// A place.
#[derive(Debug, Clone)]
pub(super) struct Piece {
    /// Where every value lies.
    pub at: IdMap<NodeId, Interval>,
    /// What was decided to get here.
    pub decisions: Vec<(NodeId, bool)>,
    /// Some choices are open: derivatives are those of all branches.
    pub coarse: bool,
}

impl Piece {
    /// What is decided, as facts.
    fn facts(&self) -> Facts {
        let of = |value: bool| {
            self.decisions
                .iter()
                .filter(move |(_, v)| *v == value)
                .map(|(n, _)| *n)
                .collect()
        };
        Facts {
            holds: of(true),
            fails: of(false),
            states: Vec::new(),
        }
    }
}

/// The force law of an instrument, ready to be taken to pieces.
pub struct Law {
    /// As checked, with the comparisons by which choices are made.
    pub(super) model: Model,
    pub(super) deciders: Deciders,
    /// What forces and the memory behind them are made of, operands first.
    pub(super) nodes: Vec<NodeId>,
    /// Cells that a force depends on, through other cells too.
    pub(super) cells: Vec<CellId>,
    ranges: Ranges,
    pieces: OnceLock<Vec<(Piece, IdMap<NodeId, Row>)>>,
}

impl Law {
    /// The law of an instrument; `None` where its ranges cannot be bounded, which compiling it
    /// reports, where a force depends on a friction, that sticks or slips and has no slope in
    /// between, and where it depends on a string, that has more modes than are looked at.
    pub fn of(model: &Model) -> Option<Law> {
        let mut model = model.clone();
        let deciders = add_deciders(&mut model);
        let ranges = range::analyze(&model).ok()?;
        let mut law = Law {
            model,
            deciders,
            nodes: Vec::new(),
            cells: Vec::new(),
            ranges,
            pieces: OnceLock::new(),
        };
        law.find_cells();
        law.nodes = law.below(&law.roots());
        (!law.is_rubbed_or_strung()).then_some(law)
    }

    /// Whether a force depends on a friction, through what moves a body too, or on a string.
    fn is_rubbed_or_strung(&self) -> bool {
        let slips = |node: &NodeId| {
            let node = self.model.dag.get(*node);
            matches!(node, Node::Slip(_) | Node::Read(..) | Node::Mean(..))
        };
        let moves = |body: &&Body| self.cells.contains(&body.rate);
        let mut moved = self.model.bodies.iter().filter(moves);
        moved.any(|body| body.friction.is_some()) || self.nodes.iter().any(slips)
    }

    /// Whether the instrument turns.
    pub fn turns(&self) -> bool {
        self.model.turns()
    }

    /// Everything that occurs.
    pub(super) fn whole(&self) -> Piece {
        Piece {
            at: self.ranges.all().clone(),
            decisions: Vec::new(),
            coarse: true,
        }
    }

    /// The pieces, and the rows of each; found once.
    pub(super) fn pieces(&self) -> &[(Piece, IdMap<NodeId, Row>)] {
        self.pieces.get_or_init(|| self.find_pieces())
    }

    fn find_pieces(&self) -> Vec<(Piece, IdMap<NodeId, Row>)> {
        let mut open = vec![Piece {
            coarse: false,
            ..self.whole()
        }];
        let (mut done, mut work) = (Vec::new(), 0);
        while let Some(mut piece) = open.pop() {
            piece.coarse = done.len() + open.len() > PIECES_MAX || work > WORK_MAX;
            work += 2 * self.nodes.len();
            match self.rows(&piece) {
                Ok(rows) => done.push((piece, rows)),
                Err(split) => open.extend(
                    [true, false]
                        .into_iter()
                        .filter_map(|v| self.cut(&piece, split, v)),
                ),
            }
        }
        done
    }

    /// The part of a piece in which a bool has a value.
    fn cut(&self, piece: &Piece, node: NodeId, value: bool) -> Option<Piece> {
        let mut cut = piece.clone();
        cut.decisions.push((node, value));
        cut.at = narrow::narrow(&self.model, &self.nodes, &cut.facts(), cut.at)?;
        Some(cut)
    }

    /// The same piece with some values given, if it has them.
    pub(super) fn given(&self, piece: &Piece, values: &[(NodeId, Interval)]) -> Option<Piece> {
        let mut cut = piece.clone();
        for &(node, value) in values {
            let own = &mut cut.at[node];
            *own = Interval {
                low: own.low.max(value.low),
                high: own.high.min(value.high),
            };
            if own.low > own.high {
                return None;
            }
        }
        cut.at = narrow::narrow(&self.model, &self.nodes, &cut.facts(), cut.at)?;
        Some(cut)
    }

    /// The rows of a piece.
    ///
    /// # Errors
    /// The bool that must be decided first.
    pub(super) fn rows(&self, piece: &Piece) -> Result<IdMap<NodeId, Row>, NodeId> {
        let gradient = Gradient {
            model: &self.model,
            deciders: &self.deciders,
            at: &piece.at,
            coarse: piece.coarse,
        };
        let rows = gradient.rows(&self.nodes)?;
        let holds = self
            .model
            .bodies
            .iter()
            .filter(|b| self.cells.contains(&b.coordinate));
        match holds
            .filter_map(|b| b.hold)
            .find(|hold| !piece.coarse && decided(&piece.at, *hold).is_none())
        {
            Some(open) => Err(open),
            None => Ok(rows),
        }
    }

    /// The nodes of parameters that have a range while playing or over the keys.
    pub(super) fn parameters(&self) -> Vec<NodeId> {
        let is = |id: &&NodeId| matches!(self.model.dag.get(**id), Node::Live(_) | Node::Keyed(_));
        self.nodes.iter().filter(is).copied().collect()
    }

    /// Force terms, and what moves the cells behind them.
    fn roots(&self) -> Vec<NodeId> {
        let model = &self.model;
        let mut roots: Vec<NodeId> = model.forces.iter().map(|force| force.value).collect();
        for body in model
            .bodies
            .iter()
            .filter(|b| self.cells.contains(&b.coordinate))
        {
            roots.push(body.acceleration);
            roots.extend(body.hold);
        }
        let nexts = model
            .nexts
            .iter()
            .filter(|(cell, _)| self.cells.contains(cell));
        roots.extend(nexts.map(|(_, value)| *value));
        roots
    }

    /// Adds the cells that some derivative asks for, until no more come.
    fn find_cells(&mut self) {
        loop {
            let roots = self.roots();
            self.nodes = self.below(&roots);
            let whole = self.whole();
            let rows = self.rows(&whole).unwrap_or_default();
            let asks = |cell: CellId| {
                let variable = cell_variable(&self.model, cell);
                roots.iter().any(|r| {
                    rows.get(*r)
                        .is_some_and(|row| row.get(variable).magnitude() > 0.0)
                })
            };
            let model = &self.model;
            let mut cells: Vec<CellId> = (model.cells.ids())
                .filter(|&cell| self.model.cells[cell].kind != CellKind::Pulse && asks(cell))
                .collect();
            // A coordinate moves with its rate, and the rate's body is the coordinate's.
            for body in &self.model.bodies {
                let pair = [body.coordinate, body.rate];
                if pair.iter().any(|cell| cells.contains(cell)) {
                    cells.extend(pair);
                }
            }
            cells.extend(&self.cells);
            cells.sort_unstable();
            cells.dedup();
            if cells == self.cells {
                return;
            }
            self.cells = cells;
        }
    }

    fn below(&self, roots: &[NodeId]) -> Vec<NodeId> {
        let mut nodes: Vec<NodeId> = roots
            .iter()
            .flat_map(|root| self.model.dag.below(*root))
            .collect();
        let choices: Vec<NodeId> = nodes
            .iter()
            .filter_map(|node| self.deciders.get(node).copied())
            .collect();
        nodes.extend(
            choices
                .iter()
                .flat_map(|choice| self.model.dag.below(*choice)),
        );
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }
}
