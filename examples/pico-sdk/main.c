/* Keys of a piano on both cores of an RP2350, with the vendor's SDK: a slice of PWM counts the ticks, each core has keys of its own, and
   core 0 prints what they strike. The motion is made up; read converters where `finger` is called. */
#include <stdio.h>

#include "hardware/irq.h"
#include "hardware/pwm.h"
#include "pico/multicore.h"
#include "pico/stdlib.h"

#include "piano.h"

/* A slice without pins; its wraps are the ticks. */
#define SLICE 11u
#define CYCLES_A_TICK (150000000u / GRAND_PIANO_RATE_HZ)
#define TICKS 44100u

/* The second instance is a copy from before the first `init`. */
static struct grand_piano_state of_core1;
static volatile uint32_t ticks[2];
static volatile uint32_t sums[2];

static uint16_t finger(uint32_t tick, uint32_t key)
{
    const uint32_t phase = (tick * 12u + key * 4096u) % 131072u;
    return (uint16_t)(phase < 65536u ? phase : 131071u - phase);
}

static struct grand_piano_state *own(void)
{
    return get_core_num() == 0u ? &grand_piano_state : &of_core1;
}

static void read_sensors(uint32_t tick)
{
    const uint32_t first = get_core_num() * GRAND_PIANO_KEYS;
    for (uint32_t key = 0; key < GRAND_PIANO_KEYS; key++) {
        own()->inputs[key][GRAND_PIANO_INPUT_X] = finger(tick, first + key);
    }
}

static void every_tick(void)
{
    const uint32_t core = get_core_num();
    pwm_clear_irq(SLICE);
    read_sensors(ticks[core]);
    grand_piano_tick(own());
    uint32_t sum = sums[core];
    for (uint32_t key = 0; key < GRAND_PIANO_KEYS; key++) {
        sum = sum * 31u + (uint16_t)own()->outputs[key][GRAND_PIANO_OUTPUT_DRIVE];
    }
    sums[core] = sum;
    ticks[core]++;
    if (ticks[core] == TICKS) {
        irq_set_enabled(core == 0u ? PWM_IRQ_WRAP_0 : PWM_IRQ_WRAP_1, false);
    }
}

/* Each core is interrupted by a request of its own. */
static void listen(uint32_t irq)
{
    read_sensors(0);
    grand_piano_init(own());
    irq_set_exclusive_handler(irq, every_tick);
    irq_set_enabled(irq, true);
}

static void core1(void)
{
    listen(PWM_IRQ_WRAP_1);
    multicore_fifo_push_blocking(0);
    for (;;) {
        __wfi();
    }
}

static void print_events(uint32_t core, struct grand_piano_state *state)
{
    struct grand_piano_event event;
    while (grand_piano_read_event(state, &event)) {
        if (event.event == GRAND_PIANO_EVENT_NOTE) {
            printf("core %u, tick %u: key %u\n", (unsigned)core, (unsigned)event.tick, event.key);
        }
    }
}

int main(void)
{
    stdio_init_all();
    of_core1 = grand_piano_state;
    multicore_launch_core1(core1);
    multicore_fifo_pop_blocking();
    listen(PWM_IRQ_WRAP_0);
    pwm_set_wrap(SLICE, CYCLES_A_TICK - 1u);
    pwm_set_irq0_enabled(SLICE, true);
    pwm_set_irq1_enabled(SLICE, true);
    pwm_set_enabled(SLICE, true);
    while (ticks[0] < TICKS || ticks[1] < TICKS) {
        print_events(0, &grand_piano_state);
        print_events(1, &of_core1);
    }
    printf("sums %08x %08x\n", (unsigned)sums[0], (unsigned)sums[1]);
    for (;;) {
        __wfi();
    }
}
