/* Integer work of the kinds embedded benchmarks mix: a linked list that is sorted and searched, small matrices, a state
   machine over text, and a CRC over all of it. */
#include "foreign.h"

/* A list in an array of nodes: found, reversed and merge-sorted by two orders. */

struct node {
    struct node *next;
    int16_t key, rank;
};

#define NODES 96
static struct node nodes[NODES];

typedef int (*order)(const struct node *, const struct node *);

static int by_key(const struct node *a, const struct node *b) { return a->key - b->key; }
static int by_rank(const struct node *a, const struct node *b) { return a->rank - b->rank; }

static struct node *merge(struct node *a, struct node *b, order before)
{
    struct node head = {0}, *tail = &head;
    while (a && b) {
        struct node **least = before(a, b) <= 0 ? &a : &b;
        tail = tail->next = *least;
        *least = (*least)->next;
    }
    tail->next = a ? a : b;
    return head.next;
}

static struct node *sort(struct node *list, order before)
{
    if (!list || !list->next)
        return list;
    struct node *middle = list;
    for (struct node *end = list->next; end && end->next; end = end->next->next)
        middle = middle->next;
    struct node *second = middle->next;
    middle->next = NULL;
    return merge(sort(list, before), sort(second, before), before);
}

static struct node *reverse(struct node *list)
{
    struct node *done = NULL;
    while (list) {
        struct node *next = list->next;
        list->next = done;
        done = list;
        list = next;
    }
    return done;
}

static uint32_t checked(const struct node *list)
{
    uint32_t crc = 0;
    for (; list; list = list->next)
        crc = crc32(crc, &list->key, 2 * sizeof list->key);
    return crc;
}

static void lists(void)
{
    for (int i = 0; i < NODES; i++)
        nodes[i] = (struct node){i + 1 < NODES ? &nodes[i + 1] : NULL, (int16_t)random_word(), (int16_t)i};
    struct node *list = sort(nodes, by_key);
    say("list by key", checked(list));
    list = reverse(list);
    say("list reversed", checked(list));
    int found = 0;
    for (int key = -32768; key < 32768; key += 31)
        for (struct node *n = list; n; n = n->next)
            found += n->key == key;
    say("list found", (uint32_t)found);
    say("list by rank", checked(sort(list, by_rank)));
}

/* Matrices of 16-bit numbers with 32-bit results. */

#define SIDE 12
static int16_t left[SIDE][SIDE], right[SIDE][SIDE];
static int32_t product[SIDE][SIDE];

static void multiply(void)
{
    for (int i = 0; i < SIDE; i++)
        for (int j = 0; j < SIDE; j++) {
            int32_t sum = 0;
            for (int k = 0; k < SIDE; k++)
                sum += left[i][k] * right[k][j];
            product[i][j] = sum;
        }
}

static void multiply_bits(void)
{
    for (int i = 0; i < SIDE; i++)
        for (int j = 0; j < SIDE; j++) {
            int32_t sum = 0;
            for (int k = 0; k < SIDE; k++) {
                const int32_t p = left[i][k] * right[k][j];
                sum += ((p >> 2) & 15) * ((p >> 5) & 127);
            }
            product[i][j] = sum;
        }
}

static void matrices(void)
{
    for (int i = 0; i < SIDE; i++)
        for (int j = 0; j < SIDE; j++) {
            left[i][j] = (int16_t)(random_word() >> 18);
            right[i][j] = (int16_t)(random_word() >> 19);
        }
    multiply();
    say("matrix", crc32(0, product, sizeof product));
    multiply_bits();
    say("matrix bits", crc32(0, product, sizeof product));
}

/* What a word of text is: a number in one of several notations, or none. */

enum state { START, SIGN, INTEGER, POINT, FRACTION, EXPONENT, EXPONENT_SIGN, SCIENTIFIC, INVALID, STATES };

static enum state step(enum state state, char c)
{
    const int digit = c >= '0' && c <= '9';
    const int sign = c == '+' || c == '-';
    switch (state) {
    case START: return digit ? INTEGER : sign ? SIGN : c == '.' ? POINT : INVALID;
    case SIGN: return digit ? INTEGER : c == '.' ? POINT : INVALID;
    case INTEGER: return digit ? INTEGER : c == '.' ? FRACTION : c == 'e' ? EXPONENT : INVALID;
    case POINT: return digit ? FRACTION : INVALID;
    case FRACTION: return digit ? FRACTION : c == 'e' ? EXPONENT : INVALID;
    case EXPONENT: return digit ? SCIENTIFIC : sign ? EXPONENT_SIGN : INVALID;
    case EXPONENT_SIGN:
    case SCIENTIFIC: return digit ? SCIENTIFIC : INVALID;
    default: return INVALID;
    }
}

static void words(void)
{
    static const char text[] = "5012,-1.5,.75,+3e8,1.5e-9,-,abc,7e,0.5.2,+.e,33554432,2e+2,..,-0.0,9e99,x1";
    uint32_t finals[STATES] = {0}, visits[STATES] = {0};
    for (int round = 0; round < 40; round++) {
        enum state state = START;
        for (const char *at = text; *at; at++) {
            if (*at == ',') {
                finals[state]++;
                state = START;
                continue;
            }
            /* Every round spoils other letters. */
            const char c = (char)((at - text) % 37 == round ? *at ^ 2 : *at);
            state = step(state, c);
            visits[state]++;
        }
    }
    say("words ended", crc32(0, finals, sizeof finals));
    say("words visited", crc32(0, visits, sizeof visits));
}

int main(void)
{
    lists();
    matrices();
    words();
    return 0;
}
