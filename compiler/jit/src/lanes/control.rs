//! Control flow in lanes: if-conversion where both arms are cheap, else branches around arms that
//! no lane takes.
//!
//! ```text
//!   if c { then } else { other }      both cheap:   then, other, each lane takes its own
//!
//!                                     otherwise:    [any lane not c?] -> other --.
//!                                                   [any lane c?] -> then, each lane takes its own
//! ```

use super::arithmetic::as_lane;
use super::{Lane, Lanes};
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::types::{I32X4, I64, I64X2};
use cranelift_codegen::ir::{Block, BlockArg, InstBuilder, Value};
use whippen_kernel::{Effect, Inst, Op, Region, Type, Value as KernelValue, Walk};

/// What an arm may cost, in vector instructions, to be computed for all lanes without asking.
pub(crate) const CHEAP: u32 = 12;

impl Walk for Lanes<'_> {
    fn if_else(&mut self, inst: &Inst, then: &Region, other: &Region) {
        let condition = self.mask(inst.args[0]);
        let types: Vec<Type> = inst
            .results
            .iter()
            .map(|result| self.t.ty(*result))
            .collect();
        let not = self.ins().bnot(condition);
        let others = self.arm(other, not, &types, None);
        let both = self.arm(then, condition, &types, Some(&others));
        for (result, lane) in inst.results.iter().zip(both) {
            self.set_lane(*result, lane);
        }
    }

    fn repeat(&mut self, inst: &Inst, rounds: u32, body: &Region) {
        let types: Vec<Type> = inst
            .results
            .iter()
            .map(|result| self.t.ty(*result))
            .collect();
        let [head, after] = [(); 2].map(|()| self.t.f.create_block());
        let results: Vec<Lane> = types.iter().map(|ty| self.param(after, *ty)).collect();
        let zero = self.ins().iconst(I64, 0);
        let lanes: Vec<Lane> = inst.args.iter().map(|arg| self.lane(*arg)).collect();
        let starts = self.block_args(&types, &lanes);
        let first = self.constant(I32X4, 0);
        self.ins()
            .jump(head, &[&[zero.into(), first.into()], &starts[..]].concat());
        let round = self.t.f.append_block_param(head, I64);
        let index = self.t.f.append_block_param(head, I32X4);
        self.set_lane(body.params[0], Lane::Word(index));
        for (param, ty) in body.params[1..].iter().zip(&types) {
            let lane = self.param(head, *ty);
            self.set_lane(*param, lane);
        }
        self.t.f.switch_to_block(head);
        self.region(body);
        let next = self.ins().iadd_imm_s(round, 1);
        let one = self.splat(1);
        let index = self.ins().iadd(index, one);
        let lanes: Vec<Lane> = body.yields.iter().map(|value| self.lane(*value)).collect();
        let yields = self.block_args(&types, &lanes);
        let more = self
            .ins()
            .icmp_imm_s(IntCC::SignedLessThan, next, i64::from(rounds));
        let again = [&[next.into(), index.into()], &yields[..]].concat();
        self.ins().brif(more, head, &again, after, &yields);
        self.t.f.switch_to_block(after);
        for (result, lane) in inst.results.iter().zip(results) {
            self.set_lane(*result, lane);
        }
    }

    fn plain(&mut self, inst: &Inst) {
        self.operator(inst);
    }
}

