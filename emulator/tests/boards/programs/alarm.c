/* The timer: it counts microseconds, and an alarm wakes a sleeping core in its microsecond. */
#include "board.h"

static volatile uint32_t rang_us;

static void ring(void)
{
    REG(TIMER + TIMER_INTR) = 1;
    rang_us = REG(TIMER + 0x28);
}

int main(void)
{
    const uint32_t then_us = REG(TIMER + 0x28);
    on_interrupt(IRQ_TIMER, ring);
    REG(TIMER + TIMER_INTR + 4) = 1;
    REG(TIMER + 0x10) = then_us + 250;
    while (!rang_us)
        __asm__ volatile("wfi");
    say("microseconds", rang_us - then_us);
    say("armed", REG(TIMER + 0x20));
    return 0;
}
