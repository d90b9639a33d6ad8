//! Interval analysis that trusts no `assume`: where a value lies whatever was promised of others.
//!
//! Code must not read or write beyond a cell or a table even where a promise is wrong. An index
//! whose interval is proven without any is used as it is; others are held inside. Memory may hold
//! what came of a promise, so what is read there may be anything. So may be what is made of a value
//! that is not where it was declared to be: selection counts on declared intervals.

use whippen_ids::IdMap;
use whippen_kernel::op::Meaning;
use whippen_kernel::{Inst, Kernel, Op, Range, Value, ValueInfo, all_insts};

/// The interval of each value of these instructions. Live values behind the kernel's own lie where
/// `shared` says.
pub(super) fn intervals(
    kernel: &Kernel,
    values: &IdMap<Value, ValueInfo>,
    insts: &[&[Inst]],
    shared: &[Range],
) -> IdMap<Value, Range> {
    if !kernel.assumes() {
        return values.enumerated().map(|(_, info)| info.range).collect();
    }
    let anything = values.enumerated().map(|(_, info)| info.ty.range());
    let mut proven: IdMap<Value, Range> = anything.collect();
    for inst in insts.iter().flat_map(|insts| all_insts(insts)) {
        if let [result] = inst.results[..] {
            proven[result] = interval(kernel, values, inst, &proven, shared)
                .unwrap_or(values[result].ty.range());
        }
    }
    proven
}

fn interval(
    kernel: &Kernel,
    values: &IdMap<Value, ValueInfo>,
    inst: &Inst,
    proven: &IdMap<Value, Range>,
    shared: &[Range],
) -> Option<Range> {
    let computes = matches!(inst.op.row().meaning, Meaning::Exact(_));
    match inst.op {
        Op::Const(k) => return Some(Range::point(k)),
        Op::Assume(..) => return Some(proven[inst.args[0]]),
        Op::Live(live) if live as usize >= kernel.lives.len() => {
            return shared.get(live as usize - kernel.lives.len()).copied();
        }
        // What comes in is held to its range where it is read or set.
        Op::In(_) | Op::Live(_) | Op::Keyed(_) => {}
        _ if computes && inst.regions.is_empty() => {}
        _ => return None,
    }
    let known = |arg: &Value| {
        let range = proven[arg];
        let declared = values[arg].range.contains(range);
        declared.then_some(ValueInfo {
            range,
            ..values[arg]
        })
    };
    let args: Vec<ValueInfo> = inst.args.iter().map(known).collect::<Option<_>>()?;
    let found = inst.op.apply(kernel, &args).ok().flatten();
    found.map(|info| info.range)
}
