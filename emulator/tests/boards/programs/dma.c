/* DMA: a copy that ends with an interrupt, then a text to the serial port at the pace of its requests. */
#include "board.h"

static const char TEXT[] = "sent by a DMA while the core sleeps: longer than the port's queue\n";
static uint32_t source[64], target[64];
static volatile uint32_t ended;

static void end_of_copy(void)
{
    ended |= REG(DMA + 0x400);
    REG(DMA + 0x40c) = REG(DMA + 0x400); /* INTS0 */
}

static void copy(unsigned channel, const void *from, volatile void *to, uint32_t count, uint32_t control)
{
    const uint32_t at = DMA + 0x40 * channel;
    REG(at) = (uint32_t)from;
    REG(at + 4) = (uint32_t)to;
    REG(at + 8) = count;
    REG(at + 0xc) = control | channel << DMA_CHAIN;
    while (!(ended & 1 << channel))
        __asm__ volatile("wfi");
}

int main(void)
{
    for (uint32_t i = 0; i < 64; i++)
        source[i] = i * 2654435761u;
    on_interrupt(IRQ_DMA, end_of_copy);
    REG(DMA + 0x404) = 3;
    copy(0, source, target, 64, DMA_EN | DMA_WORDS | DMA_INCR_READ | DMA_INCR_WRITE | 0x3f << DMA_TREQ);
    uint32_t wrong = 0;
    for (uint32_t i = 0; i < 64; i++)
        wrong += target[i] != source[i];
    say("wrong words", wrong);
    REG(UART + 0x48) = 2;
    copy(1, TEXT, (volatile void *)UART, sizeof TEXT - 1, DMA_EN | DMA_INCR_READ | DREQ_UART_TX << DMA_TREQ);
    say("left", REG(DMA + 0x48));
    return 0;
}
