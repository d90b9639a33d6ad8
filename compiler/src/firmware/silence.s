@ All drive words to zero, of both halves and both cores: what is left to do when nothing else can be trusted.
        .syntax unified
        .thumb
        .section .text.firmware.silence, "ax"
        .global silence
        .type   silence, %function
silence:
        ldr     r0, =words + DISTANCE
        movs    r1, #0
        movs    r2, #0
        movw    r12, #DISTANCE
1:      str     r1, [r0, r2]
        adds    r3, r0, r2
        str     r1, [r3, #2 * DISTANCE]
        adds    r2, #4
        cmp     r2, r12
        blo     1b
        bx      lr
