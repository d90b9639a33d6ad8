//! Algebra on the Model, where it is legal: over the reals.
//!
//! * Constants fold; sums of scaled values become one [`Node::Linear`], so `T * l3 / I * k` is one
//!   coefficient and the integer form one chain of multiply-accumulates.
//! * Both arms of an `if` give up what they share: `if c then a + x else b + x` is `x + if c then a
//!   else b`, and one value with two factors becomes a product with a chosen constant, as does a
//!   division by one.
//! * What values per key and constants decide alone is a value per key.
//! * Constants that are divided by the same value are products with its one reciprocal.
//! * A value divided by what live parameters alone decide is a product with a quotient that all
//!   keys share. By what does not move far, or by an exponential, it needs no quotient.
//! * What the ranges decide is gone: a `max` that never bites, a comparison that always holds.
//! * Comparisons compare a value with a constant where they can: the threshold is scaled, not the
//!   value.
//! * The steps by which frictions are solved are written out; what of a law one value decides is a
//!   curve.
//! * The step of every body is written out (rule 3: rate first, then coordinate), so it takes part
//!   in all this.
//!
//! Not here: formats, integers. Nothing is reordered that the f64 engine could tell from the source
//! by more than rounding.

mod choice;
mod curve;
mod friction;
mod keyed;
mod linear;
mod reciprocal;
mod rewrite;

use rewrite::Rewriter;
use whippen_ids::IdMap;
use whippen_lang::diag::Diagnostic;
use whippen_lang::model::{Dag, Interval, Model, Node, NodeId};
use whippen_lang::range::{self, Ranges};

/// A Model after algebra, with the step of its bodies and the sum of its forces as nodes.
#[derive(Debug, Clone)]
pub struct Step {
    /// The Model over the new graph.
    pub model: Model,
    /// Per body: its rate after this tick's integration, before clamps and actions.
    pub rates: Vec<NodeId>,
    /// Per body: its coordinate after this tick's integration, before clamps and actions.
    pub coordinates: Vec<NodeId>,
    /// Per driven port ([`Model::drives`]): the sum of its force terms (N or N*m).
    pub drives: Vec<NodeId>,
    /// Whether a value depends on the slip of a friction in this tick, so that no bound is known of
    /// its error: near where a friction lets go, the least change decides.
    pub behind_friction: IdMap<NodeId, bool>,
}

/// Simplifies a model, whose ranges are given; the ranges of the new one come with it.
///
/// # Errors
/// What the range analysis says of the step of its bodies, or of the Model after algebra.
pub fn simplify(model: &Model, ranges: Ranges) -> Result<(Step, Ranges), Vec<Diagnostic>> {
    let mut model = model.clone();
    let (rates, coordinates) = integrate(&mut model);
    let drives = sums(&mut model);
    let ranges = ranges.extended_to(&model)?;
    let curved = curve::curved(&mut model, &ranges);
    // That the step is bounded is all that is asked of it: the new graph is bounded by itself.
    drop(ranges.extended_to(&model)?);

    let roots = roots(&model, &rates, &coordinates, &drives);
    let mut rewriter = Rewriter::new(&model, roots, curved);
    let rates = rates.iter().map(|&n| rewriter.node(n)).collect();
    let coordinates = coordinates.iter().map(|&n| rewriter.node(n)).collect();
    let drives = drives.iter().map(|&n| rewriter.node(n)).collect();
    let mut out = model.clone();
    out.roots_mut()
        .into_iter()
        .for_each(|root| *root = rewriter.node(*root));
    let slips = std::mem::take(&mut rewriter.slips);
    rewriter.finish_into(&mut out);
    let ranges = range::analyze(&out)?;
    let step = Step {
        rates,
        coordinates,
        drives,
        behind_friction: behind(&out.dag, &slips),
        model: out,
    };
    Ok((step, ranges))
}

/// Which values depend on one of these.
fn behind(dag: &Dag, sources: &[NodeId]) -> IdMap<NodeId, bool> {
    let mut depends = IdMap::filled(false, dag.len());
    for (id, node) in dag.nodes() {
        depends[id] = sources.contains(&id) || node.operands().iter().any(|o| depends[o]);
    }
    depends
}

/// Adds `rate + T * acceleration` and `coordinate + T * new rate` (or the held values) for every
/// body.
fn integrate(model: &mut Model) -> (Vec<NodeId>, Vec<NodeId>) {
    let period_s = 1.0 / f64::from(model.rate_hz);
    let dag = &mut model.dag;
    let t = dag.constant(period_s);
    let zero = dag.constant(0.0);
    let mut out = (Vec::new(), Vec::new());
    for body in &model.bodies {
        let (rate, coordinate) = (
            dag.add(Node::Cell(body.rate)),
            dag.add(Node::Cell(body.coordinate)),
        );
        let change = dag.add(Node::Mul(t, body.acceleration));
        let free = dag.add(Node::Add(rate, change));
        let free = body
            .friction
            .as_ref()
            .map_or(free, |friction| dag.add(Node::Sub(free, friction.taken)));
        let new_rate = body
            .hold
            .map_or(free, |held| dag.add(Node::Select(held, zero, free)));
        let way = dag.add(Node::Mul(t, new_rate));
        out.0.push(new_rate);
        out.1.push(dag.add(Node::Add(coordinate, way)));
    }
    out
}

/// The sum of the force terms on each driven port.
fn sums(model: &mut Model) -> Vec<NodeId> {
    let zero = model.dag.constant(0.0);
    let mut sums = Vec::new();
    for port in model.drives() {
        let terms = model.forces.iter().filter(|force| force.port == port);
        let dag = &mut model.dag;
        sums.push(terms.fold(zero, |sum, term| dag.add(Node::Add(sum, term.value))));
    }
    sums
}

/// What a tick must compute even if nobody watches.
fn roots(
    model: &Model,
    rates: &[NodeId],
    coordinates: &[NodeId],
    drives: &[NodeId],
) -> Vec<NodeId> {
    let mut model = Model {
        named: Vec::new(),
        forces: Vec::new(),
        sounds: Vec::new(),
        bodies: Vec::new(),
        ..model.clone()
    };
    let named = model.roots_mut().into_iter().map(|root| *root);
    [rates, coordinates, drives]
        .concat()
        .into_iter()
        .chain(named)
        .collect()
}

/// The interval of a node that was just made, or everything where it has none.
fn interval_of(model: &Model, node: &Node, of: impl Fn(NodeId) -> Interval) -> Interval {
    range::transfer(model, node, of).unwrap_or(Interval {
        low: f64::NEG_INFINITY,
        high: f64::INFINITY,
    })
}
