//! Dead code elimination, also of probes, and of data that no code names.

use std::collections::BTreeSet;

use super::op::Immediate;
use super::{Effect, Inst, Kernel, Op, Region, Value};
use whippen_ids::IdMap;

/// The same kernel without probes and without what only they needed. Nothing else changes.
pub fn without_probes(kernel: &Kernel) -> Kernel {
    let mut kernel = without_instructions_of_probes(kernel);
    sweep(&mut kernel);
    kernel
}

/// The same kernel without probes and without instructions that only they needed. All tables and
/// constants of each key stay, so that it works on the memory of the kernel with probes.
pub fn without_probes_in_same_memory(kernel: &Kernel) -> Kernel {
    let mut kernel = without_instructions_of_probes(kernel);
    sweep_all_insts(&mut kernel);
    kernel
}

fn without_instructions_of_probes(kernel: &Kernel) -> Kernel {
    let mut kernel = Kernel {
        probes: Vec::new(),
        ..kernel.clone()
    };
    drop_probes(&mut kernel.init);
    drop_probes(&mut kernel.tick);
    kernel
}

fn sweep_all_insts(kernel: &mut Kernel) {
    let mut needed = IdMap::filled(false, kernel.values.len());
    sweep_insts(&mut kernel.init.insts, &mut needed);
    sweep_insts(&mut kernel.tick.insts, &mut needed);
}

/// Removes instructions without effect whose results nobody uses, unused results of `if`, and the
/// tables and constants of each key that are then named by none.
pub fn sweep(kernel: &mut Kernel) {
    sweep_all_insts(kernel);
    let tables = std::mem::take(&mut kernel.tables);
    kernel.tables = named(kernel, Immediate::Table, tables);
    let keyed = std::mem::take(&mut kernel.keyed);
    kernel.keyed = named(kernel, Immediate::Keyed, keyed);
}

/// Those of the declarations of a kind that instructions name, by their new numbers.
fn named<T>(kernel: &mut Kernel, kind: Immediate, all: Vec<T>) -> Vec<T> {
    let mut numbers = BTreeSet::new();
    let regions = [&mut kernel.init, &mut kernel.tick];
    for region in regions {
        each_number(&mut region.insts, kind, &mut |number| {
            numbers.insert(number);
            number
        });
    }
    if numbers.len() == all.len() {
        return all;
    }
    let numbers: Vec<i64> = numbers.into_iter().collect();
    for region in [&mut kernel.init, &mut kernel.tick] {
        each_number(&mut region.insts, kind, &mut |number| {
            numbers.partition_point(|&own| own < number) as i64
        });
    }
    let is_named = |number: usize| numbers.binary_search(&(number as i64)).is_ok();
    let kept = all.into_iter().enumerate();
    kept.filter(|(number, _)| is_named(*number))
        .map(|(_, own)| own)
        .collect()
}

/// Changes the numbers by which instructions name what is declared of a kind.
fn each_number(insts: &mut [Inst], kind: Immediate, change: &mut impl FnMut(i64) -> i64) {
    for inst in insts {
        let row = inst.op.row();
        if row.immediates.contains(&kind) {
            let immediates = row.immediates.iter().zip(inst.op.immediates());
            let changed: Vec<i64> = immediates
                .map(|(own, number)| if *own == kind { change(number) } else { number })
                .collect();
            inst.op = (row.make)(&changed).unwrap_or(inst.op);
        }
        for region in &mut inst.regions {
            each_number(&mut region.insts, kind, change);
        }
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parse;

    #[test]
    fn data_that_nothing_names_goes() {
        let text = "kernel k @44100 {
            table first = { 1, 2 }
            table second = { 3, 4 }
            table third = { 5, 6 }
            keyed unused: i32 [0..9] = { 1 }
            keyed used: i32 [0..1] = { 1 }
            out drive: i16 [-32768..32767]
            tick {
                v0: i32 [0..1] = keyed used
                v1: i32 [1..2] = lookup first v0 0
                v2: i32 [3..4] = lookup second v0 0
                out drive v2
            }
        }";
        let mut kernel = parse(text).expect("a kernel");
        sweep(&mut kernel);
        let tables: Vec<&str> = kernel.tables.iter().map(|own| own.name.as_str()).collect();
        let keyed: Vec<&str> = kernel.keyed.iter().map(|own| own.name.as_str()).collect();
        assert_eq!((tables, keyed), (vec!["second"], vec!["used"]));
        let text = kernel.to_string();
        assert!(
            text.contains("= keyed used") && text.contains("= lookup second"),
            "{text}"
        );
    }
}
