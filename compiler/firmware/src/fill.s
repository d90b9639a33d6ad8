@ Contents of RAM from flash, then zeros: (from, to, bytes) and (at, bytes), all multiples of 4.
        .syntax unified
        .thumb
        .section .text.start, "ax"
        .global fill_memory
        .type   fill_memory, %function
fill_memory:
        ldr     r4, =__copy_table_start
        ldr     r5, =__copy_table_end
1:      cmp     r4, r5
        bhs     4f
        ldmia   r4!, {r0, r1, r2}
        b       3f
2:      ldr     r3, [r0]
        adds    r0, #4
        str     r3, [r1]
        adds    r1, #4
        subs    r2, #4
3:      cmp     r2, #0
        bne     2b
        b       1b
4:      ldr     r4, =__zero_table_start
        ldr     r5, =__zero_table_end
        movs    r3, #0
5:      cmp     r4, r5
        bhs     8f
        ldmia   r4!, {r0, r1}
        b       7f
6:      str     r3, [r0]
        adds    r0, #4
        subs    r1, #4
7:      cmp     r1, #0
        bne     6b
        b       5b
8:      bx      lr
