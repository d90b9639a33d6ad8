@ A tick of keys with their safety, for a program of somebody else's: the frame of a tick (tick.s, alarm.s) without converter, other
@ programs and another core. service.s, passivity.s and guard.s follow, as they are.
@
@   safe_init    prepares the keys, takes all force away, forgets faults
@   safe_tick    R0: number of this tick. keys -> service of every 16th key -> passivity -> guard of one;
@                where it is not the next number, no key is ticked: forces go to zero and come back over the ramp
@
@ In instructions that all cores have.
        .syntax unified
        .thumb
        .section .text.frame, "ax"
        .global safe_init, safe_tick
        .type   safe_init, %function
safe_init:
        push    {r4-r6, lr}
        ldr     r0, =state
        bl      keys_init
        ldr     r4, =block
        movs    r5, #0
        str     r5, [r4, #C_TICK]
        str     r5, [r4, #C_MISSED]
        str     r5, [r4, #C_FAULTS]
        str     r5, [r4, #C_TURN]
        mvns    r0, r5
        str     r0, [r4, #C_FAULTY]
        ldr     r0, =guards
        ldr     r2, =KEYS
        ldr     r3, =65536
@! rounds KEYS
1:      str     r5, [r0, #G_HEAT]
        str     r3, [r0, #G_CEILING]
        str     r5, [r0, #G_WORD]
        str     r5, [r0, #G_SINCE]
        adds    r0, #16
        subs    r2, #1
        bne     1b
        .if     PAST
        ldr     r0, =ledger
        ldr     r2, =LEDGER_WORDS
@! rounds LEDGER_WORDS
2:      str     r5, [r0]
        adds    r0, #4
        subs    r2, #1
        bne     2b
        .endif
        bl      let_go
        pop     {r4-r6, pc}

@ Drive words and gains of all keys become zero, and force comes up.
let_go: ldr     r0, =RAMP
        str     r0, [r4, #C_RAMP]
        ldr     r0, [r4, #C_ROW]
        ldr     r3, [r4, #C_GAINS]
        ldr     r2, =DISTANCE
        adds    r0, r0, r2
        movs    r2, #KEYS
        movs    r5, #0
        .if     RECORD > 255
        ldr     r6, =RECORD
        .endif
@! rounds KEYS
1:      strh    r5, [r0]
        str     r5, [r3]
        adds    r0, #2
        .if     RECORD > 255
        adds    r3, r3, r6
        .else
        adds    r3, #RECORD
        .endif
        subs    r2, #1
        bne     1b
        bx      lr

missed: cmp     r2, #1                  @ the first tick may have any number
        beq     1f
        subs    r0, r0, r2
        ldr     r2, [r4, #C_MISSED]
        adds    r2, r2, r0
        str     r2, [r4, #C_MISSED]
        ldr     r2, [r4, #C_FAULTS]
        movs    r0, #FAULT_MISSED
        orrs    r2, r0
        str     r2, [r4, #C_FAULTS]
1:      bl      let_go
        b       leave
        .ltorg

        .type   safe_tick, %function
safe_tick:
        .if     SMALL
        push    {r4-r7, lr}
        mov     r6, r10
        mov     r7, r11
        push    {r6, r7}
        .else
        push    {r4-r11, lr}
        .endif
        ldr     r4, =block
        ldr     r2, [r4, #C_TICK]
        str     r0, [r4, #C_TICK]
        adds    r2, #1
        cmp     r0, r2
        bne     missed
        ldr     r0, =state
        bl      keys_tick
        ldr     r4, =block
        .if     SMALL == 0
        ldr     r10, [r4, #C_ROW]
        .endif
        b       service
        .ltorg

        .section .data.frame.block, "aw"
        .balign 4
        .global block
        .type   block, %object
block:  .word   0, state                @ as a core's block (cores.s)
        .word   state + INPUTS, state + INPUTS
        .word   KEYS, state + GAINS, guards
        .word   0, 0, 0, 0, -1, 0
        .word   0, state + INPUTS, RAMP
        .size   block, C_RAMP + 4

        .section .bss.frame.guards, "aw", %nobits
        .balign 4
guards: .space  16 * KEYS

        .if     PAST
        .section .bss.frame.ledger, "aw", %nobits
        .balign 4
ledger: .space  4 * LEDGER_WORDS
        .endif
