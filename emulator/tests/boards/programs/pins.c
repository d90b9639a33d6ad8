/* Pins: a serial interface made of PIO, looped back at its data pin; then PWM. */
#include "board.h"

enum { DATA = 16, CLOCK = 18, PULSE = 6, SLICE = 3 };

static void give(unsigned pin, unsigned function)
{
    REG(PADS + 4 + 4 * pin) = 1 << 6; /* an input too, no pulls, not isolated */
    REG(IO_BANK + 4 + 8 * pin) = function;
}

/* out pins, 1 side 0 [1]; in pins, 1 side 1 [1]: eight bits a word, 31.25 cycles a step. */
static void interface(void)
{
    REG(PIO + 0x48) = 0x6101;
    REG(PIO + 0x4c) = 0x5101;
    REG(PIO + 0x38) = 1 << DATA;
    REG(PIO + 0xc8) = 31 << 16 | 64 << 8;
    REG(PIO + 0xcc) = 1 << 12;
    REG(PIO + 0xd0) = 8 << 25 | 8 << 20 | 1 << 17 | 1 << 16;
    REG(PIO + 0xdc) = 1u << 29 | 3 << 26 | 1 << 20 | DATA << 15 | CLOCK << 10 | DATA << 5 | DATA;
    REG(PIO + 0xd8) = 0xe000; /* set pins, 0; set pindirs, 5 */
    REG(PIO + 0xd8) = 0xe085;
    give(DATA, 6);
    give(CLOCK, 6);
    REG(PIO + SET) = 0x111;
}

static uint32_t wrong_bytes(void)
{
    volatile uint8_t *send = (volatile uint8_t *)(PIO + 0x10), *receive = (volatile uint8_t *)(PIO + 0x20);
    uint32_t wrong = 0;
    for (uint32_t sent = 0, received = 0; received < 20;) {
        if (sent < 20 && !(REG(PIO + 4) & 1 << 16))
            *send = (uint8_t)(sent++ * 73 + 1);
        if (!(REG(PIO + 4) & 1 << 8))
            wrong += *receive != (uint8_t)(received++ * 73 + 1);
    }
    return wrong;
}

int main(void)
{
    REG(RESETS + CLEAR) = RESET_PINS;
    while ((REG(RESETS + 8) & RESET_PINS) != RESET_PINS)
        ;
    interface();
    say("wrong bytes", wrong_bytes());
    REG(PIO + CLEAR) = 1;
    REG(PWM + 0x14 * SLICE + 0x10) = 3399;
    REG(PWM + 0x14 * SLICE + 0xc) = 1700;
    give(PULSE, 4);
    REG(PWM + 0x14 * SLICE) = 1;
    for (uint32_t wraps = 0; wraps < 3; wraps++) {
        REG(PWM_INTR) = 1 << SLICE;
        while (!(REG(PWM_INTR) & 1 << SLICE))
            ;
    }
    say("high behind a wrap", REG(SIO + 4) >> PULSE & 1);
    return 0;
}
