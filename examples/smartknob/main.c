/* A knob's firmware in the manner of open smart knobs: a loop that reads the angle, computes a torque and hands it to the motor's library.
   Here a shaft on a desktop stands for sensor and motor; the two functions below are all that a board replaces. */
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "knob.h"

#define TURN_RAD 6.283185307179586

/* The shaft, with a bearing, a motor's torque and a thumb's. */
static double angle_rad, speed_rad_s, thumb_rad;

/* On a board: the angle that the sensor's library gives, which may count turns. */
static double sensor_angle(void)
{
    return angle_rad;
}

/* On a board: the torque that the motor's library takes, or its part of the supply. */
static void motor_move(double torque_n_m)
{
    const double thumb_n_m = 0.5 * (thumb_rad - angle_rad) - 2e-3 * speed_rad_s;
    const double bearing_n_m = -2e-4 * speed_rad_s;
    speed_rad_s += (torque_n_m + thumb_n_m + bearing_n_m) / 15e-6 / KNOB_RATE_HZ;
    angle_rad += speed_rad_s / KNOB_RATE_HZ;
}

/* A sensor word; what is beyond the sensor's range is its end. */
static uint16_t word_of(double rad)
{
    const double word = (rad - KNOB_ANGLE_ZERO_RAD) / KNOB_ANGLE_LSB_RAD;
    return (uint16_t)(word < 0.0 ? 0.0 : word > 65535.0 ? 65535.0 : floor(word + 0.5));
}

static void every_tick(void)
{
    knob_state.inputs[0][KNOB_INPUT_ANGLE] = word_of(sensor_angle());
    knob_tick(&knob_state);
    /* A drive that is positive pushes back, towards smaller angles. */
    motor_move(-knob_state.outputs[0][KNOB_OUTPUT_DRIVE] * KNOB_DRIVE_LSB_N_M);
}

static void print_steps(uint32_t tick)
{
    struct knob_event event;
    while (knob_read_event(&knob_state, &event)) {
        const double place = ldexp(event.args[KNOB_STEP_PLACE], -KNOB_STEP_PLACE_FRACTION_BITS);
        printf("%.2f s: place %.0f at %.1f deg\n", (double)tick / KNOB_RATE_HZ, place, angle_rad * 360.0 / TURN_RAD);
    }
}

int main(void)
{
    const uint32_t second = KNOB_RATE_HZ;
    /* Deeper detents than the program's own: 20 mN*m. */
    if (!knob_set_height(&knob_state, (int32_t)ldexp(20e-3, KNOB_HEIGHT_FRACTION_BITS))) {
        return 1;
    }
    knob_state.inputs[0][KNOB_INPUT_ANGLE] = word_of(sensor_angle());
    knob_init(&knob_state);
    for (uint32_t tick = 0; tick < 3u * second; tick++) {
        /* The thumb turns by 60 degrees in two seconds, stays for half of one, and lets go. */
        const double turned = tick < 2u * second ? (double)tick / (2.0 * second) : 1.0;
        thumb_rad = 2u * tick < 5u * second ? turned * TURN_RAD / 6.0 : angle_rad;
        every_tick();
        print_steps(tick);
    }
    printf("rests at %.1f deg\n", angle_rad * 360.0 / TURN_RAD);
    return 0;
}
