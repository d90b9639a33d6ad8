//! Cost model: rough cycles of nodes and instructions, to compare one way of making code with
//! another.
//!
//! Cycles of operators stand in the target's table. Here small constants are free; a decision
//! around an effect and the rounds of a loop are counted. The exact count is made of final bytes.

use super::graph::{Graph, Kind, NodeId};
use whippen_kernel::{Inst, Op, Type, Value};
use whippen_target_info::{BRANCH_CYCLES, IMMEDIATE_MAX, row};

/// Cycles of an operator whose operands have this type.
fn of_op(op: Op, ty: Type) -> u32 {
    row(op).cycles[usize::from(ty == Type::I64)]
}

/// Cycles of a new node: [`Graph::cycles`] keeps them.
pub(super) fn of_node(graph: &Graph, id: NodeId) -> u32 {
    match graph.kind(id) {
        Kind::Start | Kind::Result(_) => 0,
        Kind::Op(Op::Const(k)) => u32::from(k.unsigned_abs() > IMMEDIATE_MAX),
        Kind::Op(op) => {
            let ty = graph
                .args(id)
                .last()
                .map_or(graph.ty(id), |arg| graph.ty(*arg));
            of_op(op, ty)
        }
        Kind::Effect(source) => {
            let guarded = graph.constant(graph.args(id)[0]).is_none();
            let inst = &graph.sources[source as usize].inst;
            let cycles = of_inst(inst, |value| graph.kernel.values[value].ty);
            cycles + if guarded { BRANCH_CYCLES } else { 0 }
        }
    }
}

/// Cycles of an instruction with all inside, given the types of values.
pub(super) fn of_inst(inst: &Inst, ty: impl Fn(Value) -> Type + Copy) -> u32 {
    let inner = inst
        .regions
        .iter()
        .flat_map(|region| &region.insts)
        .map(|inst| of_inst(inst, ty));
    let inner = inner.fold(0_u32, u32::saturating_add);
    let rounds = if let Op::Loop(rounds) = inst.op {
        rounds
    } else {
        1
    };
    let own = of_op(
        inst.op,
        inst.args
            .last()
            .or(inst.results.first())
            .map_or(Type::I32, |value| ty(*value)),
    );
    own.saturating_add(inner.saturating_mul(rounds))
}
