@ Passivity: what each key's motor may give, where the device limits it (PAST is not 0). In every tick, for every key:
@
@   stored += (drive + damping * way) * way        what came in, in drive words times sensor words; never above 0
@   if energy goes out: gain = min(gain, (stored + CREDIT) >> CREDIT_SHIFT)
@
@ The drive word is the one that acted while the key went that way, PAST ticks ago; damping is the key's own, which takes what
@ a motor gives. Gains come back by the service, so a key that takes energy again has force again (docs/firmware.md).
@
@   ledger | where in the past | stored, last sensor word of each key | drive words of PAST ticks, a row each |
        .syntax unified
        .thumb
        .section .text.frame, "ax"
        .if     PAST
passivity:
        ldr     r6, =ledger
        ldr     r8, [r4, #C_GAINS]
        ldr     r5, [r6], #4
        movw    r0, #2 * KEYS
        movw    r1, #2 * KEYS * PAST
        add     r5, r5, r0
        cmp     r5, r1
        it      hs
        movhs   r5, #0
        str     r5, [r6, #-4]
        movw    r1, #8 * KEYS
        add     r5, r5, r6
        ldr     r12, =CREDIT
        add     r5, r5, r1              @ the oldest row: this tick's drive words take its place
        movw    r9, #DAMPING
        mov     r7, r10
        mov     lr, #KEYS
@! rounds KEYS
1:      ldrh    r0, [r7], #2
        ldrh    r1, [r6, #4]
        ldrsh   r2, [r5]
        ldrsh   r3, [r7, #DISTANCE - 2]
        strh    r0, [r6, #4]
        subs    r0, r0, r1              @ the way since the last tick
        strh    r3, [r5], #2
        mul     r1, r0, r9
        ldr     r3, [r6]
        ssat    r0, #16, r0
        add     r2, r2, r1, asr #8
        .if     ZONES == 0
        ldr     r11, [r8]
        .endif
        ssat    r2, #16, r2
        mul     r1, r2, r0              @ what came in, or went out
        .if     ZONES
        ldr     r0, [r8], #8
        .endif
        qadd    r3, r3, r1
        cmp     r1, #0
        and     r3, r3, r3, asr #31
        .if     ZONES
        ldr     r11, [r0, #GAIN]
        .endif
        str     r3, [r6], #8
        add     r3, r3, r12
        usat    r3, #17, r3, asr #CREDIT_SHIFT
        it      ge
        movge   r3, r11
        cmp     r3, r11
        it      lo
        .if     ZONES
        strlo   r3, [r0, #GAIN]
        .else
        strlo   r3, [r8]
        add     r8, r8, #RECORD
        .endif
        subs    lr, #1
        bne     1b
        .endif
