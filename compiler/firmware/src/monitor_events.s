@ Events, for the monitor: no MIDI is made of them, they are looked at one after the other and may trigger a capture. Run by the core
@ that makes MIDI elsewhere, between ticks.
        .syntax unified
        .thumb
        .equ    T_HEAD, 0
        .equ    T_TAIL, 4
        .section .text.core1.firmware.monitor, "ax"
        .global monitor_events
        .type   monitor_events, %function
monitor_events:
        push    {r4-r7, lr}
        ldr     r0, =core0
        ldr     r1, =captured0
        bl      look
        .if     CORES > 1
        ldr     r0, =core1
        ldr     r1, =captured1
        bl      look
        .endif
        pop     {r4-r7, pc}

@ The oldest event of the core at R0, whose capture is at R1.
look:   ldr     r2, [r0, #C_PROGRAM]
        ldr     r6, [r2, #P_READER]
        .if     ZONES
zone:
        .endif
        ldr     r5, [r6, #R_STATE]
        ldr     r7, [r5, #T_TAIL]
        ldr     r4, [r5, #T_HEAD]
        cmp     r7, r4
        beq     empty
        dmb     sy
        ldr     r3, [r6, #R_MASK]
        ldr     r2, [r6, #R_EVENTS]
        movs    r4, r3
        ands    r4, r7
        adds    r2, r2, r4              @ tick, key and event, arguments
        ldr     r4, [r2, #4]
        adds    r2, r4, #1
        beq     mark
        ldr     r3, [r6, #R_EVENT]
        adds    r7, r7, r3
        dmb     sy
        str     r7, [r5, #T_TAIL]
        ldr     r2, [r1, #V_EVENT]
        lsrs    r3, r2, #16
        lsrs    r5, r4, #16
        cmp     r3, r5
        bne     none
        uxth    r2, r2
        adds    r3, r2, #1
        lsrs    r3, r3, #16
        bne     1f                      @ of any key
        uxth    r4, r4
        cmp     r2, r4
        bne     none
1:      ldr     r2, [r1, #V_NEXT]
        cmp     r2, #0
        beq     none
        ldr     r2, [r1, #V_MODE]
        cmp     r2, #WAITS
        bne     none
        ldr     r2, [r0, #C_TICK]
        str     r2, [r1, #V_AT]
        ldr     r3, [r1, #V_POST]
        adds    r2, r2, r3
        str     r2, [r1, #V_STOP]
        dmb     sy
        movs    r2, #TRIGGERED
        str     r2, [r1, #V_MODE]
none:   bx      lr
mark:   orrs    r7, r3                  @ no event: the ring goes on at its beginning
        adds    r7, #1
        str     r7, [r5, #T_TAIL]
        bx      lr
empty:
        .if     ZONES
        ldr     r6, [r6, #R_NEXT]       @ the core's next zone
        cmp     r6, #0
        bne     zone
        .endif
        bx      lr
