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
/* Bits above the highest one of a; 32 where there is none. */
static inline int whippen_clz(uint32_t a)
{
#ifdef __GNUC__
    return a == 0 ? 32 : __builtin_clz(a);
#else
    int zeros = 32;
    for (int step = 16; step > 0; step >>= 1) if (a >> step) { zeros -= step; a >>= step; }
    return zeros - (a != 0);
#endif
}
/* About a * 2^n / b with 14 significant bits or more, held to 30 bits; 0 where b is not positive. */
static inline int32_t whippen_quot(int32_t a, int32_t b, int n)
{
    if (b <= 0 || a == 0) return 0;
    int up = whippen_clz((uint32_t)a ^ (uint32_t)a << 1), up_divisor = whippen_clz((uint32_t)b);
    int32_t x = (int32_t)((uint32_t)a << up), y = (int32_t)((uint32_t)b << up_divisor >> 16);
    int32_t top = (int32_t)((uint32_t)(x / y) << 15);
    int down = up - up_divisor + 31 - n;
    top >>= down < 0 ? 0 : down > 31 ? 31 : down;
    return top < -0x20000000 ? -0x20000000 : top > 0x1fffffff ? 0x1fffffff : top;
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

const SAT: &str = "\
#ifndef WHIPPEN_SAT
#define WHIPPEN_SAT
/* The word nearest to a. */
static inline int32_t whippen_sat(int64_t a)
{
    return a < INT32_MIN ? INT32_MIN : a > INT32_MAX ? INT32_MAX : (int32_t)a;
}
#endif
";

const WAVE: &str = "\
#ifndef WHIPPEN_WAVE
#define WHIPPEN_WAVE
static inline uint32_t whippen_top(int32_t k, int32_t x)
{
    return (uint32_t)(((int64_t)k * x + 0x80000000) >> 32);
}

/* One tick of a string of n points, whose words are so many apart: slopes e, bends w, rates v; what a point does to its neighbours is p. */
static inline void whippen_wave(int32_t *e, int32_t *v, int step, int n, int32_t k0, int32_t k1, int32_t k2, int32_t k3, int left, int right)
{
    int32_t e0 = e[0], e1 = e[step], v0 = v[0], before = 0;
    int32_t w = whippen_sat((int64_t)e1 - e0);
    uint32_t pb = whippen_top(k1, whippen_sat((int64_t)left * e0));
    uint32_t p = whippen_top(k1, w) + whippen_top(k2, v0);
    for (int l = 0; l < n; l++, e += step, v += step) {
        int more = l + 1 < n;
        int32_t e2 = more ? e[2 * step] : 0, va = more ? v[step] : 0;
        int32_t wa = whippen_sat(more ? (int64_t)e2 - e1 : (int64_t)right * whippen_sat(-(int64_t)e1));
        uint32_t pa = whippen_top(k1, wa) + whippen_top(k2, va);
        int32_t q = (int32_t)(pb + whippen_top(k0, w) + whippen_top(k3, v0));
        int32_t now = whippen_sat((int64_t)v0 + whippen_sat((int64_t)q + (int32_t)pa));
        *v = now;
        *e = (int32_t)((uint32_t)e0 + 2 * ((uint32_t)now - (uint32_t)before));
        e0 = e1; e1 = e2; w = wa; v0 = va; pb = p; p = pa; before = now;
    }
    *e = (int32_t)((uint32_t)e0 - 2 * (uint32_t)before);
}
#endif
";

/// The functions that a text calls.
pub(super) fn needed(text: &str) -> String {
    let table = [
        (SHL32, &["whippen_shl32("][..]),
        (SHL64, &["whippen_shl64("]),
        (DIV, &["whippen_div_round("]),
        (QUOT, &["whippen_quot("]),
        (SQRT, &["whippen_sqrt("]),
        (SAT, &["whippen_sat(", "whippen_wave("]),
        (WAVE, &["whippen_wave("]),
    ];
    let is_called = |calls: &[&str]| calls.iter().any(|call| text.contains(call));
    let called = table.into_iter().filter(|(_, calls)| is_called(calls));
    called.map(|(helper, _)| helper).collect()
}
