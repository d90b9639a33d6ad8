@ Live parameters: a mailbox for whoever can write memory, and the same as two functions.
@
@   mailbox | request | parameter | value | done | outcome |     write parameter and value, then another number to request;
@                                                             done becomes that number when outcome is there
        .syntax unified
        .thumb
        .section .data.mailbox, "aw"
        .balign 4
        .global mailbox
mailbox: .word  0, 0, 0, 0, 0

        .section .text.firmware.mailbox, "ax"
        .global mailbox_step
        .type   mailbox_step, %function
mailbox_step:
        push    {r4, lr}
        ldr     r4, =mailbox
        ldr     r2, [r4]
        ldr     r3, [r4, #12]
        cmp     r2, r3
        beq     9f
        dmb     sy
        ldr     r0, [r4, #4]
        ldr     r1, [r4, #8]
        bl      whippen_set
        str     r0, [r4, #16]
        dmb     sy
        ldr     r2, [r4]
        str     r2, [r4, #12]
9:      pop     {r4, pc}

@ int whippen_set(uint32_t parameter, int32_t value): 0, or 1 for no such parameter, 2 for a value out of its range.
@ A parameter is one word of each core's state, so a tick finds the old value or the new one.
        .global whippen_set
        .type   whippen_set, %function
whippen_set:
        ldr     r2, =lives
        ldr     r3, [r2]                @ how many there are
        cmp     r0, r3
        bhs     8f
        movs    r3, #12
        mla     r2, r0, r3, r2
        ldr     r3, [r2, #8]
        cmp     r1, r3
        blt     7f
        ldr     r3, [r2, #12]
        cmp     r1, r3
        bgt     7f
        ldr     r0, [r2, #4]
        ldr     r3, =core0
        ldr     r3, [r3, #C_STATE]
        str     r1, [r3, r0]
        ldr     r3, =core1
        ldr     r3, [r3, #C_STATE]
        str     r1, [r3, r0]
        movs    r0, #0
        bx      lr
7:      movs    r0, #2
        bx      lr
8:      movs    r0, #1
        bx      lr

@ int32_t whippen_get(uint32_t parameter): its value; 0 where there is none.
        .global whippen_get
        .type   whippen_get, %function
whippen_get:
        ldr     r2, =lives
        ldr     r3, [r2]
        cmp     r0, r3
        bhs     9f
        movs    r3, #12
        mla     r2, r0, r3, r2
        ldr     r0, [r2, #4]
        ldr     r3, =core0
        ldr     r3, [r3, #C_STATE]
        ldr     r0, [r3, r0]
        bx      lr
9:      movs    r0, #0
        bx      lr
