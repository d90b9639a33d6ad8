// The grand of `instruments/grand-piano.whip` as a C engineer writes it for a Cortex-M33: the same model, formats chosen by
// hand, constants folded by hand, branches where they save work. Events are counted and kept in a small ring.
//
//   phi   rad, Q31         rate  rad per tick, Q39        squeeze  m, Q36    squeezing  m/s, Q26    push, forces  N, Q24
//
// Constants are computed by the compiler from the numbers of the model; nothing is floating point when it runs.
#include <stdint.h>

#ifndef KEYS
#define KEYS 44
#endif
#define WINDOW 31

#define RATE 44100.0
#define LSB (0.011 / 65535.0)
#define REACH (160.0 / 218.0)
#define L3_LONG 0.0178
#define L3_SHORT 0.0165
#define INERTIA 1.54e-4
#define WEIGHT (0.01174 * 0.103 * 9.80665)

#define WORD(x_m) ((int32_t)(((x_m) + 0.0005) / LSB + 0.999999))
#define Q(value, bits) ((int32_t)((value) * (double)(1ULL << (bits)) + ((value) < 0 ? -0.5 : 0.5)))
#define MPS_PER_D (LSB * RATE / 2480.0)
#define MPS2_PER_E (2.0 * LSB * RATE * RATE / 158224.0)

static inline int32_t top(int32_t a, int32_t b) { return (int32_t)(((int64_t)a * b) >> 32); }
static inline int32_t most(int32_t a, int32_t b) { return a > b ? a : b; }
static inline int32_t least(int32_t a, int32_t b) { return a < b ? a : b; }

enum { LEVER = 1, ENGAGED = 2, FLYING = 4, CAUGHT = 8, AWAY = 16, AT_STRING = 32, DAMPED = 64 };

typedef struct {
    int32_t s0, d, e;
    int32_t phi, rate, held;
    int32_t thump, nudge;
    int16_t thump_left, nudge_left;
    uint32_t modes;
} Key;

typedef struct {
    int32_t weight;      // N, Q24
    int32_t added_mass;  // kg * MPS2_PER_E, Q42
} Live;

typedef struct { uint16_t key, kind; int32_t speed; } Event;

Key keys[KEYS];
uint16_t history[WINDOW][KEYS];
uint32_t at;
Event events[64];
uint32_t events_at;

static __attribute__((noinline)) void emit(uint32_t key, uint32_t kind, int32_t speed) {
    events[events_at++ % 64] = (Event){ (uint16_t)key, (uint16_t)kind, speed };
}

void reset(const uint16_t *in) {
    at = 0;
    for (uint32_t k = 0; k < KEYS; k++) {
        keys[k] = (Key){ .s0 = in[k] * WINDOW, .held = Q(0.2, 24), .modes = AT_STRING | DAMPED };
        for (uint32_t i = 0; i < WINDOW; i++) history[i][k] = in[k];
    }
}

