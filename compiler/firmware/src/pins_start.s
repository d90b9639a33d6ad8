@ The pins of what is on a board's pins, of a knob, a bench or columns, once at the start.
        .syntax unified
        .thumb
        .section .text.start, "ax"
@ From `pins` to `pins_end`: (pin, what its pad is told, function). The enable comes first.
        .global start_pins
        .type   start_pins, %function
start_pins:
        ldr     r3, =pins
        ldr     r4, =pins_end
        ldr     r0, =IO_BANK0
        ldr     r1, =PADS_BANK0
1:      ldrb    r2, [r3]
        ldrb    r5, [r3, #2]
        add     r6, r0, r2, lsl #3
        str     r5, [r6, #4]            @ CTRL: its function
        ldrb    r5, [r3, #1]
        add     r6, r1, r2, lsl #2
        str     r5, [r6, #4]            @ its pad, out of isolation
        adds    r3, #4
        cmp     r3, r4
        bne     1b
        bx      lr
        .ltorg
