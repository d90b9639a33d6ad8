/* The same on a core without an operating system: semihosting opens the files, and blocks of them are held here. */
#include <stddef.h>
#include <string.h>
#include <stdint.h>

#define BLOCK 32768

static uint32_t semihost(uint32_t operation, const void *argument)
{
    register uint32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

static void leave(uint32_t code)
{
    const uint32_t block[2] = {0x20026, code}; /* SYS_EXIT_EXTENDED: ended by itself, with a code */
    for (;;)
        semihost(0x20, block);
}

static uint32_t open(const char *name, uint32_t mode)
{
    const uint32_t block[3] = {(uint32_t)name, mode, strlen(name)};
    uint32_t handle = semihost(0x01, block);
    if (handle == 0xffffffff)
        leave(2);
    return handle;
}

static struct { uint8_t bytes[BLOCK]; size_t at, end; uint32_t handle; } input, output;

static void get(void *to, size_t n)
{
    for (uint8_t *next = to; n > 0; n--) {
        if (input.at == input.end) {
            const uint32_t block[3] = {input.handle, (uint32_t)input.bytes, BLOCK};
            input.at = 0;
            input.end = BLOCK - semihost(0x06, block); /* SYS_READ tells how much is missing */
            if (input.end == 0)
                leave(3);
        }
        *next++ = input.bytes[input.at++];
    }
}

static void flush(void)
{
    const uint32_t block[3] = {output.handle, (uint32_t)output.bytes, output.at};
    if (semihost(0x05, block) != 0)
        leave(4);
    output.at = 0;
}

static void put(const void *from, size_t n)
{
    for (const uint8_t *next = from; n > 0; n--) {
        if (output.at == BLOCK)
            flush();
        output.bytes[output.at++] = *next++;
    }
}

static void play(void);

extern uint32_t stack_top, data_load, data_start, data_end, bss_start, bss_end;

__attribute__((noreturn, used)) static void start(void)
{
    uint32_t *from = &data_load;
    for (uint32_t *to = &data_start; to < &data_end;)
        *to++ = *from++;
    memset(&bss_start, 0, (char *)&bss_end - (char *)&bss_start);
    input.handle = open("input", 1);   /* rb */
    output.handle = open("output", 5); /* wb */
    play();
    flush();
    leave(0);
    __builtin_unreachable();
}

/* The stack may be anywhere before this. */
__attribute__((naked, noreturn)) void reset(void)
{
    __asm__ volatile("movw r0, #:lower16:stack_top\n movt r0, #:upper16:stack_top\n mov sp, r0\n bl start");
}

static void unexpected(void) { leave(1); }

__attribute__((section(".vectors"), used)) static void (*const vectors[16])(void) = {
    (void (*)(void))&stack_top, reset, unexpected, unexpected, unexpected, unexpected, unexpected, unexpected,
};
