@ A live value that is set takes effect on both cores in one tick, between two ticks of each.
@
@   whippen_set: C_WHERE, C_VALUE of both cores, then C_LATCH of core 0 = 2     asked (mailbox.s)
@   core 0, tick n: C_LATCH of both = 2 (n + 2) + 1                            its tick
@   each core, from tick n + 2 on: value to its word, C_LATCH = 0              done
@
@ Nobody interrupts a tick, so the tick of core 0 gives the number and not who asks, who may be held up for long. Core 0 has found n
@ at the converter, so the second tick from there is a whole tick away, however late core 0 is. A core that misses that tick has it
@ in the next one that it is given. Called with the tick in R0; keeps R0, R1 and R4.
        .syntax unified
        .thumb
        .section .text.frame, "ax"
        .if     LATCH
latch:  lsls    r3, r0, #1
        adds    r3, #1                  @ this tick as C_LATCH has it
        .if     CORE == 0
        lsrs    r5, r2, #1
        bcs     1f                      @ it has its tick
        ldr     r5, =core1
        adds    r3, #4
        str     r3, [r4, #C_LATCH]
        str     r3, [r5, #C_LATCH]
        b       7b
        .endif
1:      subs    r3, r3, r2
        bmi     7b
        ldr     r2, [r4, #C_WHERE]
        ldr     r3, [r4, #C_VALUE]
        str     r3, [r2]
        movs    r3, #0
        str     r3, [r4, #C_LATCH]
        b       7b
        .endif
