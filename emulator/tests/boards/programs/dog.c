/* The watchdog bites when nobody feeds it: fed three times every 80 us, it resets the chip 100 us after the last. */
#include "board.h"

#ifdef RP2350
enum { COUNTS_PER_US = 1 };
#else
enum { COUNTS_PER_US = 2 }; /* erratum E1 */
#endif

int main(void)
{
    put("guarded\n");
    while (REG(UART + 0x18) & 8)
        ;
    REG(PSM + 8) = WATCHED; /* WDSEL */
    REG(WATCHDOG + 4) = 100 * COUNTS_PER_US;
    REG(WATCHDOG) = 1u << 30;
    for (int i = 0; i < 3; i++) {
        const uint32_t then_us = REG(TIMER + 0x28);
        while (REG(TIMER + 0x28) - then_us < 80)
            ;
        REG(WATCHDOG + 4) = 100 * COUNTS_PER_US;
    }
    for (;;)
        ;
}
