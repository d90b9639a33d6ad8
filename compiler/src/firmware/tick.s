@ The converter's interrupt: one tick of this core's keys. Assembled once for each core, with its KEYS and its block.
@
@   board_begin -> [a tick was missed: silence] -> keys -> board_end -> service of every 16th key, guard of one
@
@ R4 is the core's block (cores.s), then R10 this tick's sensor words; drive words lie DISTANCE behind.
        .syntax unified
        .thumb
        .section .text.frame, "ax"
        .global tick
        .type   tick, %function
tick:   push    {r4-r11, lr}
        bl      board_begin             @ R0: number of this tick, R1: which half of the buffers
        ldr     r4, =block
        ldr     r5, =alarm
        ldr     r2, [r4, #C_TICK]
        ldr     r3, [r4, #C_ALARM]
        ldr     r5, [r5]
        str     r0, [r4, #C_TICK]
        adds    r2, #1
        add     r1, r4, r1, lsl #2
        cmp     r0, r2
        bne     missed
        cmp     r3, r5                  @ the other core missed one
        bne     alarmed
        ldr     r1, [r1, #C_ROWS]
        ldr     r3, [r4, #C_CODE]
        ldr     r0, [r4, #C_STATE]
        str     r1, [r4, #C_ROW]
@! targets keys_tick
        blx     r3                      @ keeps no register
        bl      board_end
        ldr     r4, =block
        ldr     r10, [r4, #C_ROW]
        b       service

@ At least one tick was missed. All forces of both cores become zero and come back over the ramp; this tick's keys are left out.
missed: cmp     r2, #1                  @ the first tick that this core is given may have any number
        beq     alarmed
        subs    r0, r2
        ldr     r2, [r4, #C_MISSED]
        adds    r2, r0
        str     r2, [r4, #C_MISSED]
        ldr     r2, [r4, #C_FAULTS]
        orr     r2, r2, #FAULT_MISSED
        str     r2, [r4, #C_FAULTS]
        ldr     r2, =alarm
        adds    r5, #1
        str     r5, [r2]
alarmed:
        str     r5, [r4, #C_ALARM]
        movw    r0, #RAMP
        str     r0, [r4, #C_RAMP]
        ldr     r0, [r4, #C_ROWS]       @ drive words of both halves
        ldr     r1, [r4, #C_ROWS + 4]
        ldr     r3, [r4, #C_GAINS]
        movs    r2, #KEYS
        movs    r5, #0
@! rounds KEYS
1:      strh    r5, [r0, #DISTANCE]
        strh    r5, [r1, #DISTANCE]
        str     r5, [r3], #RECORD
        adds    r0, #2
        adds    r1, #2
        subs    r2, #1
        bne     1b
        bl      board_end
        pop     {r4-r11, pc}
