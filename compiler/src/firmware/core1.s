@ The start of core 1: six words over the FIFO, each answered with itself (RP2350 datasheet 5.3, RP2040 datasheet 2.8.2).
        .syntax unified
        .thumb
        .equ    SIO, 0xd0000000
        .equ    FIFO_ST, 0x50
        .equ    FIFO_WR, 0x54
        .equ    FIFO_RD, 0x58

        .section .text.start, "ax"
        .global launch_core1
        .type   launch_core1, %function
launch_core1:
        ldr     r0, =SIO
        adr     r1, sequence
        movs    r2, #0                  @ how many words were answered
next:   ldr     r3, [r1, r2, lsl #2]
        cbnz    r3, send
drain:  ldr     r12, [r0, #FIFO_ST]     @ before a 0, what is left of an attempt before goes
        tst     r12, #1
        beq     wake
        ldr     r12, [r0, #FIFO_RD]
        b       drain
wake:   sev
send:   ldr     r12, [r0, #FIFO_ST]
        tst     r12, #2
        beq     send
        str     r3, [r0, #FIFO_WR]
        sev
answer: ldr     r12, [r0, #FIFO_ST]
        tst     r12, #1
        bne     read
        wfe
        b       answer
read:   ldr     r12, [r0, #FIFO_RD]
        cmp     r12, r3
        ite     eq
        addeq   r2, r2, #1
        movne   r2, #0                  @ another answer: from the beginning
        cmp     r2, #6
        bne     next
        bx      lr
        .balign 4
sequence: .word   0, 0, 1, vectors1, STACK1, core1_start

        .global core1_start
        .type   core1_start, %function
core1_start:
        bl      board_listen
        cpsie   i
        ldr     r0, =idle1
        bx      r0
