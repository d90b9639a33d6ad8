/* Fixed-point signal processing: a Q15 FFT of 128 points, FIR filters in Q15 and Q31, a biquad in Q31. With the DSP extension
   the inner products are SMLAD, SMLALD and SMMLA; without it the same in plain C, so every core must agree. */
#include "foreign.h"
#if defined(__ARM_FEATURE_DSP)
#include <arm_acle.h>
#endif

#define POINTS 128

typedef struct {
    int16_t re, im;
} complex16;

static int16_t wave[POINTS + POINTS / 4]; /* one turn and a quarter of a sine, Q15 */
static complex16 signal[POINTS];
static int16_t samples[POINTS], taps[32], filtered[POINTS];
static int32_t samples31[POINTS], filtered31[POINTS];

static int32_t saturated(int64_t x, int bits)
{
    const int64_t most = (1LL << (bits - 1)) - 1;
    return (int32_t)(x > most ? most : x < -most - 1 ? -most - 1 : x);
}

/* sin((k + 1) h) = 2 cos(h) sin(k h) - sin((k - 1) h) in Q30 */
static void make_wave(void)
{
    const int64_t twice_cos = 2144896910LL; /* 2 cos(2 pi / 128), Q30 */
    int64_t now = 0, before = -52686014LL;  /* sin 0, sin(-2 pi / 128), Q30 */
    for (int i = 0; i < POINTS + POINTS / 4; i++) {
        wave[i] = (int16_t)saturated((now + (1 << 14)) >> 15, 16);
        const int64_t next = ((twice_cos * now) >> 30) - before;
        before = now;
        now = next;
    }
}

static int32_t dot16(const int16_t *a, const int16_t *b, int count)
{
    int32_t sum = 0;
#if defined(__ARM_FEATURE_DSP)
    for (int i = 0; i < count; i += 2) {
        int16x2_t x, y;
        __builtin_memcpy(&x, a + i, 4);
        __builtin_memcpy(&y, b + i, 4);
        sum = __smlad(x, y, sum);
    }
#else
    for (int i = 0; i < count; i++)
        sum = (int32_t)((uint32_t)sum + (uint32_t)(a[i] * b[i]));
#endif
    return sum;
}

static complex16 turned(complex16 x, int16_t c, int16_t s)
{
    const int32_t re = x.re * c + x.im * s, im = x.im * c - x.re * s;
    return (complex16){(int16_t)(re >> 16), (int16_t)(im >> 16)};
}

static void fft(complex16 *x)
{
    for (int i = 1, j = 0; i < POINTS; i++) {
        int bit = POINTS / 2;
        for (; j & bit; bit >>= 1)
            j ^= bit;
        j |= bit;
        if (i < j) {
            const complex16 t = x[i];
            x[i] = x[j];
            x[j] = t;
        }
    }
    for (int half = 1; half < POINTS; half *= 2)
        for (int i = 0; i < POINTS; i += 2 * half)
            for (int k = 0; k < half; k++) {
                const int turn = k * (POINTS / 2 / half);
                const complex16 t = turned(x[i + k + half], wave[turn + POINTS / 4], wave[turn]);
                const complex16 u = {(int16_t)(x[i + k].re >> 1), (int16_t)(x[i + k].im >> 1)};
                x[i + k] = (complex16){(int16_t)(u.re + t.re), (int16_t)(u.im + t.im)};
                x[i + k + half] = (complex16){(int16_t)(u.re - t.re), (int16_t)(u.im - t.im)};
            }
}

static void fir15(void)
{
    for (int n = 0; n + 32 <= POINTS; n++)
        filtered[n] = (int16_t)saturated(((int64_t)dot16(samples + n, taps, 32) + (1 << 14)) >> 15, 16);
}

static void fir31(void)
{
    for (int n = 0; n + 16 <= POINTS; n++) {
        int64_t sum = 0;
        for (int k = 0; k < 16; k++)
            sum += (int64_t)samples31[n + k] * (taps[k] * 65536);
        filtered31[n] = saturated((sum + (1LL << 30)) >> 31, 32);
    }
}

/* Direct form I, poles at 0.9 of the unit circle; coefficients in Q30. */
static void biquad31(void)
{
    const int32_t b0 = 34867844, b1 = 69735688, a1 = 1623457988, a2 = -698101286;
    int32_t x1 = 0, x2 = 0, y1 = 0, y2 = 0;
    for (int n = 0; n < POINTS; n++) {
        const int32_t x = samples31[n] >> 3;
        int64_t sum = (int64_t)b0 * x + (int64_t)b1 * x1 + (int64_t)b0 * x2;
        sum += (int64_t)a1 * y1 + (int64_t)a2 * y2;
        x2 = x1;
        x1 = x;
        y2 = y1;
        y1 = saturated((sum + (1LL << 29)) >> 30, 32);
        filtered31[n] = y1;
    }
}

int main(void)
{
    make_wave();
    say("wave", crc32(0, wave, sizeof wave));
    for (int i = 0; i < POINTS; i++) {
        const int32_t noise = (int16_t)random_word() >> 4;
        samples[i] = (int16_t)((wave[i * 5 % POINTS] >> 2) + (wave[i * 21 % POINTS] >> 3) + noise);
        samples31[i] = (int32_t)random_word();
        signal[i] = (complex16){samples[i], 0};
    }
    for (int i = 0; i < 32; i++)
        taps[i] = (int16_t)((int16_t)random_word() >> 2);
    fft(signal);
    int peak = 0, peak_power = 0;
    for (int i = 1; i < POINTS / 2; i++) {
        const int power = signal[i].re * signal[i].re + signal[i].im * signal[i].im;
        if (power > peak_power)
            peak = i, peak_power = power;
    }
    say("fft", crc32(0, signal, sizeof signal));
    say("peak", (uint32_t)peak);
    fir15();
    say("fir15", crc32(0, filtered, sizeof filtered));
    fir31();
    say("fir31", crc32(0, filtered31, sizeof filtered31));
    biquad31();
    say("biquad31", crc32(0, filtered31, sizeof filtered31));
    return peak != 5;
}
