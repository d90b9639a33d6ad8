//! Functions that a text brings along where it calls them.

/// What every text begins with.
pub(super) const PROLOGUE: &str = "\
/* Shifts of negative values to the right must keep the sign. */
#ifndef WHIPPEN_SHIFTS
#define WHIPPEN_SHIFTS
typedef char whippen_shifts_keep_the_sign[(-1 >> 1) == -1 ? 1 : -1];
#endif
";

const SHL32: &str = "\
#ifndef WHIPPEN_SHL32
#define WHIPPEN_SHL32
static inline int32_t whippen_shl32(int32_t a, int n) { return (int32_t)((uint32_t)a << n); }
#endif
";

const SHL64: &str = "\
#ifndef WHIPPEN_SHL64
#define WHIPPEN_SHL64
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

const QUOT: &str = "\
#ifndef WHIPPEN_QUOT
#define WHIPPEN_QUOT
/* The 16 highest bits of a, which has 63 at most. */
static inline uint64_t whippen_keep16(uint64_t a)
{
    int below = 0;
    for (int step = 32; step > 0; step >>= 1) if (a >> (below + step + 15)) below += step;
    return a >> below << below;
}
/* a * 2^n / b towards zero with 16 significant bits, saturated; 0 where b is not positive. */
static inline int32_t whippen_quot(int32_t a, int32_t b, int n)
{
    if (b <= 0) return 0;
    uint64_t size = (a < 0 ? -(uint64_t)a : (uint64_t)a) << n;
    size = whippen_keep16(size / whippen_keep16((uint64_t)b));
    if (size > INT32_MAX) size = INT32_MAX;
    return a < 0 ? -(int32_t)size : (int32_t)size;
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

/// The functions that a text calls.
pub(super) fn needed(text: &str) -> String {
    let table = [
        (SHL32, "whippen_shl32("),
        (SHL64, "whippen_shl64("),
        (DIV, "whippen_div_round("),
        (QUOT, "whippen_quot("),
        (SQRT, "whippen_sqrt("),
    ];
    let called = table.into_iter().filter(|(_, call)| text.contains(call));
    called.map(|(helper, _)| helper).collect()
}
