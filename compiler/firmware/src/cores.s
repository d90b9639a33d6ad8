@ What each core keeps of its keys, the converter's buffers, and what the outside may read. What a core uses in each tick lies in
@ memory of its own ("near"), where nobody fetches and the other core seldom looks (running.rs counts how often).
@
@   wordsN  | sensor words of this core's keys | drive words | sensor words | drive words |   two halves, 2 * DISTANCEN apart
        .syntax unified
        .thumb
        .section .data.near.core0.block, "aw"
        .balign 4
        .global status, core0, alarm
status: .ascii  "WHIP"
        .word   2                       @ version of this table
        .word   0                       @ S_FAULTS: see docs/firmware.md
        .if     CORES > 1
        .word   core0, core1
        .else
        .word   core0, 0                @ there is no other
        .endif
        .word   mailbox
        .word   programs
core0:  .word   core0_tick, core0_state
        .word   words0, words0 + 2 * DISTANCE0
        .if     ZONES
        .word   KEYS0, core0_records, guards0
        .else
        .word   KEYS0, core0_state + GAINS0, guards0
        .endif
        .word   0, 0, 0, 0, -1, 0       @ tick, alarm, missed, faults, the key that is faulty, turn
        .word   0, 0, RAMP              @ its first key, this tick's row, ticks of ramps that are left
        .word   program0_core0, program0_core0, 0 @ the program that plays, the one that is wanted, keys that have begun
        .if     LATCH + SOUND + EMPTIES
        .word   0, 0, 0                 @ a live value that is set: its tick, its word, it
        .endif
        .if     SOUND + EMPTIES
        .word   0                       @ samples that were clipped
        .endif
        .if     EMPTIES
        .word   0, 0                    @ lines that are emptied: the piece, how far it is
        .endif
alarm:  .word   0                       @ goes up with every missed tick of either core

        .if     CORES > 1
        .section .data.near.core1.block, "aw"
        .balign 4
        .global core1
core1:  .word   core1_tick, core1_state
        .word   words1, words1 + 2 * DISTANCE1
        .if     ZONES
        .word   KEYS1, core1_records, guards1
        .else
        .word   KEYS1, core1_state + GAINS1, guards1
        .endif
        .word   0, 0, 0, 0, -1, 0
        .word   KEYS0, 0, RAMP
        .word   program0_core1, program0_core1, 0
        .if     LATCH + EMPTIES
        .word   0, 0, 0
        .endif
        .if     EMPTIES
        .word   0, 0, 0                 @ core 0 counts what is clipped
        .endif
        .endif

        .section .bss.near.core0.words, "aw", %nobits
        .balign 4
        .global words0
words0: .space  4 * DISTANCE0
        .if     CORES > 1
        .section .bss.near.core1.words, "aw", %nobits
        .balign 4
        .global words1
words1: .space  4 * DISTANCE1
        .endif

@ Sums of samples, of two ticks in turn (sound.s), and what is read of keys without sound.
        .if     SOUND
        .section .bss.near.core0.sound, "aw", %nobits
        .balign 4
        .global sound0, mute0
sound0: .space  64
mute0:  .space  4
        .if     CORES > 1
        .section .bss.near.core1.sound, "aw", %nobits
        .balign 4
        .global sound1, mute1
sound1: .space  64
mute1:  .space  4
        .endif
        .endif

        .section .bss.core0.guards, "aw", %nobits
        .balign 4
        .global guards0
guards0: .space 16 * GUARDS0
        .if     CORES > 1
        .section .bss.core1.guards, "aw", %nobits
        .balign 4
        .global guards1
guards1: .space 16 * GUARDS1
        .endif

@ What each key's sensor read (tuning.s).
        .if     TUNING
        .section .bss.core0.watched, "aw", %nobits
        .balign 4
        .global watched0
watched0: .space 16 * KEYS0
        .endif
        .if     TUNING * (CORES - 1)
        .section .bss.core1.watched, "aw", %nobits
        .balign 4
        .global watched1
watched1: .space 16 * KEYS1
        .endif

@ What each key's motor gave and got (passivity.s).
        .if     PAST
        .section .bss.ledger, "aw", %nobits
        .balign 4
        .global ledger0
ledger0: .space 4 + 8 * KEYS0 + 2 * KEYS0 * PAST
        .endif
        .if     PAST * (CORES - 1)
        .section .bss.core1.ledger, "aw", %nobits
        .balign 4
        .global ledger1
ledger1: .space 4 + 8 * KEYS1 + 2 * KEYS1 * PAST
        .endif

@ Every key may have full force, after the ramp; the keys' own state comes from the compiler.
        .section .text.start, "ax"
        .global start_keys
        .type   start_keys, %function
start_keys:                             @ R1: which half holds sensor words
        push    {r1, lr}
        ldr     r4, =core0
        bl      free_keys
        .if     CORES > 1
        ldr     r4, =core1
        bl      free_keys
        .endif
        .if     TUNING
        ldr     r1, [sp]
        ldr     r4, =core0
        ldr     r2, =linearise_core0
        bl      linearise_row
        .if     CORES > 1
        ldr     r1, [sp]
        ldr     r4, =core1
        ldr     r2, =linearise_core1
        bl      linearise_row
        .endif
        .endif
        ldr     r2, =programs
        ldr     r3, [r2]                @ every program of both cores, so that each can begin at any time
        .if     CORES > 1
        lsls    r3, r3, #1
        .endif
        adds    r2, #4
1:      ldr     r0, [r2]
        adds    r2, #4
        push    {r2, r3}
        ldr     r2, [r0, #P_INIT]       @ keeps no register; in RAM, beyond a branch
        ldr     r4, [r0, #P_CORE]
        ldr     r1, [sp, #8]
        ldr     r0, [r0, #P_STATE]
        lsls    r1, r1, #2
        adds    r1, r4, r1
        ldr     r1, [r1, #C_ROWS]
        blx     r2
        pop     {r2, r3}
        subs    r3, #1
        bne     1b
        pop     {r1, pc}

@ The sensor words of half R1 of the core at R4, by its function at R2.
        .if     TUNING
linearise_row:
        lsls    r1, r1, #2
        adds    r1, r4, r1
        ldr     r1, [r1, #C_ROWS]
        bx      r2
        .endif

@ Gains 0, ceilings 1, for the core at R4.
free_keys:
        ldr     r0, [r4, #C_GUARDS]
        ldr     r1, [r4, #C_GAINS]
        ldr     r2, [r4, #C_KEYS]
        ldr     r3, =65536
        movs    r5, #0
        .if     PORTS                   @ one gain is for all of them
        str     r5, [r1]
        movs    r2, #PORTS
2:      str     r3, [r0, #G_CEILING]
        adds    r0, #16
        .else
        .if     RECORD > 255
        ldr     r6, =RECORD
        .endif
2:      str     r3, [r0, #G_CEILING]
        adds    r0, #16
        .if     ZONES
        ldr     r6, [r1]
        str     r5, [r6, #GAIN]
        adds    r1, #8
        .else
        str     r5, [r1]
        .if     RECORD > 255
        adds    r1, r1, r6
        .else
        adds    r1, #RECORD
        .endif
        .endif
        .endif
        subs    r2, #1
        bne     2b
        bx      lr
