/* Two cores: start over the FIFO, words both ways, a spinlock around a shared counter, an interrupt from the mailbox. */
#include "board.h"

enum { ROUNDS = 2000, LOCK = 0x100 + 4 * 5 };

static volatile uint32_t counter, heard;

static void count_up(void)
{
    for (int i = 0; i < ROUNDS; i++) {
        while (!REG(SIO + LOCK))
            ;
        counter++; /* load, add, store: without the lock, increments would be lost */
        REG(SIO + LOCK) = 0;
    }
}

static void core1_main(void)
{
    REG(SIO + 0x54) = 1000 + REG(SIO); /* who it is */
    count_up();
    REG(SIO + 0x54) = 7;
    for (;;)
        __asm__ volatile("wfe");
}

static void mail(void)
{
    /* Reading an empty mailbox would raise the interrupt again. */
    while (REG(SIO + 0x50) & 1)
        heard = REG(SIO + 0x58);
    REG(SIO + 0x50) = 0xc;
}

int main(void)
{
    start_core1(core1_main);
    while (!(REG(SIO + 0x50) & 1))
        __asm__ volatile("wfe");
    say("core 1 says", REG(SIO + 0x58));
    on_interrupt(IRQ_FIFO_0, mail);
    count_up();
    while (!heard)
        __asm__ volatile("wfi");
    say("then it says", heard);
    say("both counted", counter);
    say("locks taken", REG(SIO + 0x5c));
    return 0;
}
