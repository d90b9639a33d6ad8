@ Captures, for the monitor: what may be captured, and which captures belong together; where each core's is. On core 0, between ticks.
        .syntax unified
        .thumb
        .section .text.firmware.monitor, "ax"

@ Whether R1 words (less than 2^28) from R0 on lie in memory of the chip: equal where they do. Changes R2, R3, R6 and R7.
        .global in_memory
        .type   in_memory, %function
in_memory:
        lsls    r2, r0, #30
        bne     3f
        ldr     r2, =monitor_memory
        ldr     r3, [r2]
1:      ldr     r6, [r2, #4]            @ base, bytes
        subs    r6, r0, r6
        ldr     r7, [r2, #8]
        cmp     r6, r7
        bhs     2f
        subs    r7, r7, r6
        lsrs    r7, r7, #2
        cmp     r1, r7
        bls     4f
2:      adds    r2, #8
        subs    r3, #1
        bne     1b
        movs    r2, #1                  @ not equal
3:      bx      lr
4:      cmp     r2, r2
        bx      lr

@ R0: 0 where the words of a capture's setting at R5 are within their limits, 2 or 6 otherwise; R7 as above.
        .global judge
        .type   judge, %function
judge:  push    {r7, lr}
        ldr     r2, [r7, #8]
        ldr     r3, [r7, #12]
        subs    r3, r3, r2
        bls     7f
        ldr     r0, [r5, #V_BYTES - V_SETTING]
        subs    r3, #ROW_MAX
        bmi     7f
        cmp     r0, r3
        bhi     7f
        ldr     r6, =monitor_limits
        movs    r1, #0
1:      ldr     r2, [r5, r1]
        ldr     r0, [r6]                @ the most, and bits that must be 0
        cmp     r2, r0
        bhi     7f
        ldr     r0, [r6, #4]
        tst     r2, r0
        bne     7f
        adds    r6, #8
        adds    r1, #4
        cmp     r1, #4 * SETTING
        bne     1b
        movs    r0, #0
2:      movs    r1, r5                  @ its words of memory
        adds    r1, #V_CELLS - V_SETTING
        mov     r12, r0
        ldr     r0, [r1, r0]
        movs    r1, #1
        bl      in_memory
        bne     8f
        mov     r0, r12
        adds    r0, #4
        cmp     r0, #4 * CAPTURED
        bne     2b
        movs    r0, #0
        pop     {r7, pc}
7:      movs    r0, #2
        pop     {r7, pc}
8:      movs    r0, #6
        pop     {r7, pc}

@ Captures of both cores that belong together: what one was triggered by triggers the other one.
        .if     CORES > 1
        .global follow
        .type   follow, %function
follow: ldr     r0, =captured0
        ldr     r1, =captured1
        ldr     r2, [r0, #V_GROUP]
        ldr     r3, [r1, #V_GROUP]
        cmp     r2, r3
        bne     9f
        cmp     r2, #0                  @ its setting is on its way
        beq     9f
        ldr     r2, [r0, #V_MODE]
        ldr     r3, [r1, #V_MODE]
        cmp     r2, r3
        beq     9f
        cmp     r2, #TRIGGERED
        beq     1f
        cmp     r3, #TRIGGERED
        bne     9f
        cmp     r2, #WAITS
        bne     9f
        ldr     r2, [r0, #V_NEXT]
        cmp     r2, #0
        beq     9f
        ldr     r2, [r1, #V_AT]
        ldr     r3, [r1, #V_STOP]
        b       2f
1:      cmp     r3, #WAITS
        bne     9f
        ldr     r2, [r1, #V_NEXT]
        cmp     r2, #0
        beq     9f
        ldr     r2, [r0, #V_AT]
        ldr     r3, [r0, #V_STOP]
        mov     r0, r1
2:      str     r2, [r0, #V_AT]
        str     r3, [r0, #V_STOP]
        dmb     sy
        movs    r2, #TRIGGERED
        str     r2, [r0, #V_MODE]
9:      bx      lr
        .endif
        .ltorg

@ What each core captures, beside what else it uses in a tick.
        .section .bss.near.core0.captured, "aw", %nobits
        .balign 4
        .global captured0
captured0: .space V_BLOCK
        .if     CORES > 1
        .section .bss.near.core1.captured, "aw", %nobits
        .balign 4
        .global captured1
captured1: .space V_BLOCK
        .endif
