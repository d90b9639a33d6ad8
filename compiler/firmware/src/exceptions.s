@ Where the exceptions of a core go: a tick may not wait for flash, so the table lies in RAM. Assembled once for each core, with its
@ STACK and the place where it begins.
        .syntax unified
        .thumb
        .section .rodata.frame.exceptions, "a"
        .balign 512
        .global exceptions
exceptions:
        .word   STACK                   @ initial stack pointer
        .word   entry
        .word   dead, dead, dead, dead, dead, dead
        .word   0, 0, 0
        .word   dead, dead, 0, dead, dead
        .space  4 * CONVERTER_IRQ, 0
        .word   tick
