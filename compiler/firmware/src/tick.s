@ The converter's interrupt: one tick of this core's keys. Assembled once for each core, with its KEYS and its block.
@
@   board_begin -> [a tick was missed, another program: silence] -> keys -> board_end -> service of every 16th key, guard of one
@
@ R4 is the core's block (cores.s), then R10 this tick's sensor words; drive words lie DISTANCE behind.
        .syntax unified
        .thumb
        .section .text.frame, "ax"
        .global tick
        .type   tick, %function
tick:   push    {r4-r11, lr}
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
        add     r1, r4, r1, lsl #2
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
        ldr     r10, [r4, #C_ROW]
        .if     PORTS
        b       ports
        .else
        b       service
        .endif
