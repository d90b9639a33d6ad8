@ The converter's interrupt on a Cortex-M0+: as firmware/tick.s, which says what happens.
        .syntax unified
        .thumb
        .section .text.frame, "ax"
        .global tick
        .type   tick, %function
tick:   push    {r4-r7, lr}
        mov     r6, r10
        mov     r7, r11
        push    {r6, r7}
        bl      board_begin             @ R0: number of this tick, R1: which half of the buffers
        .if     SOUND
        .if     CORE == 0
        bl      send_sound
        .endif
        .endif
        ldr     r4, =block
        .if     LATCH
        ldr     r2, [r4, #C_LATCH]
        cmp     r2, #0
        bne     latch
7:                                      @ latch.s comes back here
        .endif
        ldr     r5, =alarm
        ldr     r2, [r4, #C_TICK]
        ldr     r3, [r4, #C_ALARM]
        ldr     r5, [r5]
        str     r0, [r4, #C_TICK]
        adds    r2, #1
        lsls    r1, r1, #2
        adds    r1, r4, r1
        cmp     r0, r2
        bne     missed
        cmp     r3, r5                  @ the other core missed one, or another program is wanted
        bne     alarmed
        ldr     r1, [r1, #C_ROWS]
        .if     TUNING
        str     r1, [r4, #C_ROW]
        bl      linearise
        ldr     r4, =block
        ldr     r1, [r4, #C_ROW]
        ldr     r3, [r4, #C_CODE]
        ldr     r0, [r4, #C_STATE]
        .else
        ldr     r3, [r4, #C_CODE]
        ldr     r0, [r4, #C_STATE]
        str     r1, [r4, #C_ROW]
        .endif
@! targets keys_tick beginning emptying watch
        blx     r3                      @ keeps no register
        bl      board_end
        ldr     r4, =block
        .if     MONITOR
        bl      capture
        .endif
        .if     SUMS
        bl      sum_sound
        .endif
        .if     PORTS
        b       ports
        .else
        b       service
        .endif
