@ Capture at tick rate, for the monitor (monitor.s): a row of words in each tick, into a ring in memory that nobody else uses.
@
@   row | number of the tick | sensor word and drive word of up to four keys | up to four words of memory |
@   ring: rows from V_START to V_END; the trigger says in which tick it stops, so it holds what was before it too
@
@ All eight places are written in every row, those that are not wanted over those of the next one: so a tick takes as long whatever is
@ captured. Between its rows the ring is the monitor's, which changes nothing here while V_NEXT is not 0.
        .syntax unified
        .thumb
        .section .text.frame, "ax"

@ R4: the core's block, which is kept. Called when the drive words are in place.
        .type   capture, %function
capture:
        ldr     r5, =captured
        ldr     r6, [r5, #V_NEXT]
        cmp     r6, #0
        beq     9f
        .if     EMPTIES                 @ what is captured of a program that begins begins with its first key
        ldr     r0, [r4, #C_CODE]
        ldr     r1, =emptying
        cmp     r0, r1
        beq     9f
        .endif
        ldr     r0, [r4, #C_TICK]
        str     r0, [r6]
        ldr     r7, [r4, #C_ROW]
        ldr     r0, =DISTANCE
        .set    NTH, 0
        .rept   CAPTURED
        ldr     r1, [r5, #V_KEYS + 4 * NTH]
        adds    r1, r1, r7
        ldrh    r2, [r1]
        ldrh    r3, [r1, r0]
        lsls    r3, r3, #16
        orrs    r2, r3
        str     r2, [r6, #4 + 4 * NTH]
        .set    NTH, NTH + 1
        .endr
        ldr     r7, [r5, #V_CELLS_AT]
        adds    r7, r7, r6
        .set    NTH, 0
        .rept   CAPTURED
        ldr     r1, [r5, #V_CELLS + 4 * NTH]
        ldr     r2, [r1]
        str     r2, [r7, #4 * NTH]
        .set    NTH, NTH + 1
        .endr
        ldr     r7, [r5, #V_STRIDE]
        ldr     r1, [r5, #V_END]
        adds    r7, r7, r6
        cmp     r7, r1
        blo     1f
        ldr     r7, [r5, #V_START]
1:      ldr     r0, [r4, #C_TICK]
        ldr     r1, [r5, #V_MODE]
        cmp     r1, #WAITS
        beq     8f
        cmp     r1, #TRIGGERED
        beq     2f
        ldr     r2, [r5, #V_WORD]       @ a word of this row, as a number that rises without a sign
        ldr     r2, [r6, r2]
        ldr     r3, [r5, #V_SHIFT]
        lsls    r2, r3
        ldr     r3, [r5, #V_FLIP]
        eors    r2, r3
        ldr     r3, [r5, #V_LEVEL]
        cmp     r2, r3
        bhs     3f
        movs    r1, #WAITS_OVER         @ below it: from now on it may go over
        str     r1, [r5, #V_MODE]
        b       8f
3:      cmp     r1, #WAITS_OVER
        bne     8f
        movs    r1, #TRIGGERED
        str     r1, [r5, #V_MODE]
        ldr     r1, [r5, #V_POST]
        str     r0, [r5, #V_AT]
        adds    r1, r1, r0
        str     r1, [r5, #V_STOP]
2:      ldr     r1, [r5, #V_STOP]
        subs    r1, r0, r1
        bmi     8f
        str     r7, [r5, #V_LAST]       @ the oldest row, or where there was none yet
        movs    r7, #0
8:      str     r7, [r5, #V_NEXT]
9:      bx      lr
        .ltorg
