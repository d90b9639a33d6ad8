//! Cost model: rough cycles of a Cortex-M33 for each operator, to compare one way of making code
//! with another.
//!
//! The exact count is made of final bytes. Here small constants are free, as is what instructions
//! do besides (a product's upper word, an accumulator), and results are assumed to be there in
//! time.

use super::graph::{Graph, Kind, NodeId};
use whippen_kernel::{Inst, Op, Type, Value};

/// Cycles of a decision: compare, branch.
pub const BRANCH: u32 = 2;

/// Constants up to this are part of instructions; others are loaded.
const IMMEDIATE: u64 = 4095;

/// Cycles of an operator whose operands have this type.
pub fn of(op: Op, ty: Type) -> u32 {
    let wide = u32::from(ty == Type::I64);
    match op {
        Op::Const(_) | Op::Assume(..) | Op::Narrow | Op::Shl(0) => 0,
        // The upper word of an accumulator is a register.
        Op::Sar(n) | Op::SarRound(n) if wide == 1 => 1 + u32::from(n != 32),
        Op::Add | Op::Sub | Op::Shl(_) | Op::Sar(_) => 1 + wide,
        Op::Mul => 1 + 2 * wide,
        Op::MulWide
        | Op::MacWide
        | Op::MulTop
        | Op::MacTop
        | Op::Widen
        | Op::Eq
        | Op::Lt
        | Op::Le
        | Op::And
        | Op::Or
        | Op::Not => 1,
        Op::Min | Op::Max => 2 + 2 * wide,
        Op::SarRound(_) => 2,
        Op::Select => 2 + wide,
        Op::DivRound(_) => 40,
        Op::Sqrt => 100,
        Op::In(_)
        | Op::Live(_)
        | Op::Tick(_)
        | Op::Keyed(_)
        | Op::Get(_)
        | Op::Set(_)
        | Op::Delay(..) => 1 + wide,
        Op::Out(_) | Op::Push(_) | Op::Fill(_) => 1,
        Op::GetAt(_) | Op::SetAt(_) | Op::Lookup(_) => 2 + wide,
        Op::Emit(_) => 6,
        Op::Probe(_) | Op::If | Op::Loop(_) => 4,
    }
}

/// Cycles of a new node: [`Graph::cycles`] keeps them.
pub(super) fn of_node(graph: &Graph, id: NodeId) -> u32 {
    match graph.kind(id) {
        Kind::Start | Kind::Result(_) => 0,
        Kind::Op(Op::Const(k)) => u32::from(k.unsigned_abs() > IMMEDIATE),
        Kind::Op(op) => {
            let ty = graph
                .args(id)
                .last()
                .map_or(graph.ty(id), |arg| graph.ty(*arg));
            of(op, ty)
        }
        Kind::Effect(source) => {
            let guarded = graph.constant(graph.args(id)[0]).is_none();
            let inst = &graph.sources[source as usize].inst;
            of_inst(inst, |value| graph.kernel.values[value].ty) + if guarded { BRANCH } else { 0 }
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
    let own = of(
        inst.op,
        inst.args
            .last()
            .or(inst.results.first())
            .map_or(Type::I32, |value| ty(*value)),
    );
    own.saturating_add(inner.saturating_mul(rounds))
}
