/* What is done to every kernel: live values and words go in, everything that it shows goes out. Where things lie in its state
   is data, so that the text of a thousand kernels stays short. */
#include <stddef.h>

struct cell { size_t at, words, bytes, next_word, next_key; };

struct kernel {
    int ticks, keys, cells;
    size_t in_bytes, out_bytes, probe_bytes, event_bytes;
    size_t probes, events, lost, event;
    const struct cell *cell;
    const size_t *live;
    const int *args;
};

static int32_t set[2];
static uint16_t in[256];
static int16_t out[256];

static void before(const struct kernel *k)
{
    get(set, 8);
    get(in, k->in_bytes);
}

static void turn(void *state, const struct kernel *k)
{
    if (set[0] >= 0)
        memcpy((char *)state + k->live[set[0]], &set[1], 4);
}

static void after(void *state, const struct kernel *k)
{
    char *s = state;
    uint32_t events;
    put(out, k->out_bytes);
    put(s + k->probes, k->probe_bytes);
    put(s + k->events, 4);
    put(s + k->lost, 8);
    memcpy(&events, s + k->events, 4);
    for (uint32_t e = 0; e < events; e++) {
        const char *happened = s + k->event + e * k->event_bytes;
        uint32_t event;
        memcpy(&event, happened + 12, 4);
        put(happened, 16); /* tick, key, event */
        put(happened + 16, 4 * k->args[event]);
    }
    memset(s + k->events, 0, 4);
    memset(s + k->lost, 0, 8);
}

static void at_last(const void *state, const struct kernel *k)
{
    for (int key = 0; key < k->keys; key++)
        for (const struct cell *c = k->cell; c < k->cell + k->cells; c++)
            for (size_t word = 0; word < c->words; word++) {
                const char *at = (const char *)state + c->at + word * c->next_word + key * c->next_key;
                int32_t narrow = 0;
                int64_t value = 0;
                memcpy(c->bytes == 8 ? (void *)&value : (void *)&narrow, at, c->bytes);
                if (c->bytes != 8)
                    value = narrow;
                put(&value, 8);
            }
}
