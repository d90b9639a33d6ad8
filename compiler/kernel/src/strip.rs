//! Dead code elimination, also of probes.

use super::{Effect, Inst, Kernel, Op, Region, Value};
use whippen_ids::IdMap;

/// The same kernel without probes and without what only they needed. Nothing else changes.
pub fn without_probes(kernel: &Kernel) -> Kernel {
    let mut kernel = Kernel {
        probes: Vec::new(),
        ..kernel.clone()
    };
    drop_probes(&mut kernel.init);
    drop_probes(&mut kernel.tick);
    sweep(&mut kernel);
    kernel
}

/// Removes instructions without effect whose results nobody uses, and unused results of `if`.
pub fn sweep(kernel: &mut Kernel) {
    let mut needed = IdMap::filled(false, kernel.values.len());
    sweep_insts(&mut kernel.init.insts, &mut needed);
    sweep_insts(&mut kernel.tick.insts, &mut needed);
}

fn drop_probes(region: &mut Region) {
    region.insts.retain(|inst| !matches!(inst.op, Op::Probe(_)));
    region
        .insts
        .iter_mut()
        .flat_map(|inst| &mut inst.regions)
        .for_each(drop_probes);
}

/// Leaves out what nobody needs, from the bottom up; what is needed behind these instructions must
/// be marked already.
pub fn sweep_insts(insts: &mut Vec<Inst>, needed: &mut IdMap<Value, bool>) {
    let mut kept: Vec<Inst> = Vec::new();
    for mut inst in std::mem::take(insts).into_iter().rev() {
        if inst.op == Op::If {
            drop_results(&mut inst, needed);
        }
        if has_effect(&inst) || inst.results.iter().any(|result| needed[result]) {
            mark(&inst.args, needed);
            for inner in &mut inst.regions {
                mark(&inner.yields, needed);
                sweep_insts(&mut inner.insts, needed);
            }
            kept.push(inst);
        }
    }
    kept.reverse();
    *insts = kept;
}

/// Removes the results of an `if` that nobody uses.
fn drop_results(inst: &mut Inst, needed: &IdMap<Value, bool>) {
    let wanted: Vec<bool> = inst.results.iter().map(|result| needed[result]).collect();
    let keep = |values: &mut Vec<Value>| {
        let mut wanted = wanted.iter().copied();
        values.retain(|_| wanted.next().unwrap_or(true));
    };
    keep(&mut inst.results);
    inst.regions
        .iter_mut()
        .for_each(|region| keep(&mut region.yields));
}

fn mark(values: &[Value], needed: &mut IdMap<Value, bool>) {
    values.iter().for_each(|value| needed[value] = true);
}

/// Whether an instruction, or one inside it, does something besides giving results.
fn has_effect(inst: &Inst) -> bool {
    inst.all_insts().any(|inst| {
        let effect = inst.op.row().effect;
        !effect.is_pure() && !matches!(effect, Effect::Reads | Effect::Control)
    })
}
