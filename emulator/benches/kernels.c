/* Kernels that embedded programs are made of: CRC by bits and by table, FIR, sorting, matrices, a state machine. */
#include <stdint.h>

extern uint32_t stack_top;
static uint8_t bytes[4096];
static int16_t samples[512], taps[64];
static int32_t filtered[512];
static uint32_t table[256], matrix[3][400];
volatile uint32_t result;

static uint32_t crc_by_bits(const uint8_t *p, int n)
{
    uint32_t c = ~0u;
    while (n--) {
        c ^= *p++;
        for (int k = 0; k < 8; k++)
            c = c & 1 ? c >> 1 ^ 0xedb88320u : c >> 1;
    }
    return ~c;
}

static void make_table(void)
{
    for (uint32_t i = 0; i < 256; i++) {
        uint32_t c = i;
        for (int k = 0; k < 8; k++)
            c = c & 1 ? c >> 1 ^ 0xedb88320u : c >> 1;
        table[i] = c;
    }
}

static uint32_t crc_by_table(const uint8_t *p, int n)
{
    uint32_t c = ~0u;
    while (n--)
        c = table[(c ^ *p++) & 255] ^ c >> 8;
    return ~c;
}

static void filter(void)
{
    for (int i = 64; i < 512; i++) {
        int32_t sum = 0;
        for (int k = 0; k < 64; k++)
            sum += samples[i - k] * taps[k];
        filtered[i] = sum >> 8;
    }
}

static uint32_t sort(void)
{
    for (int i = 1; i < 512; i++) {
        int32_t v = filtered[i];
        int j = i - 1;
        while (j >= 0 && filtered[j] > v) {
            filtered[j + 1] = filtered[j];
            j--;
        }
        filtered[j + 1] = v;
    }
    return filtered[100];
}

static void multiply(void)
{
    for (int i = 0; i < 20; i++)
        for (int j = 0; j < 20; j++) {
            uint32_t sum = 0;
            for (int k = 0; k < 20; k++)
                sum += matrix[0][i * 20 + k] * matrix[1][k * 20 + j];
            matrix[2][i * 20 + j] = sum;
        }
}

static int machine(const uint8_t *p, int n)
{
    int state = 0, count = 0;
    while (n--) {
        switch (*p++ & 7) {
        case 0: state = state == 3 ? 0 : state + 1; break;
        case 1: case 2: state ^= 1; break;
        case 3: if (state == 2) count++; state = 0; break;
        case 4: state = 5; break;
        case 5: count += state; break;
        case 6: state = 2; break;
        default: count ^= state;
        }
    }
    return count;
}

static void run(void)
{
    uint32_t r = 0;
    make_table();
    for (int i = 0; i < 4096; i++) bytes[i] = i * 7 + (i >> 3);
    for (int i = 0; i < 512; i++) samples[i] = i * 37;
    for (int i = 0; i < 64; i++) taps[i] = i - 30;
    for (int i = 0; i < 400; i++) matrix[0][i] = matrix[1][i] = i * 3;
    for (int i = 0; i < ROUNDS; i++) {
        r += crc_by_bits(bytes, 2048) + crc_by_table(bytes, 4096);
        filter();
        r += sort();
        multiply();
        r += matrix[2][i % 400] + machine(bytes, 4096);
        bytes[i & 4095] ^= r;
        samples[i & 511] = r;
    }
    result = r;
}

static void reset(void)
{
    run();
    register uint32_t call asm("r0") = 0x18, reason asm("r1") = 0x20026;
    asm volatile("bkpt 0xab" : : "r"(call), "r"(reason) : "memory");
    for (;;) {}
}

__attribute__((section(".vectors"), used)) static void *const vectors[] = { &stack_top, reset };
