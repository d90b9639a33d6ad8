@ What each core keeps of its keys, the converter's buffers, and what the outside may read.
@
@   words   | sensor words of all keys | drive words | sensor words | drive words |      two halves, 2 * DISTANCE apart
        .syntax unified
        .thumb
        .section .data.shared.cores, "aw"
        .balign 4
        .global status, core0, core1, alarm
status: .ascii  "WHIP"
        .word   1                       @ version of this table
        .word   0                       @ S_FAULTS: see docs/firmware.md
        .word   core0, core1
        .word   mailbox
core0:  .word   core0_tick, core0_state
        .word   words, words + 2 * DISTANCE
        .word   KEYS0, core0_state + GAINS0, guards0
        .word   0, 0, 0, 0, -1, 0       @ tick, alarm, missed, faults, the key that is faulty, turn
        .word   0, 0, RAMP              @ its first key, this tick's row, ticks of ramps that are left
core1:  .word   core1_tick, core1_state
        .word   words + 2 * KEYS0, words + 2 * DISTANCE + 2 * KEYS0
        .word   KEYS1, core1_state + GAINS1, guards1
        .word   0, 0, 0, 0, -1, 0
        .word   KEYS0, 0, RAMP
alarm:  .word   0                       @ goes up with every missed tick of either core

        .section .bss.shared.words, "aw", %nobits
        .balign 4
        .global words
words:  .space  4 * DISTANCE

        .section .bss.guards, "aw", %nobits
        .balign 4
        .global guards0, guards1
guards0: .space 16 * KEYS0
        .section .bss.core1.guards, "aw", %nobits
        .balign 4
guards1: .space 16 * KEYS1

@ Every key may have full force, after the ramp; the keys' own state comes from the compiler.
        .section .text.start, "ax"
        .global start_keys
        .type   start_keys, %function
start_keys:                             @ R1: which half holds sensor words
        push    {r1, lr}
        ldr     r4, =core0
        bl      free_keys
        ldr     r2, =core0_init         @ keeps no register; in RAM, beyond a branch
        blx     r2
        ldr     r1, [sp]
        ldr     r4, =core1
        bl      free_keys
        ldr     r2, =core1_init
        blx     r2
        pop     {r1, pc}

@ Gains 0, ceilings 1, for the core at R4. R0: its state, R1: its sensor words of the half in R1.
free_keys:
        add     r5, r4, r1, lsl #2
        ldr     r0, [r4, #C_GUARDS]
        ldr     r1, [r4, #C_GAINS]
        ldr     r2, [r4, #C_KEYS]
        mov     r3, #65536
        mov     r12, #0
2:      str     r3, [r0, #G_CEILING]
        adds    r0, #16
        str     r12, [r1], #RECORD
        subs    r2, #1
        bne     2b
        ldr     r1, [r5, #C_ROWS]
        ldr     r0, [r4, #C_STATE]
        bx      lr
