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
