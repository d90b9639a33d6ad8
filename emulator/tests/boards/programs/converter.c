/* Both cores serve the converter, each half of the keys: drive = 3 * sense - key, by interrupt, from double buffers. */
#include "board.h"

enum { KEYS = 10, HALF = 2 * KEYS };

static volatile uint16_t sense[2][KEYS];
static volatile int16_t drive[2][KEYS];
static volatile uint32_t served[2];

__attribute__((section(".ramcode"), noinline)) static void tick(void)
{
    const uint32_t core = REG(SIO), half = REG(CONVERTER + 4) >> 3 & 1;
    for (uint32_t key = core * KEYS / 2; key < (core + 1) * KEYS / 2; key++)
        drive[half][key] = (int16_t)(3 * sense[half][key] - key);
    served[core]++;
    REG(CONVERTER + 4) = 1;
}

static void core1_main(void)
{
    on_interrupt(IRQ_CONVERTER, tick);
    REG(SIO + 0x54) = 1;
    for (;;)
        __asm__ volatile("wfi");
}

int main(void)
{
    start_core1(core1_main);
    while (!(REG(SIO + 0x50) & 1))
        ;
    on_interrupt(IRQ_CONVERTER, tick);
    REG(CONVERTER + 0x08) = KEYS;
    REG(CONVERTER + 0x0c) = (uint32_t)sense;
    REG(CONVERTER + 0x10) = (uint32_t)drive;
    REG(CONVERTER + 0x14) = HALF;
    REG(CONVERTER) = 3 | 3 << 8;
    while (!(REG(CONVERTER + 4) & 4)) /* until the samples are over */
        __asm__ volatile("wfi");
    say("overruns", REG(CONVERTER + 0x20));
    say("rounds missed by core 1", served[0] - served[1]);
    return 0;
}
