/* Arithmetic that the compiler leaves to its library: 64-bit division, doubles, and floats where there is no FPU. Printed as
   bits, so that a rounding in the wrong direction shows. */
#include "foreign.h"
#include <string.h>

static uint64_t random_long(void)
{
    const uint64_t high = (uint64_t)random_word() << 32;
    return (high | random_word()) >> (random_word() & 63);
}

static uint32_t sum(uint32_t crc, uint64_t value) { return crc32(crc, &value, sizeof value); }

static void integers(void)
{
    uint32_t crc = 0, small = 0;
    for (int i = 0; i < 300; i++) {
        const uint64_t a = random_long(), b = random_long() | 1;
        crc = sum(crc, a / b);
        crc = sum(crc, a % b);
        crc = sum(crc, (uint64_t)((int64_t)(a << 1) / (int64_t)-(b >> 1 | 1)));
        crc = sum(crc, (uint64_t)((int64_t)~a % (int64_t)b));
        crc = sum(crc, a * b ^ (a << (b & 63)) ^ (uint64_t)((int64_t)~b >> (a & 63)));
        const int32_t n = (int32_t)a, d = (int32_t)b;
        small = sum(small, (uint32_t)(n / (d | 2)) ^ (uint32_t)a / (uint32_t)b);
        small = sum(small, (uint32_t)(__builtin_clz((uint32_t)b) + __builtin_popcount((uint32_t)a)));
        small = sum(small, __builtin_bswap32((uint32_t)a) ^ __builtin_bswap16((uint16_t)b));
    }
    say("long", crc);
    say("small", small);
}

/* A random double or float with an exponent near enough to others that sums are not trivial. */
static double random_double(void)
{
    const uint64_t bits = (uint64_t)(random_word() & 0x800fffff) << 32 | random_word() | (1003ull + random_word() % 40) << 52;
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static float random_float(void)
{
    const uint32_t bits = (random_word() & 0x807fffff) | (112 + random_word() % 30) << 23;
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static uint32_t sum_double(uint32_t crc, double value)
{
    /* The sign and payload of a NaN are nobody's promise. */
    return value != value ? sum(crc, 0x7ff8) : crc32(crc, &value, sizeof value);
}

static uint32_t sum_float(uint32_t crc, float value)
{
    return value != value ? sum(crc, 0x7fc0) : crc32(crc, &value, sizeof value);
}

static void doubles(void)
{
    uint32_t crc = 0;
    for (int i = 0; i < 200; i++) {
        const double a = random_double(), b = random_double();
        crc = sum_double(crc, a + b);
        crc = sum_double(crc, a - b);
        crc = sum_double(crc, a * b);
        crc = sum_double(crc, a / b);
        crc = sum(crc, (uint64_t)(int32_t)(a * 1000.0) ^ (a < b) ^ (uint64_t)(a >= b) << 1);
        crc = sum_float(crc, (float)a);
    }
    say("double", crc);
}

/* The FPU's square root, or Newton's; the last bit may differ. */
static float root(float x)
{
#if defined(__ARM_FP) && !defined(__SOFTFP__)
    __asm__("vsqrt.f32 %0, %0" : "+t"(x));
    return x;
#else
    float guess = x;
    for (int i = 0; i < 12; i++)
        guess = (guess + x / guess) * 0.5f;
    return guess;
#endif
}

static void floats(void)
{
    static volatile float zero = 0.0f, tiny = 1.0e-38f, huge = 3.0e38f;
    uint32_t crc = 0;
    for (int i = 0; i < 300; i++) {
        const float a = random_float(), b = random_float(), c = random_float();
        crc = sum_float(crc, a + b);
        crc = sum_float(crc, a - b);
        crc = sum_float(crc, a * b);
        crc = sum_float(crc, a / b);
        crc = sum_float(crc, root(a < 0 ? -a : a));
        crc = sum_float(crc, a * b + c);
        crc = sum(crc, (uint32_t)(int32_t)(a * 977.0f) ^ (uint32_t)(b < 0 ? -b : b) ^ (a < c) ^ (uint32_t)(a == b) << 1);
        crc = sum_float(crc, (float)(int32_t)random_word() - (float)random_word());
    }
    say("float", crc);
    crc = sum_float(0, tiny * 0.01f); /* a subnormal */
    crc = sum_float(crc, tiny * tiny);
    crc = sum_float(crc, huge * 10.0f);
    crc = sum_float(crc, -huge - huge);
    crc = sum_float(crc, zero / zero);
    crc = sum_float(crc, 1.0f / -zero);
    crc = sum(crc, (zero / zero < 1.0f) + 2 * (zero / zero != zero / zero));
    crc = sum(crc, (uint32_t)(int32_t)(huge * 1.0f > 0 ? 7.9f : 0.0f));
    say("edges", crc);
}

int main(void)
{
    integers();
    doubles();
    floats();
    return 0;
}