impl Lanes<'_> {
    /// Computes an arm for the lanes that want it; the others keep what they have, if they have
    /// anything yet.
    fn arm(
        &mut self,
        region: &Region,
        condition: Value,
        types: &[Type],
        before: Option<&[Lane]>,
    ) -> Vec<Lane> {
        let wanted = self.wanted(condition);
        if cost(region) <= CHEAP {
            return self.taken(region, wanted, before);
        }
        let [inside, after] = [(); 2].map(|()| self.t.f.create_block());
        let nothing: Vec<Lane> = types.iter().map(|ty| Lane::Known(*ty, 0)).collect();
        let skipped = self.block_args(types, before.unwrap_or(&nothing));
        let any = self.ins().vany_true(wanted);
        self.ins().brif(any, inside, &[], after, &skipped);
        self.t.f.switch_to_block(inside);
        if region
            .insts
            .iter()
            .any(|inst| matches!(inst.op, Op::Emit(_)))
        {
            self.t.f.set_cold_block(inside);
        }
        let taken = self.taken(region, wanted, before);
        let taken = self.block_args(types, &taken);
        self.ins().jump(after, &taken);
        let results = types.iter().map(|ty| self.param(after, *ty)).collect();
        self.t.f.switch_to_block(after);
        results
    }

    /// Computes an arm and gives each lane its own results.
    fn taken(&mut self, region: &Region, wanted: Value, before: Option<&[Lane]>) -> Vec<Lane> {
        let outer = self.mask.replace(wanted);
        self.region(region);
        self.mask = outer;
        match before {
            None => region
                .yields
                .iter()
                .map(|value| self.lane(*value))
                .collect(),
            Some(all) => {
                let yields = region.yields.iter().zip(all);
                yields
                    .map(|(value, before)| self.blended(wanted, *value, *before))
                    .collect()
            }
        }
    }

    /// The lanes that want an arm, among those that want what is around it.
    fn wanted(&mut self, condition: Value) -> Value {
        match self.mask {
            Some(outer) => self.ins().band(condition, outer),
            None => condition,
        }
    }

    fn blended(&mut self, wanted: Value, value: KernelValue, before: Lane) -> Lane {
        let before = self.vectors(before);
        match self.t.ty(value) {
            Type::I64 => {
                let value = self.wide(value);
                Lane::Wide(self.chosen_wide(wanted, value, before))
            }
            ty => {
                let vector = self.word_or_mask(value);
                as_lane(ty, self.ins().bitselect(wanted, vector, before[0]))
            }
        }
    }

    fn block_args(&mut self, types: &[Type], lanes: &[Lane]) -> Vec<BlockArg> {
        let mut args = Vec::new();
        for (ty, lane) in types.iter().zip(lanes) {
            match (ty, self.vectors(*lane)) {
                (Type::I64, pair) => args.extend(pair.map(BlockArg::Value)),
                (_, [vector, _]) => args.push(BlockArg::Value(vector)),
            }
        }
        args
    }

    /// The vectors of a lane: two for 64 bits, else the first counts.
    fn vectors(&mut self, lane: Lane) -> [Value; 2] {
        match lane {
            Lane::Known(Type::I64, number) => [self.splat_wide(number); 2],
            Lane::Known(Type::I32, number) => [self.splat(number); 2],
            Lane::Known(Type::I1, bit) => [self.splat(-bit); 2],
            Lane::Mask(vector) | Lane::Word(vector) => [vector; 2],
            Lane::Wide(pair) => pair,
            Lane::Shifted(n, pair) => pair.map(|half| self.ins().sshr_imm_s(half, i64::from(n))),
        }
    }

    fn param(&mut self, block: Block, ty: Type) -> Lane {
        let mut param = |ty| self.t.f.append_block_param(block, ty);
        match ty {
            Type::I1 => Lane::Mask(param(I32X4)),
            Type::I32 => Lane::Word(param(I32X4)),
            Type::I64 => Lane::Wide([param(I64X2), param(I64X2)]),
        }
    }
}

/// What a region costs in vector instructions, about; very much if it has an effect or a branch.
pub(crate) fn cost(region: &Region) -> u32 {
    let one = |inst: &Inst| match (inst.op.row().effect, inst.op) {
        (_, Op::DivRound(_) | Op::Quot(_) | Op::Sqrt) => 1000,
        (_, Op::Lookup(..) | Op::GetAt(_) | Op::DelayAt(_)) => 1000,
        (_, Op::MulWide | Op::MacWide) => 8,
        (_, Op::MulTop | Op::MacTop) => 6,
        (effect, _) if effect.is_pure() || effect == Effect::Reads => 1,
        _ => 1000,
    };
    region.insts.iter().map(one).sum()
}
