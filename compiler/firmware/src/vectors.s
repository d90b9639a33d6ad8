@ Where the image begins, for the start alone, and where faults end. While they play, the cores have tables of their own
@ (exceptions.s).
        .syntax unified
        .thumb

        .section .vectors, "a"
        .global vectors
vectors:
        .word   STACK0                  @ initial stack pointer
        .word   reset

@ A fault of the processor, or an exception that nobody expects: outputs off, whatever the other core still does, no force in what
@ it may put out again, and no more food for the watchdog.
        .section .text.firmware.dead, "ax"
        .global dead
        .type   dead, %function
dead:   cpsid   i
        bl      board_off
        ldr     r0, =status
        ldr     r1, [r0, #S_FAULTS]
        movs    r2, #FAULT_DEAD
        orrs    r1, r2
        str     r1, [r0, #S_FAULTS]
        bl      silence
1:      b       1b
