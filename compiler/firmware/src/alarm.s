@ Ticks that were missed, and those in which a program begins: what follows the beginning of a tick (tick.s) in place of the keys,
@ and what the frame calls in place of their code. In instructions that all cores have.
@
@   tick -> missed, alarmed: silence -> leave              tick -> [emptying ->] beginning -> service
@
@ Where some program has keys of several instruments on a core (ZONES), records have no common distance: C_GAINS is a table of them,
@ two words a key (tables.rs), and a key that has not begun is the end of its zone's chain.
        .syntax unified
        .thumb
        .section .text.frame, "ax"

@ At least one tick was missed. All forces of both cores become zero and come back over the ramp; this tick's keys are left out.
missed: cmp     r2, #1                  @ the first tick that this core is given may have any number
        beq     alarmed
        subs    r0, r0, r2
        ldr     r2, [r4, #C_MISSED]
        adds    r2, r2, r0
        str     r2, [r4, #C_MISSED]
        ldr     r2, [r4, #C_FAULTS]
        movs    r0, #FAULT_MISSED
        orrs    r2, r0
        str     r2, [r4, #C_FAULTS]
        ldr     r2, =alarm
        adds    r5, #1
        str     r5, [r2]
alarmed:
        str     r5, [r4, #C_ALARM]
        ldr     r0, =RAMP
        str     r0, [r4, #C_RAMP]
        ldr     r0, [r4, #C_WANTED]
        ldr     r1, [r4, #C_PROGRAM]
        cmp     r0, r1
        beq     1f
        .if     EMPTIES                 @ no key has begun: the chain of keys ends before the first
        ldr     r1, =emptying
        .else
        ldr     r1, =beginning
        .endif
        .if     TUNING
        ldr     r2, =tuning
        cmp     r0, r2
        bne     3f
        ldr     r1, =watch
3:
        .endif
        .if     EMPTIES                 @ what else stands in place of the keys is the program's, too
        ldr     r2, [r0, #P_LINES]
        str     r2, [r4, #C_PIECE]
        ldr     r2, [r2]
        str     r2, [r4, #C_SLOT]
        .endif
        ldr     r2, [r0, #P_STATE]
        ldr     r3, [r0, #P_GAINS]
        str     r0, [r4, #C_PROGRAM]
        str     r1, [r4, #C_CODE]
        str     r2, [r4, #C_STATE]
        str     r3, [r4, #C_GAINS]
        movs    r2, #0
        str     r2, [r4, #C_BEGUN]
        .if     ZONES
        movs    r2, #KEYS
@! rounds KEYS
2:      ldr     r0, [r3]
        ldr     r1, [r3, #4]
        ldr     r1, [r1]                @ what stands behind the zone's last key
        str     r1, [r0]
        adds    r3, #8
        subs    r2, #1
        bne     2b
        .else
        bl      chain_to
        .endif
        .if     TUNING
        bl      forget
        .endif
1:      ldr     r0, [r4, #C_ROWS]       @ drive words of both halves
        ldr     r1, [r4, #C_ROWS + 4]
        ldr     r3, [r4, #C_GAINS]
        ldr     r2, =DISTANCE
        adds    r0, r0, r2
        adds    r1, r1, r2
        .if     PORTS                   @ one gain is for all words
        movs    r2, #WORDS
        movs    r5, #0
        str     r5, [r3]
@! rounds WORDS
1:      strh    r5, [r0]
        strh    r5, [r1]
        .else
        movs    r2, #KEYS
        movs    r5, #0
        .if     RECORD > 255
        ldr     r6, =RECORD
        .endif
@! rounds KEYS
1:      strh    r5, [r0]
        strh    r5, [r1]
        .if     ZONES
        ldr     r6, [r3]
        adds    r3, #8
        str     r5, [r6, #GAIN]
        .else
        str     r5, [r3]
        .if     RECORD > 255
        adds    r3, r3, r6
        .else
        adds    r3, #RECORD
        .endif
        .endif
        .endif
        adds    r0, #2
        adds    r1, #2
        subs    r2, #1
        bne     1b
        bl      board_end
        b       leave

@ The keys of a program that begins: those that have begun play, and one more begins with its word of this tick.
        .type   beginning, %function
beginning:
        push    {lr}
        ldr     r2, [r4, #C_PROGRAM]
        ldr     r3, [r2, #P_TICK]
@! targets keys_tick
        blx     r3
        ldr     r4, =block
        ldr     r2, [r4, #C_BEGUN]
        ldr     r1, [r4, #C_ROW]
        ldr     r5, [r4, #C_PROGRAM]
        ldr     r0, [r4, #C_STATE]
        ldr     r3, [r5, #P_BEGIN]
        lsls    r5, r2, #1
        adds    r1, r1, r5
@! targets keys_begin
        blx     r3
        ldr     r4, =block
        ldr     r2, [r4, #C_BEGUN]
        ldr     r0, [r4, #C_PROGRAM]
        adds    r2, #1
        str     r2, [r4, #C_BEGUN]
        cmp     r2, #KEYS
        bhs     1f
        .if     ZONES == 0
        bl      chain_to
        .endif
        pop     {pc}
1:      ldr     r3, [r0, #P_TICK]       @ all play
        str     r3, [r4, #C_CODE]
        pop     {pc}

@ The chain of keys of the program at R0 ends before key R2: there stands what stands behind the last.
        .if     ZONES == 0
chain_to:
        ldr     r3, [r0, #P_END]
        ldr     r1, [r0, #P_RECORDS]
        .if     RECORD > 255
        ldr     r5, =RECORD
        .else
        movs    r5, #RECORD
        .endif
        muls    r5, r2, r5
        ldr     r3, [r3]
        adds    r1, r1, r5
        str     r3, [r1]
        bx      lr
        .endif
        .ltorg
