@ Heat and gain, for every sixteenth key of the core: each key has its turn once in 16 ticks.
@
@   heat += drive^2 - rated^2, never below 0        in units of 2^HEAT_SHIFT squared drive words
@   gain -> ceiling, down at once, up by STEP       so that force comes back over 20 ms
@
@ With a drive word of 32767 for the peak current, a coil that was cool reaches HEAT_MAX after the motor's peak time; what follows
@ from that is the guard's.
        .syntax unified
        .thumb
        .section .text.frame, "ax"
service:
        ldr     r0, [r4, #C_TICK]
        ldr     r6, =guards
        ldr     r7, [r4, #C_GAINS]
        and     r0, r0, #15             @ the first of this turn's keys
        .if     ZONES == 0
        movw    r1, #RECORD
        .endif
        ldr     r9, =RATED2
        ldr     r5, =STEP
        add     r6, r6, r0, lsl #4
        .if     ZONES
        add     r7, r7, r0, lsl #3
        .else
        mla     r7, r0, r1, r7
        .endif
        add     r8, r10, r0, lsl #1
        .set    NTH, 0
        .set    BASE, 0                 @ where R7 is, from the first key's record on
        .rept   (KEYS + 15) / 16
        .if     NTH + 15 > KEYS - 1
        cmp     r0, #KEYS - NTH
        bge     9f
        .endif
        ldrsh   r12, [r8, #DISTANCE + 2 * NTH]
        ldr     r1, [r6, #16 * NTH + G_HEAT]
        ldr     r3, [r6, #16 * NTH + G_CEILING]
        .if     ZONES
        ldr     r11, [r7, #8 * NTH]
        .endif
        mul     r12, r12, r12
        .if     ZONES
        ldr     r2, [r11, #GAIN]
        .else
        .if     RECORD * NTH - BASE > 4095
        movw    r11, #RECORD * NTH - BASE
        add     r7, r7, r11
        .set    BASE, RECORD * NTH
        .endif
        ldr     r2, [r7, #RECORD * NTH - BASE]
        .endif
        sub     r12, r12, r9
        add     r2, r2, r5
        add     r1, r1, r12, asr #HEAT_SHIFT
        cmp     r2, r3
        it      hi
        movhi   r2, r3
        usat    r1, #30, r1
        .if     ZONES
        str     r2, [r11, #GAIN]
        .else
        str     r2, [r7, #RECORD * NTH - BASE]
        .endif
        str     r1, [r6, #16 * NTH + G_HEAT]
        .set    NTH, NTH + 16
        .endr
9:
