@ Sensors: from a converter's word to the word that the program reads, and the tuning that finds how. In instructions that all
@ cores have, but for the loop over all keys.
@
@   word --* gain + offset--> where in the table, 16 bits --table of 256 pieces--> word of the position
@
@   tuned   | offset, gain of each key |       1 is 2^13                curve   | 257 words |
@   watched | readings so far, at most 5 | at rest | least | greatest | the last four |    16 bytes a key
@
@ While sensors are tuned (whippen_tune), `watch` is called in place of the keys: no drive word is written, all stay zero. One key
@ has its turn each tick, the one whose guard had its turn last. Of its last five readings the median counts, so that two wrong ones
@ in a row change nothing. The first one says at which of its ends the key rests.
        .syntax unified
        .thumb
        .section .text.frame, "ax"
        .if     TUNING

@ All sensor words at R1, with the core's block in R4; not while they are tuned. Keeps no register. A word at a rail stays what it
@ is, so that the guard finds it; others never become one, since no word of the table is one.
        .type   linearise, %function
        .global linearise
linearise:
        ldr     r0, [r4, #C_CODE]
        ldr     r2, =watch
        ldr     r5, =tuned
        ldr     r7, =curve
        cmp     r0, r2
        beq     9f
        ldr     r4, =65534
        movs    r6, #KEYS
@! rounds KEYS
1:      ldrh    r0, [r1]
        ldmia   r5!, {r2, r3}
        .if     SMALL
        muls    r3, r0, r3
        adds    r2, r2, r3
        asrs    r2, r2, #13
        asrs    r3, r2, #31
        bics    r2, r3
        lsrs    r3, r2, #16
        beq     3f
        adds    r2, r4, #1
3:      subs    r3, r0, #1
        cmp     r3, r4
        bhs     2f
        lsrs    r0, r2, #8
        uxtb    r2, r2
        lsls    r0, r0, #1
        adds    r0, r7, r0
        ldrh    r3, [r0, #2]
        ldrh    r0, [r0]
        subs    r3, r3, r0
        muls    r2, r3, r2
        asrs    r2, r2, #8
        adds    r0, r0, r2
        .else
        mla     r2, r0, r3, r2
        subs    r3, r0, #1
        cmp     r3, r4
        bhs     2f
        usat    r2, #16, r2, asr #13
        lsrs    r0, r2, #8
        uxtb    r2, r2
        add     r0, r7, r0, lsl #1
        ldrh    r3, [r0, #2]
        ldrh    r0, [r0]
        subs    r3, r3, r0
        muls    r2, r3, r2
        add     r0, r0, r2, asr #8
        .endif
        strh    r0, [r1]
2:      adds    r1, #2
        subs    r6, #1
        bne     1b
9:      bx      lr

@ No key has read anything. Keeps R4.
forget: ldr     r0, =watched
        movs    r1, #0
        movs    r2, #KEYS
@! rounds KEYS
1:      strh    r1, [r0]
        adds    r0, #16
        subs    r2, #1
        bne     1b
        bx      lr

@ In place of the keys: the reading of one, with the words at R1 and the block in R4. Keeps no register.
        .type   watch, %function
watch:  ldr     r0, =RAMP               @ no sensor is judged, and force comes back over the whole ramp
        ldr     r6, [r4, #C_TURN]
        str     r0, [r4, #C_RAMP]
        ldr     r5, =watched
        lsls    r0, r6, #4
        adds    r5, r5, r0
        lsls    r0, r6, #1
        ldrh    r0, [r1, r0]
        ldrh    r1, [r5]
        cmp     r1, #4
        bhs     1f
        lsls    r2, r1, #1
        adds    r2, r5, r2
        strh    r0, [r2, #8]
        adds    r1, #1
        strh    r1, [r5]
        bx      lr
1:      ldrh    r1, [r5, #8]
        ldrh    r2, [r5, #10]
        ldrh    r3, [r5, #12]
        ldrh    r7, [r5, #14]
        strh    r2, [r5, #8]
        strh    r3, [r5, #10]
        strh    r7, [r5, #12]
        strh    r0, [r5, #14]
        cmp     r1, r2                  @ the median: the middle of R0 and, of two pairs, the greater least and the lesser greatest
        bls     2f
        mov     r4, r1
        mov     r1, r2
        mov     r2, r4
2:      cmp     r3, r7
        bls     3f
        mov     r4, r3
        mov     r3, r7
        mov     r7, r4
3:      cmp     r1, r3
        bhs     4f
        mov     r1, r3
4:      cmp     r2, r7
        bls     5f
        mov     r2, r7
5:      cmp     r1, r2
        bls     6f
        mov     r4, r1
        mov     r1, r2
        mov     r2, r4
6:      cmp     r0, r1
        bhs     7f
        mov     r0, r1
7:      cmp     r0, r2
        bls     8f
        mov     r0, r2
8:      ldrh    r1, [r5]
        cmp     r1, #4
        bne     1f
        adds    r1, #1
        strh    r1, [r5]
        strh    r0, [r5, #2]
        strh    r0, [r5, #4]
        strh    r0, [r5, #6]
1:      ldrh    r1, [r5, #4]
        ldrh    r2, [r5, #6]
        cmp     r0, r1
        bhs     2f
        mov     r1, r0
        strh    r1, [r5, #4]
2:      cmp     r0, r2
        bls     3f
        mov     r2, r0
        strh    r2, [r5, #6]
3:      subs    r3, r2, r1
        ldr     r7, =TABLE_SPAN
        lsls    r0, r3, #1
        adds    r0, r0, r3
        cmp     r0, r7
        blo     9f                      @ less than a third of the way that the table says: as before
        lsls    r7, r7, #13
        lsrs    r0, r3, #1
        adds    r0, r0, r7
        movs    r4, #0                  @ R4: the factor, below 2^15
        movs    r7, #15
        lsls    r3, r3, #14
@! rounds 15
4:      lsls    r4, r4, #1
        cmp     r0, r3
        blo     5f
        subs    r0, r0, r3
        adds    r4, #1
5:      lsrs    r3, r3, #1
        subs    r7, #1
        bne     4b
        ldrh    r0, [r5, #2]
        subs    r3, r0, r1
        subs    r0, r2, r0
        .if     TABLE_FALLS
        rsbs    r4, r4, #0
        .endif
        cmp     r3, r0
        blo     6f                      @ it rests at its least reading
        mov     r1, r2
        rsbs    r4, r4, #0
6:      ldr     r0, =tuned
        ldr     r2, =TABLE_REST
        lsls    r3, r6, #3
        adds    r0, r0, r3
        muls    r1, r4, r1
        subs    r2, r2, r1
        str     r2, [r0]
        str     r4, [r0, #4]
9:      bx      lr
        .ltorg
        .endif
