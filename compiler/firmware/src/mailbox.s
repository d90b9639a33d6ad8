@ Live parameters: a mailbox for whoever can write memory, and the same as two functions.
@
@   mailbox | request | parameter | value | done | outcome |     write parameter and value, then another number to request;
@                                                             done becomes that number when outcome is there
@
@ Parameter 0xffffffff is the program: its value is the number of the one to play. 0xfffffffe is the tuning of sensors, where the
@ image has it (tuning.s): 1 begins, 0 ends it and goes back to the program. 0xfffffffd is the alignment of a knob's motor, where it is
@ stored (knob_store.s): 1 starts the chip again, which then finds the motor anew; there is no outcome.
        .syntax unified
        .thumb
        .section .data.mailbox, "aw"
        .balign 4
        .global mailbox
mailbox: .word  0, 0, 0, 0, 0
        .if     TUNING
resume: .word   0                       @ the program that was asked for last
        .endif

        .section .text.firmware.mailbox, "ax"
@ R0: not 0 where somebody asks.
        .global mailbox_step
        .type   mailbox_step, %function
mailbox_step:
        push    {r4, lr}
        ldr     r4, =mailbox
        ldr     r2, [r4]
        ldr     r3, [r4, #12]
        movs    r0, #0
        cmp     r2, r3
        beq     8f
        dmb     sy
        ldr     r0, [r4, #4]
        ldr     r1, [r4, #8]
        bl      whippen_set
        .if     LATCH
        cmp     r0, #3
        beq     9f                      @ at another turn
        .endif
        str     r0, [r4, #16]
        dmb     sy
        ldr     r2, [r4]
        str     r2, [r4, #12]
9:      movs    r0, #1
8:      pop     {r4, pc}

@ int whippen_set(uint32_t parameter, int32_t value): 0, or 1 for no such parameter, 2 for a value out of its range, 3 while the
@ value that was set before has not taken effect. A parameter is one word of each core's state. A single core has it between two
@ ticks; two of them in one tick (latch.s).
        .global whippen_set
        .type   whippen_set, %function
whippen_set:
        adds    r2, r0, #1
        bne     1f
        mov     r0, r1
        b       8f
1:
        .if     TUNING
        adds    r2, r0, #2
        bne     1f
        mov     r0, r1
        b       tunes
1:
        .endif
        .if     STORE
        adds    r2, r0, #3
        bne     1f
        movs    r0, #2
        cmp     r1, #1
        bne     0f
        b       board_align
0:      bx      lr
1:
        .endif
        push    {r3, lr}
        bl      live
        movs    r0, #1
        bhs     9f
        ldr     r0, [r2, #12]           @ its range
        ldr     r3, [r2, #16]
        cmp     r1, r0
        blt     7f
        cmp     r1, r3
        bgt     7f
        .if     LATCH
        ldr     r0, =core0
        ldr     r3, [r0, #C_LATCH]
        cmp     r3, #0
        bne     6f
        ldr     r3, [r2, #4]            @ its word
        cmp     r3, #0
        bne     2f
        movs    r3, #C_VALUE            @ none on this core
        adds    r3, r3, r0
2:      str     r3, [r0, #C_WHERE]
        str     r1, [r0, #C_VALUE]
        ldr     r0, =core1
        ldr     r3, [r0, #C_LATCH]
        cmp     r3, #0
        bne     6f
        ldr     r3, [r2, #8]
        cmp     r3, #0
        bne     3f
        movs    r3, #C_VALUE
        adds    r3, r3, r0
3:      str     r3, [r0, #C_WHERE]
        str     r1, [r0, #C_VALUE]
        dmb     sy
        ldr     r0, =core0
        movs    r3, #2
        str     r3, [r0, #C_LATCH]
        .else
        ldr     r0, [r2, #4]            @ its words
        ldr     r3, [r2, #8]
        str     r1, [r0]
        str     r1, [r3]
        .endif
        movs    r0, #0
        pop     {r3, pc}
        .if     LATCH
6:      movs    r0, #3
        pop     {r3, pc}
        .endif
7:      movs    r0, #2
9:      pop     {r3, pc}

@ int32_t whippen_get(uint32_t parameter): its value that plays; 0 where there is none.
        .global whippen_get
        .type   whippen_get, %function
whippen_get:
        push    {r3, lr}
        bl      live
        movs    r0, #0
        bhs     9f
        ldr     r0, [r2, #4]
        .if     LATCH
        cmp     r0, #0
        bne     1f
        ldr     r0, [r2, #8]            @ core 0 has none
1:
        .endif
        ldr     r0, [r0]
9:      pop     {r3, pc}

@ R2: the word before the row of the parameter R0 in the table of lives; carry where there is none. Keeps R0 and R1.
        .type   live, %function
live:   ldr     r2, =lives
        lsls    r3, r0, #4
        adds    r3, r2, r3
        ldr     r2, [r2]                @ how many there are
        cmp     r0, r2
        mov     r2, r3
        bx      lr

@ int whippen_play(uint32_t program): another program begins with the next tick; 0, or 1 for no such program.
@ A core looks for what is wanted when its alarm differs from everybody's, after it has made them equal. So what is wanted is
@ written first, and if a tick makes them equal in between it sees what is wanted as well.
        .global whippen_play
        .type   whippen_play, %function
whippen_play:
8:      ldr     r2, =programs
        ldr     r3, [r2]
        cmp     r0, r3
        bhs     9f
        .if     TUNING
        ldr     r3, =resume
        str     r0, [r3]
        .endif
        .if     CORES > 1
        lsls    r0, r0, #3
        adds    r2, r2, r0
        ldr     r0, [r2, #4]
        ldr     r1, [r2, #8]
7:      ldr     r3, =core1
        str     r1, [r3, #C_WANTED]
        .else
        lsls    r0, r0, #2
        adds    r2, r2, r0
        ldr     r0, [r2, #4]
7:
        .endif
        ldr     r2, =core0
        str     r0, [r2, #C_WANTED]
        dmb     sy
        ldr     r0, =alarm
        ldr     r0, [r0]
        mvns    r0, r0
        str     r0, [r2, #C_ALARM]
        .if     CORES > 1
        str     r0, [r3, #C_ALARM]
        .endif
        movs    r0, #0
        bx      lr
9:      movs    r0, #1
        bx      lr

@ int whippen_tune(uint32_t on): 1 begins to tune the sensors, with forces at zero; 0 ends it, and the program that was asked for
@ last begins. 0, or 2 for neither. What is already so stays.
        .if     TUNING
        .global whippen_tune
        .type   whippen_tune, %function
whippen_tune:
tunes:  cmp     r0, #1
        bhi     6f
        ldr     r1, =core0
        ldr     r2, =tuning_core0
        ldr     r1, [r1, #C_WANTED]
        beq     5f
        cmp     r1, r2
        bne     4f
        ldr     r0, =resume
        ldr     r0, [r0]
        b       8b
4:      movs    r0, #0
        bx      lr
5:      cmp     r1, r2
        beq     4b
        mov     r0, r2
        .if     CORES > 1
        ldr     r1, =tuning_core1
        .endif
        b       7b
6:      movs    r0, #2
        bx      lr
        .endif
