@ The start of core 1: six words over the FIFO, each answered with itself (RP2350 datasheet 5.3, RP2040 datasheet 2.8.2).
        .syntax unified
        .thumb
        .equ    SIO, 0xd0000000
        .equ    FIFO_ST, 0x50
        .equ    FIFO_WR, 0x54
        .equ    FIFO_RD, 0x58

        .section .text.start, "ax"
        .balign 4
sequence: .word   0, 0, 1, vectors1, STACK1, core1_start

        .global launch_core1
        .type   launch_core1, %function
launch_core1:
        push    {r4, lr}
        ldr     r0, =SIO
        ldr     r1, =sequence
        movs    r2, #0                  @ how many bytes were answered
next:   ldr     r3, [r1, r2]
        cmp     r3, #0
        bne     send
drain:  ldr     r4, [r0, #FIFO_ST]      @ before a 0, what is left of an attempt before goes
        lsls    r4, r4, #31
        beq     wake
        ldr     r4, [r0, #FIFO_RD]
        b       drain
wake:   sev
send:   ldr     r4, [r0, #FIFO_ST]
        lsls    r4, r4, #30
        bpl     send
        str     r3, [r0, #FIFO_WR]
        sev
answer: ldr     r4, [r0, #FIFO_ST]
        lsls    r4, r4, #31
        bne     read
        wfe
        b       answer
read:   ldr     r4, [r0, #FIFO_RD]
        adds    r2, #4
        cmp     r4, r3
        beq     1f
        movs    r2, #0                  @ another answer: from the beginning
1:      cmp     r2, #24
        bne     next
        pop     {r4, pc}
        .if     CORES > 1               @ what only helps begins elsewhere (parts.rs)
        .global core1_start
        .type   core1_start, %function
core1_start:
        bl      board_listen
        cpsie   i
        ldr     r0, =idle1
        bx      r0
        .endif
