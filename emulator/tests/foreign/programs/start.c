/* Reset, the vector table and semihosting: no board, no vendor code. */
#include "foreign.h"

extern uint32_t stack_top, data_load, data_start, data_end, bss_start, bss_end;
extern void (*init_start[])(void), (*init_end[])(void);

static uint32_t semihost(uint32_t operation, const void *argument)
{
    register uint32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

void put(const char *text) { semihost(0x04, text); }

void leave(int code)
{
    /* ADP_Stopped_ApplicationExit with a code, which 32-bit semihosting has as SYS_EXIT_EXTENDED only. */
    const uint32_t block[2] = {0x20026, (uint32_t)code};
    for (;;)
        semihost(0x20, block);
}

void say(const char *name, uint32_t value)
{
    char digits[11] = " ........\n";
    for (int i = 8; i > 0; i--, value >>= 4)
        digits[i] = "0123456789abcdef"[value & 15];
    put(name);
    put(digits);
}

static uint32_t seed;

void random_restart(void) { seed = 0x2545f491; }

uint32_t random_word(void)
{
    seed ^= seed << 13;
    seed ^= seed >> 17;
    return seed ^= seed << 5;
}

uint32_t crc32(uint32_t crc, const void *bytes, size_t length)
{
    const uint8_t *at = bytes;
    for (crc = ~crc; length-- > 0;) {
        crc ^= *at++;
        for (int bit = 0; bit < 8; bit++)
            crc = crc >> 1 ^ (crc & 1 ? 0xedb88320 : 0);
    }
    return ~crc;
}

__attribute__((noreturn, used)) static void start(void)
{
#if defined(__ARM_FP) && !defined(__SOFTFP__)
    REG(0xe000ed88) |= 0xf << 20; /* CPACR: the FPU */
    __asm__ volatile("dsb\n isb");
#endif
    uint32_t *from = &data_load;
    for (uint32_t *to = &data_start; to < &data_end;)
        *to++ = *from++;
    for (uint32_t *to = &bss_start; to < &bss_end;)
        *to++ = 0;
    random_restart();
    for (void (**init)(void) = init_start; init < init_end; init++)
        (*init)();
    leave(main());
}

/* The stack pointer is set once more, so that the image also starts where a loader jumped to it. */
__attribute__((naked, noreturn)) void reset_handler(void)
{
    __asm__ volatile("ldr r0, =stack_top\n mov sp, r0\n bl start");
}

static void unexpected(void)
{
    uint32_t number;
    __asm__ volatile("mrs %0, ipsr" : "=r"(number));
    say("unexpected exception", number);
    leave(1);
}

#define WEAK __attribute__((weak, alias("unexpected")))
WEAK void nmi_handler(void);
WEAK void hard_fault_handler(void);
WEAK void mem_manage_handler(void);
WEAK void bus_fault_handler(void);
WEAK void usage_fault_handler(void);
WEAK void svc_handler(void);
WEAK void pendsv_handler(void);
WEAK void systick_handler(void);
WEAK void irq_handler(void);

#define IRQS_4 irq_handler, irq_handler, irq_handler, irq_handler

__attribute__((section(".vectors"), used)) static void (*const vectors[])(void) = {
    (void (*)(void))&stack_top,
    reset_handler,
    nmi_handler,
    hard_fault_handler,
    mem_manage_handler,
    bus_fault_handler,
    usage_fault_handler,
    unexpected,
    unexpected,
    unexpected,
    unexpected,
    svc_handler,
    unexpected,
    unexpected,
    pendsv_handler,
    systick_handler,
    IRQS_4, IRQS_4, IRQS_4, IRQS_4, IRQS_4, IRQS_4, IRQS_4, IRQS_4,
};
