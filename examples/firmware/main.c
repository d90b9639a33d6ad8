/* A keyboard of four keys: a timer interrupt stands for the converter, a motion in the program for the fingers.
 * Events are printed by semihosting, so that an emulator shows them. */
#include <stdint.h>
#include "piano.h"

#define TICKS 12000
#define REST 2979          /* sensor words: a key at rest, and pressed by 10 mm */
#define DOWN 62557

#define SYST_CSR (*(volatile uint32_t *)0xe000e010)
#define SYST_RVR (*(volatile uint32_t *)0xe000e014)

static volatile uint32_t ticks;
static volatile int32_t force_sum;

/* Semihosting: write a text, end the program. */
static int call_host(int operation, const void *argument) {
#ifdef __arm__
    register int r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
#else
    (void)argument; /* another machine has no such host: its compilers only read this text */
    return operation;
#endif
}

static void print(const char *text) { call_host(0x04, text); }

static void print_number(uint32_t number) {
    char text[12];
    int at = sizeof text - 1;
    text[at] = 0;
    do {
        text[--at] = (char)('0' + number % 10);
        number /= 10;
    } while (number);
    print(text + at);
}

/* Each key goes down, later and faster from key to key, stays and comes up. */
static uint16_t finger(uint32_t tick, uint32_t key) {
    uint32_t start = 500 + 300 * key, time = 2600 - 500 * key, up = 7000;
    if (tick < start || tick >= up + time)
        return REST;
    if (tick < start + time)
        return (uint16_t)(REST + (uint64_t)(DOWN - REST) * (tick - start) / time);
    return tick < up ? DOWN : (uint16_t)(DOWN - (uint64_t)(DOWN - REST) * (tick - up) / time);
}

/* The interrupt: sensor words in, one tick of all keys, drive words out. */
void every_tick(void);
void every_tick(void) {
    for (uint32_t key = 0; key < GRAND_PIANO_KEYS; key++)
        grand_piano_state.inputs[key][0] = finger(ticks, key);
    if (ticks == 0)
        grand_piano_init(&grand_piano_state);
    grand_piano_tick(&grand_piano_state);
    for (uint32_t key = 0; key < GRAND_PIANO_KEYS; key++)
        force_sum += grand_piano_state.outputs[key][0];
    ticks++;
}

static void print_event(const struct grand_piano_event *event) {
    print("tick ");
    print_number(event->tick);
    print(" key ");
    print_number(event->key);
    print(event->event == GRAND_PIANO_EVENT_NOTE ? " note\n" : " release\n");
}

int main(void) {
    SYST_RVR = 4000 - 1;                    /* cycles of a tick */
    SYST_CSR = 7;                           /* enabled, interrupt, processor clock */
    struct grand_piano_event event;
    while (ticks < TICKS)
        while (grand_piano_read_event(&grand_piano_state, &event))
            print_event(&event);
    SYST_CSR = 0;
    print("sum of drive words ");
    print_number((uint32_t)force_sum);
    print("\n");
    call_host(0x18, (const void *)0x20026); /* SYS_EXIT: the program ended */
    return 0;
}
