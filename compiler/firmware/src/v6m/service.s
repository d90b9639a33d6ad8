@ Heat and gain on a Cortex-M0+, for every sixteenth key of the core: as firmware/service.s, which says what happens.
        .syntax unified
        .thumb
        .section .text.frame, "ax"
service:
        ldr     r0, [r4, #C_TICK]
        movs    r1, #15
        ands    r0, r1                  @ the first of this turn's keys
        ldr     r6, [r4, #C_GUARDS]
        lsls    r2, r0, #4
        adds    r6, r6, r2
        ldr     r7, [r4, #C_GAINS]
        .if     ZONES
        lsls    r1, r0, #3
        .else
        .if     RECORD > 255
        ldr     r1, =RECORD
        .else
        movs    r1, #RECORD
        .endif
        muls    r1, r0, r1
        .endif
        adds    r7, r7, r1
        ldr     r5, [r4, #C_ROW]
        lsls    r1, r0, #1
        adds    r5, r5, r1
        ldr     r1, =DISTANCE
        adds    r5, r5, r1              @ its drive word
        .set    NTH, 0
        .rept   (KEYS + 15) / 16
        .if     NTH + 15 > KEYS - 1
        cmp     r0, #KEYS - NTH
        bge     9f
        .endif
        movs    r1, #0
        ldrsh   r1, [r5, r1]
        ldr     r2, [r6, #G_HEAT]
        muls    r1, r1, r1
        ldr     r3, =RATED2
        subs    r1, r1, r3
        asrs    r1, r1, #HEAT_SHIFT
        adds    r2, r2, r1
        asrs    r3, r2, #31
        bics    r2, r3                  @ never below 0, nor above 30 bits
        ldr     r3, =0x3fffffff
        cmp     r2, r3
        bls     1f
        mov     r2, r3
1:      str     r2, [r6, #G_HEAT]
        .if     ZONES
        ldr     r1, [r7]
        ldr     r2, [r1, #GAIN]
        .else
        ldr     r2, [r7]
        .endif
        ldr     r3, =STEP
        adds    r2, r2, r3
        ldr     r3, [r6, #G_CEILING]
        cmp     r2, r3
        bls     2f
        mov     r2, r3
        .if     ZONES
2:      str     r2, [r1, #GAIN]
        .else
2:      str     r2, [r7]
        .endif
        .if     NTH + 16 < KEYS
        adds    r5, #32
        adds    r6, #128
        adds    r6, #128
        .if     ZONES
        adds    r7, #128
        .else
        ldr     r1, =16 * RECORD
        adds    r7, r7, r1
        .endif
        .endif
        .set    NTH, NTH + 16
        .endr
9:      b       guard
        .ltorg
