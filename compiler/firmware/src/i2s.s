@ Sound by a state machine on three wires: both samples of the tick before, as words of 32 bits with 2^31 for full scale. Assembled
@ for the core that plays.
@
@   tick --queue empty: left, right--> queue --> left is taken LATER, right half a period later --> queue empty, next tick
@
@ State machine and ticks divide one clock, so where one stands in the other's period never changes. It is started by a tick that is on
@ time, as the first ones may not be: they find the words of the first one in the queue, and the last of them starts it.
@ A tick that finds words in the queue later on has come late itself, and left and right could change places: it gives none, and a
@ frame or two later the next left word is taken where left is. Where the queue is empty the machine takes zeros, so clocks never stop
@ and what is not played is silent.
        .syntax unified
        .thumb
        .section .text.frame, "ax"
        .if     SOUND

@ Left in R0, right in R1: 2^30 is full scale, of which one side loses a step.
        .global board_sound
        .type   board_sound, %function
board_sound:
        ldr     r2, =PIO1
        ldr     r3, [r2, #0xc]          @ FLEVEL
        ands    r3, r3, #15
        bne     1f
        ssat    r0, #31, r0
        ssat    r1, #31, r1
        lsls    r0, r0, #1
        lsls    r1, r1, #1
        str     r0, [r2, #0x10]         @ TXF0
        str     r1, [r2, #0x10]
        bx      lr
1:      ldr     r3, =unsent
        ldr     r0, [r3]
        adds    r0, #1
        str     r0, [r3]
        cmp     r0, #UNSENT_AT_START
        blo     2f
        movs    r1, #1
        str     r1, [r2]                @ CTRL: machine 0 is on, or stays so
2:      bx      lr
        .ltorg
        .endif