__attribute__((noinline)) void tick(const uint16_t *restrict in, int16_t *restrict out, const Live *restrict live) {
    uint16_t *row = history[at];
    const int32_t weight = live->weight, added_mass = live->added_mass;
    for (uint32_t k = 0; k < KEYS; k++) {
        Key *q = &keys[k];
        const int32_t w = in[k], o = row[k];
        row[k] = (uint16_t)w;
        const int32_t s0 = q->s0, d0 = q->d, e0 = q->e;
        const int32_t d = d0 - s0 + 16 * o + 15 * w;
        const int32_t e = e0 - 2 * d0 + s0 + 145 * w - 176 * o;
        q->s0 = s0 + w - o;
        q->d = d;
        q->e = e;

        uint32_t modes = q->modes;
        int32_t phi = q->phi, rate = q->rate;
        const uint32_t before = modes;
        const int below = w <= WORD(0.006) - 1;

        // Escapement.
        int32_t force = weight;
        if (below) {
            q->held = Q(0.2, 24);
            modes &= ~(uint32_t)(LEVER | AWAY);
        } else {
            int32_t cap = q->held;
            if (w >= WORD(0.0076)) cap = least(cap, most(0, Q(2.1, 24) - top((w << 14), Q(250.0 * LSB, 42)) + Q(250 * 0.0005, 24)));
            q->held = cap;
            force += least(cap, top((w << 14), Q(125.0 * LSB, 42)) - Q(0.75 + 125 * 0.0005, 24));
            if (w >= WORD(0.0084)) modes |= AWAY;
            if (before & AWAY || (before & FLYING && rate < 0)) modes |= LEVER;
                    }

        // Friction, inertia.
        const int32_t speed = d;
        const int32_t friction = Q(0.13 / 30.0 / MPS_PER_D, 0);
        force += (int32_t)(Q(30.0 * MPS_PER_D, 24)) * most(-friction, least(friction, speed)) + top(speed << 8, Q(0.4 * MPS_PER_D, 48));
        force += top(e << 4, added_mass) * 1024;

        // Contact.
        const int lever = before & LEVER, engaged = before & ENGAGED;
        const int32_t lift = lever ? least(w, WORD(0.006) - 1) : w;
        const int32_t knuckle = engaged ? top(phi, Q(L3_SHORT, 36)) * 2 + Q((L3_LONG - L3_SHORT) * 0.26, 36) : top(phi, Q(L3_LONG, 36)) * 2;
        const int32_t squeeze = top(lift << 15, Q(REACH * LSB, 53)) - Q(REACH * 0.0005, 36) - knuckle;
        const int32_t turning = top(rate, engaged ? Q(L3_SHORT * RATE, 19) : Q(L3_LONG * RATE, 19));
        const int32_t squeezing = (lever && !below ? 0 : top(d << 8, Q(REACH * MPS_PER_D, 49)) * 2) - turning;
        int32_t torque = 0;
        if (!(before & FLYING)) {
            if (squeeze >= 0) {
                const int32_t push = most(0, top(squeeze, Q(8000.0, 17)) * 8 + top(squeezing, Q(50.0, 25)) * 32);
                force += top(push, Q(REACH, 31)) * 2;
                torque = top(push, engaged ? Q(L3_SHORT / INERTIA / RATE / RATE, 47) : Q(L3_LONG / INERTIA / RATE / RATE, 47));
            } else if (squeeze < Q(-0.0001, 36)) {
                modes |= FLYING;
            }
        }

        // Pulses.
        force += q->thump - q->nudge;
        if (q->thump_left && --q->thump_left == 0) q->thump = 0;
        if (q->nudge_left && --q->nudge_left == 0) q->nudge = 0;

        // Hammer.
        int32_t new_rate = 0, new_phi = phi;
        if (before & CAUGHT) {
            force += Q(WEIGHT * REACH / L3_LONG, 24);
        } else {
            new_rate = rate - top(rate, Q(2e-5 / INERTIA / RATE, 32)) + torque - Q(WEIGHT / INERTIA / RATE / RATE, 39);
            new_phi = phi + (new_rate >> 8);
        }

        // Repetition lever, string, damper.
        if (phi > Q(0.26, 31)) modes |= ENGAGED; else modes &= ~(uint32_t)ENGAGED;
        if (phi >= Q(0.365, 31) && rate > 0) {
            if (!(modes & AT_STRING)) {
                emit(k, 0, rate);
                new_rate = -top(rate, Q(0.9, 31)) * 2;
            }
            modes |= AT_STRING;
        } else {
            modes &= ~(uint32_t)AT_STRING;
        }
        if (w < WORD(0.003)) {
            if (!(modes & DAMPED)) emit(k, 1, 0);
            modes |= DAMPED;
        } else {
            modes &= ~(uint32_t)DAMPED;
        }

        // Landing.
        if ((before & FLYING) && squeeze >= 0 && phi < Q(0.365, 31)) {
            modes &= ~(uint32_t)FLYING;
            if (w >= WORD(0.0005)) {
                const int32_t level = least(Q(5.0, 24), most(0, top(squeezing, Q(20.0, 26)) * 16));
                q->thump = q->thump_left ? most(q->thump, level) : level;
                q->thump_left = 353;
                new_rate = rate + top(squeezing, engaged ? Q(1.1 / L3_SHORT / RATE, 40) : Q(1.1 / L3_LONG / RATE, 40)) * 32;
            } else {
                const int32_t level = least(Q(1.0, 24), most(0, -top(rate, Q(0.05 * RATE, 17))));
                q->nudge = q->nudge_left ? most(q->nudge, level) : level;
                q->nudge_left = 882;
                new_rate = rate > Q(-0.5 / RATE, 39) ? 0 : -top(rate, Q(0.3, 31)) * 2;
            }
        }

        // Back-check.
        if (before & CAUGHT) {
            if (w < WORD(0.008)) modes &= ~(uint32_t)CAUGHT;
        } else if (w > WORD(0.0088) - 1 && (before & FLYING) && phi <= Q(0.26, 31) && rate < 0) {
            modes |= CAUGHT;
        }

        // Ends of the hammer's way.
        if (new_phi > Q(0.41887902, 31)) {
            new_phi = Q(0.41887902, 31);
            new_rate = least(new_rate, 0);
        } else if (new_phi < Q(-0.03490659, 31)) {
            new_phi = Q(-0.03490659, 31);
            new_rate = most(new_rate, 0);
        }
        q->phi = new_phi;
        q->rate = most(-Q(80.0 / RATE, 39), least(Q(80.0 / RATE, 39), new_rate));
        q->modes = modes;

        const int32_t drive = force >> 14;
        out[k] = (int16_t)(drive > 32767 ? 32767 : drive < -32768 ? -32768 : drive);
    }
    at = at + 1 == WINDOW ? 0 : at + 1;
}
