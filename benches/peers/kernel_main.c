/* Times the generated C of a kernel on words from a file: `PROGRAM words.bin`, rows of one word a key.
   Prints nanoseconds per key and tick, and what was computed, to be compared. Every stretch of STRETCH ticks is played in
   every round and its fastest time counts, so that what else runs on the machine disturbs little. */
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include KERNEL_TEXT
/* A strike, and what one unit of its speed means: printed by whoever made the text. */
#define STRIKE 0
#ifndef SPEED_LSB
#define SPEED_LSB 1.0
#endif
#define ROUNDS 20
#define STRETCH 256
/* Strikes count from here on: keys that are down when all begins need not agree with a peer that starts otherwise. */
#define SETTLED 22016
#define CAT_(a, b) a##b
#define CAT(a, b) CAT_(a, b)
#define STATE CAT(NAME, _state)

static STATE state;
static int16_t out[KEYS];

static double now_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

int main(int argc, char **argv)
{
    FILE *file = argc > 1 ? fopen(argv[1], "rb") : 0;
    if (!file) { fprintf(stderr, "wanted: a file of words\n"); return 2; }
    fseek(file, 0, SEEK_END);
    const size_t rows = (size_t)ftell(file) / (2 * KEYS);
    uint16_t *words = malloc(rows * 2 * KEYS);
    rewind(file);
    if (!words || fread(words, 2 * KEYS, rows, file) != rows) { fprintf(stderr, "not readable\n"); return 2; }
    const size_t stretches = (rows + STRETCH - 1) / STRETCH;
    double *best = malloc(stretches * sizeof *best);
    if (!best) return 2;
    for (size_t at = 0; at < stretches; at++) best[at] = 1e9;
    uint64_t sum = 0, events = 0, strikes = 0;
    double speeds = 0;
    for (int round = 0; round < ROUNDS; round++) {
        CAT(NAME, _defaults)(&state);
        CAT(NAME, _init)(&state, words);
        sum = 0;
        events = strikes = 0;
        speeds = 0;
        for (size_t at = 0; at < stretches; at++) {
            const size_t end = (at + 1) * STRETCH < rows ? (at + 1) * STRETCH : rows;
            const double start = now_s();
            for (size_t row = at * STRETCH; row < end; row++) CAT(NAME, _tick)(&state, words + row * KEYS, out);
            const double spent = now_s() - start;
            if (spent < best[at]) best[at] = spent;
            for (int key = 0; key < KEYS; key++) sum = sum * 31 + (uint64_t)(int64_t)out[key];
            events += state.events;
            for (uint32_t e = 0; e < state.events; e++) {
                if (state.event[e].event != STRIKE || at * STRETCH < SETTLED) continue;
                strikes++;
                speeds += state.event[e].args[0] * SPEED_LSB;
            }
            state.events = 0;
        }
    }
    double total = 0;
    for (size_t at = 0; at < stretches; at++) total += best[at];
    printf("%.3f ns per key tick, drive %016llx, %llu events, %llu strikes, mean speed word %.0f\n",
           1e9 * total / (double)(rows * KEYS), (unsigned long long)sum, (unsigned long long)events,
           (unsigned long long)strikes, strikes ? speeds / (double)strikes : 0);
    return 0;
}
