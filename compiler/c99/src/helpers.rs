//! Functions that a text brings along where it needs them: name of the operator, text.

use whippen_kernel::{Inst, Kernel, Op};

/// What every text begins with.
pub(super) const PROLOGUE: &str = "\
/* Shifts of negative values to the right must keep the sign. */
typedef char whippen_shifts_keep_the_sign[(-1 >> 1) == -1 ? 1 : -1];
";

const SHL: &str = "\
#ifndef WHIPPEN_SHL
#define WHIPPEN_SHL
static inline int32_t whippen_shl32(int32_t a, int n) { return (int32_t)((uint32_t)a << n); }
static inline int64_t whippen_shl64(int64_t a, int n) { return (int64_t)((uint64_t)a << n); }
#endif
";

const DIV: &str = "\
#ifndef WHIPPEN_DIV
#define WHIPPEN_DIV
/* floor(a / b + 1/2); 0 where b is 0. */
static inline int32_t whippen_div_round(int64_t a, int64_t b)
{
    if (b == 0) return 0;
    int64_t quotient = a / b, rest = a % b;
    if (rest != 0 && (rest < 0) != (b < 0)) { quotient -= 1; rest += b; }
    return (int32_t)(quotient + (2 * (rest < 0 ? -rest : rest) >= (b < 0 ? -b : b)));
}
#endif
";

const SQRT: &str = "\
#ifndef WHIPPEN_SQRT
#define WHIPPEN_SQRT
/* floor(sqrt(a)); 0 where a is negative. */
static inline int32_t whippen_sqrt(int64_t a)
{
    uint64_t rest = a < 0 ? 0 : (uint64_t)a, root = 0, bit = UINT64_C(1) << 62;
    for (; bit != 0; bit >>= 2) {
        uint64_t trial = root + bit;
        root >>= 1;
        if (rest >= trial) { rest -= trial; root += bit; }
    }
    return (int32_t)root;
}
#endif
";

/// The functions that a kernel needs.
pub(super) fn needed(kernel: &Kernel) -> String {
    type Needs = fn(&Inst) -> bool;
    let table: [(&str, Needs); 3] = [
        (SHL, |inst| matches!(inst.op, Op::Shl(_) | Op::DivRound(_))),
        (DIV, |inst| matches!(inst.op, Op::DivRound(_))),
        (SQRT, |inst| inst.op == Op::Sqrt),
    ];
    let used = |such: Needs| kernel.all_insts().any(such);
    table
        .into_iter()
        .filter(|(_, such)| used(*such))
        .map(|(text, _)| text)
        .collect()
}
