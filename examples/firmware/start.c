/* Vector table and start: the little that a C program needs before main. */
#include <stdint.h>

extern uint32_t stack_top, data_start, data_end, data_stored, bss_start, bss_end;
int main(void);
void every_tick(void);

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

__attribute__((section(".vectors"), used)) static const void *const vectors[16] = {
    &stack_top, reset, forever, forever, forever, forever, forever, 0, 0, 0, 0, forever, forever, 0, forever, every_tick,
};
