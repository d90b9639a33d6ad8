"""What instructions mean, from Ghidra's processor description (pypcode).

Reads lines `ADDRESS HEX`: up to four bytes of Thumb code; a line `reset` forgets all instructions
before. Writes for each one line for every operation, `NAME OUT IN..`, where a varnode is
`space:offset:bytes` and `-` is none; then `end BYTES`.
"""

import sys

import pypcode

PROCESSOR = "ARM:LE:32:Cortex"


def place(varnode):
    return "-" if varnode is None else f"{varnode.space.name}:{varnode.offset}:{varnode.size}"


def main():
    context = pypcode.Context(PROCESSOR)
    for line in sys.stdin:
        if line.strip() == "reset":
            # `context.reset()` leaves some of them: what it lifts then is now and then another thing.
            context = pypcode.Context(PROCESSOR)
            continue
        address, code = line.split()
        lifted = context.translate(bytes.fromhex(code), int(address), max_instructions=1)
        length = 0
        for operation in lifted.ops:
            name = operation.opcode.name
            inputs = [place(own) for own in operation.inputs]
            if name == "IMARK":
                length += operation.inputs[0].size
                continue
            if name == "CALLOTHER":
                inputs[0] = operation.inputs[0].getUserDefinedOpName()
            if name in ("LOAD", "STORE"):
                inputs[0] = "-"
            print(name, place(operation.output), *inputs)
        print("end", length, flush=True)


main()
