@ Start of core 0: memory, clocks, the converter, the keys, the other core; then the idle loop.
        .syntax unified
        .thumb
        .section .text.start, "ax"
        .global reset
        .type   reset, %function
reset:  cpsid   i
        bl      board_clocks            @ before there is anything in RAM
        bl      fill_memory
        ldr     r0, =0xe000ed08         @ VTOR
        ldr     r1, =vectors0
        str     r1, [r0]
        bl      board_serial
        bl      board_converter
1:      bl      board_begin             @ keys start from where they are
        cmp     r0, #0
        beq     1b
        bl      start_keys
        .if     CORES + HELPER > 1
        bl      launch_core1
        .endif
        bl      board_watchdog
        bl      board_listen
        cpsie   i
        ldr     r0, =idle0
        bx      r0

@ Contents of RAM from flash, then zeros: (from, to, bytes) and (at, bytes), all multiples of 4.
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
