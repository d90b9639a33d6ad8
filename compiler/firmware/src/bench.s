@ What a tick needs of a board with a bench of keys: eight words of the ADC that the DMA has put into a ring, a bridge of PWM for each
@ key. Assembled for the core that plays, and once for the start.
@
@   board_begin   where the DMA has come to -> the eight newest words -> sensor words, of one half alone
@   board_end     drive word -> voltage that brings the coil's current there -> two compare values in one word, taken over at the
@                 carriers' wrap; what the supply cannot give is made up for in the next tick
        .syntax unified
        .thumb
        .section .text.frame, "ax"

@ R0: the number of this tick: as many as there were eights of words; R1: 0. Where no eight is new and whole, because the ADC stands
@ still, a conversion was lost or this tick is late, the sensor words stay as they were, and the number is one too large: that is a
@ missed tick, so all forces go to zero. After 10 ms of that the bridges sleep.
        .global board_begin
        .type   board_begin, %function
board_begin:
        ldr     r1, =PWM + 0xf4         @ INTR
        mov     r0, #1 << TICK_SLICE
        str     r0, [r1]
        ldr     r1, =DMA + 0x40
        ldr     r2, =bench
        ldr     r3, [r1, #4]            @ WRITE_ADDR of channel 1
        ldr     r1, [r2, #B_AT]
        ldr     r0, [r2, #B_TICK]
        sub     r1, r3, r1
        lsls    r12, r3, #28
        bne     stale
        ubfx    r1, r1, #4, #RING_BITS - 4
        cbz     r1, stale
        add     r0, r0, r1
        movs    r1, #0
        str     r3, [r2, #B_AT]
        str     r0, [r2, #B_TICK]
        str     r1, [r2, #B_AGE]
        sub     r3, r3, #16 - 2 * FIRST_CONVERSION
        ldr     r2, =samples
        ubfx    r3, r3, #0, #RING_BITS
        ldr     r12, =words0
        add     r3, r3, r2
        .set    NTH, 0
        .rept   (KEYS0 + 1) / 2
        ldr     r1, [r3, #4 * NTH]
        lsr     r2, r1, #8
        and     r2, r2, #0x000f000f
        orr     r1, r2, r1, lsl #4      @ 12 bits, repeated below: both ends of the range are the words' ends
        str     r1, [r12, #4 * NTH]
        .set    NTH, NTH + 1
        .endr
        movs    r1, #0
        bx      lr

stale:  ldr     r1, [r2, #B_AGE]
        adds    r0, #2
        adds    r1, #1
        str     r0, [r2, #B_TICK]
        str     r1, [r2, #B_AGE]
        movw    r2, #AGE_WRONG
        cmp     r1, r2
        movw    r1, #0
        it      ls
        bxls    lr
        movs    r1, #FAULT_SENSOR
        b       sleep

@ The drive words are in place. A positive word pulls IN1 down for a part of the period, so it drives by IN2; both inputs are high
@ otherwise, where the coil is shorted.
        .global board_end
        .type   board_end, %function
board_end:
        push    {r4-r9}
        ldr     r2, =words0 + DISTANCE0
        ldr     r3, =bench + B_CURRENTS
        ldr     r4, =GAIN0
        ldr     r5, =LEAD0
        movw    r6, #2 * PERIOD
        ldr     r7, =PERIOD << 16 | PERIOD
        movw    r8, #LEFT0
        ldr     r12, =PWM
        .set    NTH, 0
        .rept   KEYS0
        ldrsh   r9, [r2, #2 * NTH]
        ldrsh   r1, [r3, #2 * NTH]
        smulwb  r0, r4, r9
        sub     r1, r9, r1
        ssat    r1, #16, r1
        smlawb  r0, r5, r1, r0
        ssat    r1, #16, r0             @ of 32768 for the supply
        sub     r0, r0, r1
        smulwb  r0, r0, r8              @ the current that is missing
        sub     r9, r9, r0
        smulwb  r0, r6, r1
        strh    r9, [r3, #2 * NTH]
        usat    r1, #13, r0
        rsb     r0, r0, #0
        sub     r1, r7, r1
        usat    r0, #13, r0
        sub     r0, r1, r0, lsl #16
        .if     NTH == 0
        str     r0, [r12, #20 * SLICE_0 + 0xc]
        .endif
        .if     NTH == 1
        str     r0, [r12, #20 * SLICE_1 + 0xc]
        .endif
        .if     NTH == 2
        str     r0, [r12, #20 * SLICE_2 + 0xc]
        .endif
        .if     NTH == 3
        str     r0, [r12, #20 * SLICE_3 + 0xc]
        .endif
        .if     NTH == 4
        str     r0, [r12, #20 * SLICE_4 + 0xc]
        .endif
        .if     NTH == 5
        str     r0, [r12, #20 * SLICE_5 + 0xc]
        .endif
        .if     NTH == 6
        str     r0, [r12, #20 * SLICE_6 + 0xc]
        .endif
        .if     NTH == 7
        str     r0, [r12, #20 * SLICE_7 + 0xc]
        .endif
        .set    NTH, NTH + 1
        .endr
        pop     {r4-r9}
        ldr     r1, =0xd0000000
        ldr     r0, [r1, #4]            @ SIO: GPIO_IN
        tst     r0, #1 << PIN_FAULT
        it      ne
        bxne    lr
        movs    r1, #FAULT_DRIVER

@ R1: a fault. The bridges sleep, and stay so.
sleep:  ldr     r2, =0xd0000000
        mov     r3, #1 << PIN_SLEEP
        str     r3, [r2, #0x20]         @ GPIO_OUT_CLR
        ldr     r2, =core0
        ldr     r3, [r2, #C_FAULTS]
        orrs    r3, r1
        str     r3, [r2, #C_FAULTS]
        movs    r1, #0
        bx      lr
        .ltorg
