"""Runs cases of one state machine in rp2040-pio-emulator and prints what it did.

A line of standard input is a case, {"cycles": n, "program": [words], "words": [of the queue], "directions": bits, "settings":
{arguments of emulate}}; all inputs are low.
A line of output is a case: after each instruction the clock, levels, X, Y, ISR, OSR, words left, words received and PC. The clock
is that of the next instruction: delays are behind it.
"""

import json
import sys
from collections import deque

from pioemu import ShiftRegister, State, emulate


def run(case):
    start = State(
        transmit_fifo=deque(case["words"]),
        output_shift_register=ShiftRegister(0, 32),
        pin_directions=case["directions"],
    )
    steps = []
    running = emulate(
        case["program"],
        stop_when=lambda _, state: state.clock >= case["cycles"],
        initial_state=start,
        **case["settings"],
    )
    for _, state in running:
        words = [
            state.clock,
            state.pin_values & state.pin_directions,
            state.x_register,
            state.y_register,
            state.input_shift_register.contents,
            state.output_shift_register.contents,
            len(state.transmit_fifo),
            len(state.receive_fifo),
            state.program_counter,
        ]
        steps.append(",".join(f"{word:x}" for word in words))
    return " ".join(steps)


for line in sys.stdin:
    print(run(json.loads(line)), flush=True)
