/* A start as vendors' libraries make it: clocks, resets, serial port, then main; and what the programs share. */
#include "board.h"

extern uint32_t stack_top, stack1_top, data_load, data_start, data_end, bss_start, bss_end;

static void (*handlers[64])(void);

static void unreset(uint32_t blocks)
{
    REG(RESETS + CLEAR) = blocks;
    while ((REG(RESETS + 8) & blocks) != blocks)
        ;
}

/* The crystal, then the PLL at 12 MHz * 125 / 5 / 2 = 150 MHz (133 MHz: * 133 / 6 / 2), then the system clock from it. */
static void clocks(void)
{
    REG(XOSC + 0xc) = 47;
    REG(XOSC) = 0xaa0;
    REG(XOSC + SET) = 0xfab000;
    while (!(REG(XOSC + 4) >> 31))
        ;
    unreset(RESET_PLL);
    REG(PLL) = 1;
    REG(PLL + 8) = 125;
    REG(PLL + CLEAR + 4) = 0x21;
    while (!(REG(PLL) >> 31))
        ;
    REG(PLL + 0xc) = 5 << 16 | 2 << 12;
    REG(PLL + CLEAR + 4) = 8;
    REG(CLOCKS + CLEAR + 0x3c) = 1;
    while (!(REG(CLOCKS + 0x44) & 1))
        ;
    REG(CLOCKS + 0x34) = CLOCK_UNDIVIDED;
    REG(CLOCKS + 0x30) = 2;
    while (!(REG(CLOCKS + 0x38) & 4))
        ;
    REG(CLOCKS + CLEAR + 0x3c) = 7 << 5;
    REG(CLOCKS + SET + 0x3c) = 1;
    while (!(REG(CLOCKS + 0x44) & 2))
        ;
    REG(CLOCKS + 0x48) = 1 << 11;
#ifdef RP2350
    for (unsigned i = 0; i < 6; i++) { /* CYCLES, then CTRL */
        REG(TICKS + 12 * i + 4) = 12;
        REG(TICKS + 12 * i) = 1;
        while (!(REG(TICKS + 12 * i) & 2))
            ;
    }
#else
    REG(WATCHDOG + 0x2c) = 1 << 9 | 12;
#endif
}

/* 1 Mbaud, 8 bits, FIFOs. */
static void serial(void)
{
    unreset(RESET_UART);
    REG(UART + 0x24) = 9;
    REG(UART + 0x28) = 24;
    REG(UART + 0x2c) = 0x70;
    REG(UART + 0x30) = 0x301;
}

void put(const char *text)
{
    for (; *text; text++) {
        while (REG(UART + 0x18) & 0x20)
            ;
        REG(UART) = (uint8_t)*text;
    }
}

void say(const char *name, uint32_t value)
{
    char digits[12] = {[10] = '\n'};
    char *at = digits + 10;
    do
        *--at = '0' + value % 10;
    while (value /= 10);
    put(name);
    put(" ");
    put(at);
}

void leave(int code)
{
    while (REG(UART + 0x18) & 8)
        ;
    const uint32_t block[2] = {0x20026, (uint32_t)code};
    register uint32_t r0 __asm__("r0") = 0x20;
    register const void *r1 __asm__("r1") = block;
    for (;;)
        __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
}

void on_interrupt(unsigned number, void (*handler)(void))
{
    handlers[number] = handler;
    REG(0xe000e280 + number / 32 * 4) = 1u << (number % 32); /* what came before is forgotten */
    REG(0xe000e100 + number / 32 * 4) = 1u << (number % 32);
}

static void any_interrupt(void)
{
    uint32_t number;
    __asm__ volatile("mrs %0, ipsr" : "=r"(number));
    if (number < 16 || !handlers[number - 16])
        leave(100 + (int)number);
    handlers[number - 16]();
}

static uint32_t pop(void)
{
    while (!(REG(SIO + 0x50) & 1))
        __asm__ volatile("wfe");
    return REG(SIO + 0x58);
}

static void push(uint32_t word)
{
    while (!(REG(SIO + 0x50) & 2))
        ;
    REG(SIO + 0x54) = word;
    __asm__ volatile("sev");
}

void start_core1(void (*entry)(void))
{
    /* Off and on again; it says 0 when it waits. */
    REG(PSM + SET + 4) = CORE1_POWER;
    while (!(REG(PSM + 4) & CORE1_POWER))
        ;
    REG(PSM + CLEAR + 4) = CORE1_POWER;
    if (pop() != 0)
        leave(2);
    const uint32_t words[] = {0, 0, 1, REG(0xe000ed08), (uint32_t)&stack1_top, (uint32_t)entry};
    for (unsigned i = 0; i < 6;) {
        if (words[i] == 0) {
            while (REG(SIO + 0x50) & 1)
                (void)REG(SIO + 0x58);
            __asm__ volatile("sev");
        }
        push(words[i]);
        i = pop() == words[i] ? i + 1 : 0;
    }
}

__attribute__((noreturn, used)) static void start(void)
{
    uint32_t *from = &data_load;
    for (uint32_t *to = &data_start; to < &data_end;)
        *to++ = *from++;
    for (uint32_t *to = &bss_start; to < &bss_end;)
        *to++ = 0;
    clocks();
    serial();
    leave(main());
}

__attribute__((naked, noreturn)) void reset_handler(void)
{
    __asm__ volatile("bl start");
}

#define X4 any_interrupt, any_interrupt, any_interrupt, any_interrupt
#define X16 X4, X4, X4, X4

__attribute__((section(".vectors"), used)) static void (*const vectors[])(void) = {
    (void (*)(void))&stack_top, reset_handler, any_interrupt, any_interrupt, X4, X4, X4, X16, X16, X16, X4,
};
