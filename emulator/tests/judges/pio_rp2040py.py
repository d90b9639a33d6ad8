"""Runs cases of a PIO block in rp2040py and prints its state after every cycle.

A line of standard input is a case, {"cycles": n, "late": n, "ops": [[cycle, offset, value]..], "inputs": [[cycle, levels]..]}.
An operation is a write; of a value null, a read. It happens after what machines do in its cycle, and an input's change is seen
by machines `late` cycles after its own, which stands for the synchronizers that the judge does not have.
A line of output is a case: per cycle levels, directions, flags, queue levels, then PC, X, Y and OSR of each
machine; then what was read.

What the judge keeps in variables is in registers on the chip, so here flags that machines change are seen in the next cycle, and a
machine that stalls looks again only when its turn comes.
"""

import json
import os
import sys

os.environ["RP2040PY_SKIP_CYTHON"] = "1"

from rp2040py.peripherals._pio import RPPIO  # noqa: E402
from rp2040py.peripherals.state_machine import StateMachine  # noqa: E402


class Pin:
    input_value = False

    def check_for_updates(self):
        pass


class Dma:
    def set_dreq(self, number):
        pass

    def clear_dreq(self, number):
        pass


class Chip:
    simulator = object()

    def __init__(self):
        self.gpio = [Pin() for _ in range(32)]
        self.gpio_values = 0
        self.dma = Dma()

    def set_interrupt(self, number, on):
        pass

    def set_inputs(self, levels):
        self.gpio_values = levels
        for i, pin in enumerate(self.gpio):
            pin.input_value = bool(levels >> i & 1)


check_wait = StateMachine.check_wait
step = StateMachine.step


def check_in_turn(machine):
    if getattr(machine, "in_turn", False):
        check_wait(machine)


StateMachine.check_wait = check_in_turn


class Block(RPPIO):
    """The judge's block, with flags as a register."""

    raised = lowered = held = 0
    own = None  # what the machine sees that runs: its own changes at once

    @property
    def irq(self):
        return self.held if self.own is None else self.own

    @irq.setter
    def irq(self, value):
        self.raised |= value & ~self.irq
        self.lowered |= self.irq & ~value
        self.own = value

    def settle(self):
        self.held = self.held & ~self.lowered | self.raised
        self.raised = self.lowered = 0
        self.own = None

    def _run_due(self):
        for machine in self.machines:
            if not machine.enabled:
                continue
            machine.in_turn, self.own = True, None
            if machine.waiting:
                check_wait(machine)
            elif machine.next_due_fp <= self.cycle_fp:
                step(machine)
            machine.in_turn = False
            machine.output_shift_reg &= 0xFFFFFFFF  # the judge's grow
            machine.input_shift_reg &= 0xFFFFFFFF
        self.next_due_fp = 0


def run(case):
    chip = Chip()
    pio = Block(chip, "PIO", 7, 0)
    pio.raw_write_value = 0
    ops = {}
    for op in case["ops"]:
        ops.setdefault(op[0], []).append(op)
    inputs = {cycle + case["late"]: levels for cycle, levels in case["inputs"]}
    lines, reads = [], []
    for cycle in range(case["cycles"]):
        if cycle in inputs:
            chip.set_inputs(inputs[cycle])
        pio.next_due_fp = 0
        pio.advance(1)
        pio.settle()
        state = [pio.pin_values, pio.pin_directions, pio.irq, pio.read_uint32(0xC)]
        for machine in pio.machines:
            state += [machine.pc, machine.x, machine.y, machine.output_shift_reg]
        lines.append(",".join(f"{word:x}" for word in state))
        for _, offset, value in ops.get(cycle, []):
            if value is None:
                reads.append(pio.read_uint32(offset) & 0xFFFFFFFF)
            else:
                pio.raw_write_value = value
                pio.write_uint32(offset, value)
                pio.settle()
                for machine in pio.machines:  # one that starts has its first cycle behind the write
                    machine.next_due_fp = max(machine.next_due_fp, pio.cycle_fp + 256)
    return " ".join(lines) + "|" + " ".join(f"{word:x}" for word in reads)


for line in sys.stdin:
    print(run(json.loads(line)), flush=True)
