@ What a tick needs of a board with the converter of the emulator: assembled once for each core, beside its frame, so that
@ two cores do not fetch from one place. Each function may use R0 to R3 and R12; their cycles count.
        .syntax unified
        .thumb
        .section .text.frame, "ax"

@ R0: the number of this tick, from 1; R1: which half of the buffers it uses. Called when the converter interrupts.
        .global board_begin
        .type   board_begin, %function
board_begin:
        ldr     r1, =CONVERTER
        ldr     r0, [r1, #0x1c]         @ TICKS
        movs    r1, #1
        bics    r1, r0
        bx      lr

@ The drive words of this tick are in place.
        .global board_end
        .type   board_end, %function
board_end:
        ldr     r1, =CONVERTER
        movs    r0, #1
        str     r0, [r1, #4]            @ STATUS: acknowledged
        bx      lr

@ The samples of the tick before, left in R0 and right in R1: 2^30 is full scale. Called by core 0.
        .if     SOUND
        .global board_sound
        .type   board_sound, %function
board_sound:
        ldr     r2, =CONVERTER
        str     r0, [r2, #0x34]         @ LEFT
        str     r1, [r2, #0x38]         @ RIGHT: both leave
        bx      lr
        .endif

