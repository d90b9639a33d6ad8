/* Vector table and start: the little that a C program needs before main. */
#include <stdint.h>

extern uint32_t stack_top, data_start, data_end, data_stored, bss_start, bss_end;
int main(void);
void every_tick(void);
void reset(void);

static void forever(void) { for (;;) {} }

void reset(void) {
    const uint32_t *from = &data_stored;
    for (uint32_t *to = &data_start; to < &data_end;)
        *to++ = *from++;
    for (uint32_t *to = &bss_start; to < &bss_end;)
        *to++ = 0;
    main();
    forever();
}

/* What the core reads at its start, and where exceptions go. */
struct vectors {
    const uint32_t *stack;
    void (*handlers[15])(void);
};

__attribute__((section(".vectors"), used)) static const struct vectors vectors = {
    &stack_top,
    {reset, forever, forever, forever, forever, forever, 0, 0, 0, 0, forever, forever, 0, forever, every_tick},
};
