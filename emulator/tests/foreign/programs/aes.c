/* AES-128 with tables made at run time, against the vectors of FIPS 197 and SP 800-38A. */
#include "foreign.h"
#include <string.h>

static uint8_t sbox[256], inverse[256];

static uint8_t doubled(uint8_t x) { return (uint8_t)(x << 1 ^ (x & 0x80 ? 0x1b : 0)); }

static uint8_t times(uint8_t a, uint8_t b)
{
    uint8_t sum = 0;
    for (; b; b >>= 1, a = doubled(a))
        if (b & 1)
            sum ^= a;
    return sum;
}

static uint8_t rotated(uint8_t x, int by) { return (uint8_t)(x << by | x >> (8 - by)); }

/* Powers of the generator 3 and of its inverse walk through all pairs (x, 1/x). */
static void make_tables(void)
{
    uint8_t x = 1, y = 1;
    do {
        x = times(x, 3);
        y = times(y, 0xf6);
        sbox[x] = (uint8_t)(y ^ rotated(y, 1) ^ rotated(y, 2) ^ rotated(y, 3) ^ rotated(y, 4) ^ 0x63);
    } while (x != 1);
    sbox[0] = 0x63;
    for (int i = 0; i < 256; i++)
        inverse[sbox[i]] = (uint8_t)i;
}

static uint8_t schedule[11][16];

static void expand(const uint8_t key[16])
{
    uint8_t *w = schedule[0], constant = 1;
    memcpy(w, key, 16);
    for (int i = 16; i < 176; i += 4) {
        uint8_t t[4];
        memcpy(t, w + i - 4, 4);
        if (i % 16 == 0) {
            const uint8_t first = t[0];
            t[0] = sbox[t[1]] ^ constant;
            t[1] = sbox[t[2]];
            t[2] = sbox[t[3]];
            t[3] = sbox[first];
            constant = doubled(constant);
        }
        for (int j = 0; j < 4; j++)
            w[i + j] = w[i + j - 16] ^ t[j];
    }
}

static void add_key(uint8_t s[16], int round)
{
    for (int i = 0; i < 16; i++)
        s[i] ^= schedule[round][i];
}

static void substitute(uint8_t s[16], const uint8_t table[256], int shift)
{
    uint8_t t[16];
    for (int i = 0; i < 16; i++)
        t[i] = table[s[(i + shift * 4 * (i % 4)) & 15]];
    memcpy(s, t, 16);
}

static void mix(uint8_t s[16], const uint8_t row[4])
{
    for (int c = 0; c < 16; c += 4) {
        uint8_t t[4] = {0};
        for (int i = 0; i < 4; i++)
            for (int j = 0; j < 4; j++)
                t[i] ^= times(s[c + j], row[(j - i) & 3]);
        memcpy(s + c, t, 4);
    }
}

static void encrypt(uint8_t s[16])
{
    static const uint8_t row[4] = {2, 3, 1, 1};
    add_key(s, 0);
    for (int round = 1; round <= 10; round++) {
        substitute(s, sbox, 1);
        if (round < 10)
            mix(s, row);
        add_key(s, round);
    }
}

static void decrypt(uint8_t s[16])
{
    static const uint8_t row[4] = {14, 11, 13, 9};
    for (int round = 10; round > 0; round--) {
        add_key(s, round);
        if (round < 10)
            mix(s, row);
        substitute(s, inverse, -1);
    }
    add_key(s, 0);
}

struct vector {
    uint8_t key[16], plain[16], cipher[16];
};

static const struct vector vectors[] = {
    /* FIPS 197, appendix C.1 */
    {{0x00, 0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x07, 0x08, 0x09, 0x0a, 0x0b, 0x0c, 0x0d, 0x0e, 0x0f},
     {0x00, 0x11, 0x22, 0x33, 0x44, 0x55, 0x66, 0x77, 0x88, 0x99, 0xaa, 0xbb, 0xcc, 0xdd, 0xee, 0xff},
     {0x69, 0xc4, 0xe0, 0xd8, 0x6a, 0x7b, 0x04, 0x30, 0xd8, 0xcd, 0xb7, 0x80, 0x70, 0xb4, 0xc5, 0x5a}},
    /* SP 800-38A, F.1.1, first block */
    {{0x2b, 0x7e, 0x15, 0x16, 0x28, 0xae, 0xd2, 0xa6, 0xab, 0xf7, 0x15, 0x88, 0x09, 0xcf, 0x4f, 0x3c},
     {0x6b, 0xc1, 0xbe, 0xe2, 0x2e, 0x40, 0x9f, 0x96, 0xe9, 0x3d, 0x7e, 0x11, 0x73, 0x93, 0x17, 0x2a},
     {0x3a, 0xd7, 0x7b, 0xb4, 0x0d, 0x7a, 0x36, 0x60, 0xa8, 0x9e, 0xca, 0xf3, 0x24, 0x66, 0xef, 0x97}},
};

int main(void)
{
    int wrong = 0;
    make_tables();
    for (size_t i = 0; i < sizeof vectors / sizeof *vectors; i++) {
        uint8_t s[16];
        expand(vectors[i].key);
        memcpy(s, vectors[i].plain, 16);
        encrypt(s);
        say("cipher", crc32(0, s, 16));
        wrong += memcmp(s, vectors[i].cipher, 16) != 0;
        decrypt(s);
        wrong += memcmp(s, vectors[i].plain, 16) != 0;
    }
    /* A chain of blocks, and back. */
    uint8_t s[16] = {0};
    for (int i = 0; i < 24; i++)
        encrypt(s);
    say("chain", crc32(0, s, 16));
    for (int i = 0; i < 24; i++)
        decrypt(s);
    for (int i = 0; i < 16; i++)
        wrong += s[i] != 0;
    say("wrong", (uint32_t)wrong);
    return wrong != 0;
}
