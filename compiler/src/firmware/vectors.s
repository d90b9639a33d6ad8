@ Where the cores begin and where exceptions go. What stands in front of the image is for the start alone: a tick may not wait for
@ flash, so each core has a table in RAM.
        .syntax unified
        .thumb

        .section .vectors, "a"
        .global vectors
vectors:
        .word   STACK0                  @ initial stack pointer
        .word   reset

        .section .rodata.vectors, "a"
        .balign 512
        .global vectors0
vectors0:
        .word   STACK0
        .word   reset
        .word   dead, dead, dead, dead, dead, dead
        .word   0, 0, 0
        .word   dead, dead, 0, dead, dead
        .space  4 * CONVERTER_IRQ, 0
        .word   tick_core0

        .if     CORES > 1
        .section .rodata.core1.vectors, "a"
        .balign 512
        .global vectors1
vectors1:
        .word   STACK1
        .word   core1_start
        .word   dead, dead, dead, dead, dead, dead
        .word   0, 0, 0
        .word   dead, dead, 0, dead, dead
        .space  4 * CONVERTER_IRQ, 0
        .word   tick_core1
        .endif

@ A fault of the processor, or an exception that nobody expects: no force, and no more food for the watchdog.
        .section .text.firmware.dead, "ax"
        .global dead
        .type   dead, %function
dead:   cpsid   i
        ldr     r0, =status
        ldr     r1, [r0, #S_FAULTS]
        orr     r1, r1, #FAULT_DEAD
        str     r1, [r0, #S_FAULTS]
        bl      silence
1:      b       1b
