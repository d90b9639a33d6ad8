"""Runs cases of RP2040's DMA in rp2040py and prints what each leaves behind.

A line of standard input is a case, [[offset, value]..]: registers that are written, in order, of a DMA beside 4 KiB of memory at 0
whose word at address a is (a + 1) * 0x9e3779b1. A line of output is a case: raised interrupts, then read address, write address
and count of the first four channels, then the memory in hexadecimal.

The judge's transfers take no time: an alarm is the next transfer of its channel, and alarms are taken one after the other.
"""

import json
import os
import sys

os.environ["RP2040PY_SKIP_CYTHON"] = "1"

from rp2040py.peripherals.dma import RPDMA  # noqa: E402

BYTES = 4096
CHANNELS = 4


class Alarm:
    def __init__(self, clock, callback):
        self.clock, self.callback = clock, callback

    def schedule(self, delay):
        self.clock.append(self)

    def cancel(self):
        while self in self.clock:
            self.clock.remove(self)


class Clock(list):
    def create_alarm(self, callback):
        return Alarm(self, callback)


class Chip:
    def __init__(self):
        self.clock = Clock()
        words = ((4 * i + 1) * 0x9E3779B1 & 0xFFFFFFFF for i in range(BYTES // 4))
        self.memory = bytearray(b"".join(word.to_bytes(4, "little") for word in words))

    def set_interrupt(self, number, on):
        pass

    def read(self, address, size):
        return int.from_bytes(self.memory[address : address + size], "little")

    def write(self, address, size, value):
        self.memory[address : address + size] = value.to_bytes(size, "little")


for bits in (8, 16, 32):
    size = bits // 8
    setattr(Chip, f"read_uint{bits}", lambda self, at, size=size: self.read(at, size))
    setattr(Chip, f"write_uint{bits}", lambda self, at, value, size=size: self.write(at, size, value))


def run(ops):
    chip = Chip()
    dma = RPDMA(chip, "dma")
    for offset, value in ops:
        dma.write_uint32(offset, value)
    while chip.clock:
        chip.clock.pop(0).callback()
    found = [dma.read_uint32(0x400)]
    found += [dma.read_uint32(0x40 * i + 4 * j) for i in range(CHANNELS) for j in range(3)]
    return " ".join(map(str, found)) + " " + chip.memory.hex()


for line in sys.stdin:
    print(run(json.loads(line)))
