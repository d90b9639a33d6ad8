/* Both chips behind one set of names: where blocks are, and how a start goes. Addresses are the datasheets'. */
#pragma once
#include <stdint.h>

#define REG(address) (*(volatile uint32_t *)(address))
#define SET 0x2000u /* a copy of a block that sets bits */
#define CLEAR 0x3000u

#ifdef RP2350
enum {
    CLOCKS = 0x40010000, PSM = 0x40018000, RESETS = 0x40020000, XOSC = 0x40048000, PLL = 0x40050000,
    UART = 0x40070000, TIMER = 0x400b0000, WATCHDOG = 0x400d8000, TICKS = 0x40108000, CONVERTER = 0x40170000,
    IO_BANK = 0x40028000, PADS = 0x40038000, PWM = 0x400a8000, PWM_INTR = PWM + 0xf4,
    RESET_PINS = 1 << 6 | 1 << 9 | 1 << 11 | 1 << 16, RESET_PLL = 1 << 14, RESET_TIMER = 1 << 23, RESET_UART = 1 << 26, RESET_DMA = 1 << 2,
    TIMER_INTR = 0x3c, CORE1_POWER = 1 << 24, WATCHED = 0x01fffff3, CLOCK_UNDIVIDED = 1 << 16, DMA_TIMERS = 0x440,
    IRQ_TIMER = 0, IRQ_DMA = 10, IRQ_UART = 33, IRQ_FIFO_0 = 25, IRQ_FIFO_1 = 25, IRQ_CONVERTER = 46,
    DMA_INCR_WRITE = 1 << 6, DMA_TREQ = 17, DMA_CHAIN = 13, DREQ_UART_TX = 28,
};
#else
enum {
    CLOCKS = 0x40008000, PSM = 0x40010000, RESETS = 0x4000c000, XOSC = 0x40024000, PLL = 0x40028000,
    UART = 0x40034000, TIMER = 0x40054000, WATCHDOG = 0x40058000, CONVERTER = 0x40070000,
    IO_BANK = 0x40014000, PADS = 0x4001c000, PWM = 0x40050000, PWM_INTR = PWM + 0xa4,
    RESET_PINS = 1 << 5 | 1 << 8 | 1 << 10 | 1 << 14, RESET_PLL = 1 << 12, RESET_TIMER = 1 << 21, RESET_UART = 1 << 22, RESET_DMA = 1 << 2,
    TIMER_INTR = 0x34, CORE1_POWER = 1 << 16, WATCHED = 0x0001fffc, CLOCK_UNDIVIDED = 1 << 8, DMA_TIMERS = 0x420,
    IRQ_TIMER = 0, IRQ_DMA = 11, IRQ_UART = 20, IRQ_FIFO_0 = 15, IRQ_FIFO_1 = 16, IRQ_CONVERTER = 31,
    DMA_INCR_WRITE = 1 << 5, DMA_TREQ = 15, DMA_CHAIN = 11, DREQ_UART_TX = 20,
};
#endif
#define DMA 0x50000000u
#define PIO 0x50200000u
#define SIO 0xd0000000u
enum { DMA_EN = 1, DMA_WORDS = 2 << 2, DMA_INCR_READ = 1 << 4 };

/* Prints over the serial port. */
void put(const char *text);
/* Prints "name value\n", the value in decimal. */
void say(const char *name, uint32_t value);
/* Waits until the serial port has sent everything, then ends the run; 0 is success. */
__attribute__((noreturn)) void leave(int code);
/* Calls `handler` for an interrupt of this core. */
void on_interrupt(unsigned number, void (*handler)(void));
/* Starts core 1 by the boot ROM's protocol. */
void start_core1(void (*entry)(void));

int main(void);
