@ The converter of the emulator, in instructions that all cores have. Called once.
        .syntax unified
        .thumb
        .section .text.start, "ax"

@ Double buffers of all cores' keys, no core served yet, and go.
        .global board_converter
        .type   board_converter, %function
board_converter:
        ldr     r0, =CONVERTER
        ldr     r1, =words0
        str     r1, [r0, #0x0c]
        ldr     r1, =words0 + DISTANCE0
        str     r1, [r0, #0x10]
        ldr     r1, =2 * DISTANCE0
        str     r1, [r0, #0x14]
        ldr     r1, =WORDS0
        .if     CORES > 1
        str     r1, [r0, #0x24]         @ from this word on
        ldr     r1, =words1
        str     r1, [r0, #0x28]
        ldr     r1, =words1 + DISTANCE1
        str     r1, [r0, #0x2c]
        ldr     r1, =2 * DISTANCE1
        str     r1, [r0, #0x30]
        ldr     r1, =WORDS0 + WORDS1
        .endif
        str     r1, [r0, #0x08]
        ldr     r1, =RATE
        str     r1, [r0, #0x18]
        .if     RATE_SECONDS > 1
        ldr     r1, =RATE_SECONDS
        str     r1, [r0, #0x3c]
        .endif
        movs    r1, #3
        str     r1, [r0]
        bx      lr
        .ltorg

@ Outputs go to their safe state, at once and for good: the converter is disabled and puts out zeros. Called after a fault.
        .section .text.firmware.board, "ax"
        .global board_off
        .type   board_off, %function
board_off:
        ldr     r0, =CONVERTER
        movs    r1, #0
        str     r1, [r0]                @ CTRL
        bx      lr
