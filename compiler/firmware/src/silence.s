@ All drive words to zero, of both halves and both cores: what is left to do when nothing else can be trusted.
        .syntax unified
        .thumb
        .section .text.firmware.silence, "ax"
        .global silence
        .type   silence, %function
silence:
        movs    r1, #0
        ldr     r0, =words0 + DISTANCE0
        ldr     r3, =words0 + 3 * DISTANCE0
        movs    r2, #DISTANCE0 / 4
1:      str     r1, [r0]
        str     r1, [r3]
        adds    r0, #4
        adds    r3, #4
        subs    r2, #1
        bne     1b
        .if     CORES > 1
        ldr     r0, =words1 + DISTANCE1
        ldr     r3, =words1 + 3 * DISTANCE1
        movs    r2, #DISTANCE1 / 4
2:      str     r1, [r0]
        str     r1, [r3]
        adds    r0, #4
        adds    r3, #4
        subs    r2, #1
        bne     2b
        .endif
        bx      lr
