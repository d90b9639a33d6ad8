@ What is heard: a sample a tick for each channel, of all keys of all cores together.
@
@   end of tick n        each core: the sum of its keys' samples, in 64 bits, and n         sound0, sound1: half n mod 2
@   begin of tick n + 1  core 0:    the sums of both, clipped to full scale --> board_sound
@
@ In 64 bits no sum is ever rounded or clipped, so the order of keys and cores changes nothing. Core 0 reads what core 1 wrote a tick
@ ago; core 1 writes the other half meanwhile, and this one not before the tick after. A sum that is not of tick n counts as silence:
@ its core has missed that tick, or a program begins.
@
@   half | its tick | left, low and high | right, low and high |    32 bytes
        .syntax unified
        .thumb
        .section .text.frame, "ax"
        .if     SOUND
        .if     CORE == 0
@ Called with the tick in R0; keeps R0 and R1.
send_sound:
        push    {r0, r1, lr}
        subs    r5, r0, #1
        movs    r7, #1
        ands    r7, r5
        lsls    r7, r7, #5
        movs    r0, #0
        movs    r1, #0
        .if     SOUND > 1
        movs    r2, #0
        movs    r3, #0
        .endif
        ldr     r4, =sound0
        adds    r4, r4, r7
        ldr     r6, [r4]
        cmp     r6, r5
        bne     1f
        ldr     r0, [r4, #4]
        ldr     r1, [r4, #8]
        .if     SOUND > 1
        ldr     r2, [r4, #12]
        ldr     r3, [r4, #16]
        .endif
1:
        .if     CORES > 1
        ldr     r4, =sound1
        adds    r4, r4, r7
        ldr     r6, [r4]
        cmp     r6, r5
        bne     2f
        ldr     r6, [r4, #4]
        ldr     r7, [r4, #8]
        adds    r0, r0, r6
        adcs    r1, r7
        .if     SOUND > 1
        ldr     r6, [r4, #12]
        ldr     r7, [r4, #16]
        adds    r2, r2, r6
        adcs    r3, r7
        .endif
2:
        .endif
        bl      clip
        .if     SOUND > 1
        mov     r5, r0
        mov     r0, r2
        mov     r1, r3
        bl      clip
        mov     r1, r0
        mov     r0, r5
        .else
        mov     r1, r0
        .endif
        bl      board_sound
        pop     {r0, r1, pc}

@ The sum R1:R0 as a sample in R0. Uses R1, R4 and R6.
clip:   ldr     r4, =FULL_SCALE
        asrs    r6, r0, #31
        cmp     r6, r1
        bne     3f
        cmp     r0, r4
        bgt     5f
        rsbs    r4, r4, #0
        cmp     r0, r4
        blt     5f
        bx      lr
3:      cmp     r1, #0
        bpl     5f
        rsbs    r4, r4, #0
5:      mov     r0, r4
        ldr     r4, =core0
        ldr     r6, [r4, #C_CLIPPED]
        adds    r6, #1
        str     r6, [r4, #C_CLIPPED]
        bx      lr
        .endif

@ Called with the core's block in R4, when its keys have played; keeps R4. Where core 1 has what is heard, it writes the sum (parts.rs).
        .if     SUMS
sum_sound:
        ldr     r5, [r4, #C_PROGRAM]
        .if     BEGINS
        ldr     r0, [r4, #C_CODE]
        ldr     r1, [r5, #P_TICK]
        cmp     r0, r1
        bne     2f                      @ keys that have not begun hold samples of another time
        .endif
        ldr     r5, [r5, #P_SOUND]
        movs    r0, #0
        movs    r1, #0
        .if     SOUND > 1
        movs    r2, #0
        movs    r3, #0
        .endif
        movs    r6, #KEYS
@! rounds KEYS
1:      ldr     r7, [r5]
        ldr     r7, [r7]
        asrs    r4, r7, #31
        adds    r0, r0, r7
        adcs    r1, r4
        .if     SOUND > 1
        ldr     r7, [r5, #4]
        ldr     r7, [r7]
        asrs    r4, r7, #31
        adds    r2, r2, r7
        adcs    r3, r4
        .endif
        adds    r5, #4 * SOUND
        subs    r6, #1
        bne     1b
        ldr     r4, =block
        ldr     r7, [r4, #C_TICK]
        movs    r6, #1
        ands    r6, r7
        lsls    r6, r6, #5
        ldr     r5, =sound
        adds    r5, r5, r6
        str     r0, [r5, #4]
        str     r1, [r5, #8]
        .if     SOUND > 1
        str     r2, [r5, #12]
        str     r3, [r5, #16]
        .endif
        str     r7, [r5]
2:      bx      lr
        .endif
        .ltorg
        .endif
