@ What a tick needs of a board with knobs, of which there are KNOBS: of each a word of its angle sensor from a state machine, and three
@ phases of PWM for its driver. Assembled for the core that plays, and once for the start. Nothing here is shared: the state machines
@ clock the sensors by themselves, exactly once a period of the carrier, and a queue of theirs asks for the tick. Sensors share clock and
@ select, and the machines run the same text in the same cycles, so all words are there at once.
@
@   board_begin   of each: frame -> CRC, status, step -> position, speed -> sensor word, of one half alone
@   board_end     of each: drive word -> voltage -> sines of the electrical angle -> three compare values, taken over at the next wrap
        .syntax unified
        .thumb
        .section .text.frame, "ax"

@ R0: the number of this tick, which is that of its words; R1: 0. A word that cannot be leaves its sensor's as it is.
        .global board_begin
        .type   board_begin, %function
board_begin:
        .set    NTH, 0
        .if     KNOBS > 1
        push    {r4, lr}
        .endif
        ldr     r1, =PIO0
        ldr     r2, =knob + 64 * NTH    @ the same literal as below
        ldr     r3, [r1, #0xc]          @ FLEVEL: how many words there are of each, four at most
        ldr     r0, [r2, #K_TICK]
        ubfx    r3, r3, #4, #4
        cmp     r3, #0
        beq     9f
        add     r0, r0, r3
        str     r0, [r2, #K_TICK]
        .if     KNOBS > 1
        mov     r4, r3
        .endif
        .rept   KNOBS
        .if     NTH
        ldr     r1, =PIO0
        ldr     r2, =knob + 64 * NTH
        mov     r3, r4
        .endif
@! rounds 4
1:      ldr     r12, [r1, #0x20 + 4 * NTH] @ RXF: the last one counts
        subs    r3, #1
        bne     1b
        ldr     r3, =remainders
        ubfx    r1, r12, #18, #6
        ldrb    r1, [r3, r1]
        eor     r1, r1, r12, lsr #12
        and     r1, r1, #0x3f
        ldrb    r1, [r3, r1]
        eor     r1, r1, r12, lsr #6
        and     r1, r1, #0x3f
        ldrb    r1, [r3, r1]
        and     r3, r12, #0x3f
        cmp     r1, r3
        bne     4f
        tst     r12, #0x2c0             @ track lost, or a field that is too weak or too strong
        bne     5f
        ldr     r1, [r2, #K_FRAME_ANGLE]
        ubfx    r12, r12, #10, #14
        ldr     r3, [r2, #K_LIMIT]
        sub     r1, r12, r1
        sbfx    r1, r1, #0, #14         @ the shorter way round, so it may turn for ever
        add     r1, r1, r3
        cmp     r1, r3, lsl #1
        bhi     4f                      @ no knob turns so fast: zeros of a broken line are right by their CRC
        str     r12, [r2, #K_FRAME_ANGLE]
        sub     r1, r1, r3
        ldr     r3, [r2, #K_POSITION]
        qadd    r3, r3, r1              @ 131072 turns
        str     r3, [r2, #K_POSITION]
        ssat    r3, #15, r3
        lsls    r3, r3, #2
        add     r3, r3, #32768
        usat    r3, #16, r3             @ beyond half a turn it stays at the end
        ldr     r12, =words0
        strh    r3, [r12, #2 * NTH]
        ldr     r3, [r2, #K_SPEED]
        rsb     r1, r3, r1, lsl #10
        add     r3, r3, r1, asr #6
        str     r3, [r2, #K_SPEED]
        movs    r3, #0
        str     r3, [r2, #K_AGE]
        .if     KNOBS > 1
        b       6f
        .else
        movs    r1, #0
        bx      lr
        .endif
4:      ldr     r1, [r2, #K_WRONG]
        ldr     r3, [r2, #K_AGE]
        adds    r1, #1
        adds    r3, #1
        str     r1, [r2, #K_WRONG]
        str     r3, [r2, #K_AGE]
        movw    r1, #AGE_WRONG
        cmp     r3, r1
        bls     6f
5:      movs    r1, #FAULT_SENSOR
        .if     KNOBS > 1
        bl      disable
        .else
        b       disable
        .endif
6:
        .set    NTH, NTH + 1
        .endr
9:      movs    r1, #0
        .if     KNOBS > 1
        pop     {r4, pc}
        .else
        bx      lr
        .endif
        .ltorg

@ The drive words are in place. A word that is positive is against the angle (the signs of the factors say so).
        .global board_end
        .type   board_end, %function
board_end:
        .if     KNOBS > 1
        push    {lr}
        .endif
        .set    NTH, 0
        .rept   KNOBS
        .if     NTH == 0
        .set    PAIR, SLICE_PAIR
        .set    SINGLE, SLICE_SINGLE
        .set    SHIFT, SINGLE_SHIFT
        .endif
        .if     NTH == 1
        .set    PAIR, SLICE_PAIR_1
        .set    SINGLE, SLICE_SINGLE_1
        .set    SHIFT, SINGLE_SHIFT_1
        .endif
        .if     NTH == 2
        .set    PAIR, SLICE_PAIR_2
        .set    SINGLE, SLICE_SINGLE_2
        .set    SHIFT, SINGLE_SHIFT_2
        .endif
        .if     NTH == 3
        .set    PAIR, SLICE_PAIR_3
        .set    SINGLE, SLICE_SINGLE_3
        .set    SHIFT, SINGLE_SHIFT_3
        .endif
        ldr     r3, =words0 + DISTANCE0
        ldr     r2, =knob + 64 * NTH
        ldrsh   r0, [r3, #2 * NTH]
        ldr     r1, [r2, #K_DRIVE]
        ldr     r3, [r2, #K_GAIN]
        str     r0, [r2, #K_DRIVE]
        sub     r1, r0, r1
        smull   r0, r12, r0, r3
        ldr     r3, [r2, #K_LEAD]
        smlal   r0, r12, r1, r3
        ldr     r1, [r2, #K_SPEED]
        ldr     r3, [r2, #K_BACK]
        smlal   r0, r12, r1, r3
        lsl     r12, r12, #4
        orr     r12, r12, r0, lsr #28
        ssat    r1, #14, r12
        ldr     r0, [r2, #K_FRAME_ANGLE]
        ldr     r3, [r2, #K_TURN]
        ldr     r2, [r2, #K_OFFSET]
        mla     r0, r0, r3, r2
        ldr     r3, =sines
        ubfx    r0, r0, #6, #10
        ldrsh   r12, [r3, r0, lsl #1]
        addw    r0, r0, #SECOND
        ldrsh   r0, [r3, r0, lsl #1]
        ldr     r3, =PWM_MIDDLE << 18 | 1 << 17
        mla     r12, r12, r1, r3
        mla     r0, r0, r1, r3
        ldr     r1, =PWM
        lsr     r12, r12, #18
        lsrs    r0, r0, #18
        movw    r3, #3 * PWM_MIDDLE
        sub     r3, r3, r12
        subs    r3, r3, r0
        orr     r12, r12, r0, lsl #16
        .if     SHIFT
        lsls    r3, r3, #SHIFT
        .endif
        str     r12, [r1, #20 * PAIR + 0xc]
        str     r3, [r1, #20 * SINGLE + 0xc]
        .set    NTH, NTH + 1
        .endr
        ldr     r1, =0xd0000000
        ldr     r0, [r1, #4]            @ SIO: GPIO_IN
        tst     r0, #1 << PIN_FAULT
        .if     KNOBS > 1
        bne     1f
        movs    r1, #FAULT_DRIVER
        bl      disable
1:      pop     {pc}
        .else
        it      ne
        bxne    lr
        movs    r1, #FAULT_DRIVER
        b       disable
        .endif
        .ltorg

@ At the start. R0: an electrical angle, of 65536 a turn; R1: an amplitude, of 8192 for what there is; R2: a row of knob_wires. Three
@ phases, and a look at the drivers.
        .global board_phases
        .type   board_phases, %function
board_phases:
        ldr     r3, =sines
        ubfx    r0, r0, #6, #10
        ldrsh   r12, [r3, r0, lsl #1]
        addw    r0, r0, #SECOND
        ldrsh   r0, [r3, r0, lsl #1]
        ldr     r3, =PWM_MIDDLE << 18 | 1 << 17
        mla     r12, r12, r1, r3
        mla     r0, r0, r1, r3
        lsr     r12, r12, #18
        lsrs    r0, r0, #18
        movw    r3, #3 * PWM_MIDDLE
        sub     r3, r3, r12
        subs    r3, r3, r0
        orr     r12, r12, r0, lsl #16
        ldr     r0, [r2, #8]
        lsls    r3, r3, r0
        ldr     r0, [r2]
        str     r12, [r0, #0xc]
        ldr     r0, [r2, #4]
        str     r3, [r0, #0xc]
        ldr     r1, =0xd0000000
        ldr     r0, [r1, #4]            @ SIO: GPIO_IN
        tst     r0, #1 << PIN_FAULT
        it      ne
        bxne    lr
        movs    r1, #FAULT_DRIVER

@ R1: a fault. All drivers have one enable: they are disabled, and stay so. R0 stays.
disable:
        ldr     r2, =0xd0000000
        mov     r3, #1 << PIN_ENABLE
        str     r3, [r2, #0x20]         @ GPIO_OUT_CLR
        ldr     r2, =core0
        ldr     r3, [r2, #C_FAULTS]
        orrs    r3, r1
        str     r3, [r2, #C_FAULTS]
        movs    r1, #0
        bx      lr
        .ltorg
