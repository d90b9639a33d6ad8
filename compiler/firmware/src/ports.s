@ The ports of an instrument that is played once: one of them each tick, its heat and its sensor; and the gain of all drive words.
@ As service.s and guard.s have it for keys, which say what happens, in instructions that all cores have.
@
@   heat += drive^2 - rated^2, never below 0     at each turn of a port that is driven
@   gain -> the lowest of all ceilings, down at once, up by STEP
@
@ What differs between ports is in a table, a row each (ports.rs). One gain is for all of them: an instrument that lacks one of its
@ sensors, or the rest of a force, is not the one that was written.
        .syntax unified
        .thumb
        .section .text.frame, "ax"
        .equ    T_LOW, 0                @ mid-travel
        .equ    T_HIGH, 2
        .equ    T_AGE_RAIL, 4
        .equ    T_AGE_FROZEN, 6
        .equ    T_CEILING, 8            @ of the gain, while the motor is hot
        .equ    T_RAILS, 10             @ bit 0: word 0 is a fault; bit 1: word 65535
        .equ    T_SHIFT, 11             @ of the heat
        .equ    T_MOVED, 12
        .equ    T_DRIVE, 14             @ from the sensor's word to that of its drive; 0 for none
        .equ    T_RATED2, 16
        .equ    T_HEAT, 20

ports:  ldr     r6, [r4, #C_TURN]
        adds    r6, #1
        cmp     r6, #PORTS
        blo     1f
        movs    r6, #0
1:      str     r6, [r4, #C_TURN]
        ldr     r5, [r4, #C_GUARDS]
        lsls    r7, r6, #4
        adds    r5, r5, r7              @ its guard
        ldr     r3, =port_table
        lsls    r7, r6, #5
        adds    r7, r7, r3              @ its row
        ldr     r2, [r4, #C_ROW]
        lsls    r0, r6, #1
        adds    r2, r2, r0
        ldrh    r0, [r2]                @ the sensor's word
        movs    r1, #0                  @ the drive's
        ldrh    r3, [r7, #T_DRIVE]
        cmp     r3, #0
        beq     sensor
        ldrsh   r1, [r2, r3]
        movs    r2, r1
        muls    r2, r1, r2
        ldr     r3, [r7, #T_RATED2]
        subs    r2, r2, r3
        ldrb    r3, [r7, #T_SHIFT]
        asrs    r2, r3
        ldr     r3, [r5, #G_HEAT]
        adds    r2, r2, r3
        asrs    r3, r2, #31
        bics    r2, r3                  @ never below 0, nor above 30 bits
        ldr     r3, =0x3fffffff
        cmp     r2, r3
        bls     1f
        mov     r2, r3
1:      str     r2, [r5, #G_HEAT]
        ldr     r3, [r7, #T_HEAT]
        cmp     r2, r3
        bhs     hot
        lsrs    r3, r3, #1
        cmp     r2, r3
        bhs     sensor
        ldr     r2, [r5, #G_CEILING]    @ half of the heat is gone
        ldrh    r3, [r7, #T_CEILING]
        cmp     r2, r3
        bne     sensor
        ldr     r3, =65536
        str     r3, [r5, #G_CEILING]
        b       ramp
hot:    ldr     r2, [r5, #G_CEILING]
        ldrh    r3, [r7, #T_CEILING]
        cmp     r2, r3
        bls     sensor
        str     r3, [r5, #G_CEILING]
        ldr     r2, [r4, #C_FAULTS]
        movs    r3, #FAULT_HOT
        orrs    r2, r3
        str     r2, [r4, #C_FAULTS]
ramp:   ldr     r2, =RAMP
        str     r2, [r4, #C_RAMP]

sensor: ldrh    r2, [r5, #G_WORD]
        ldr     r3, [r4, #C_RAMP]
        cmp     r3, #0
        bne     ramping
        cmp     r0, r2
        bne     moves
        movs    r2, #G_DRIVE
        ldrsh   r2, [r5, r2]
        subs    r1, r1, r2
        bpl     1f
        rsbs    r1, r1, #0
1:      ldr     r3, [r5, #G_SINCE]      @ twice the tick of the last change; bit 0: the drive has moved since
        ldrh    r2, [r7, #T_MOVED]
        cmp     r1, r2
        bls     1f
        movs    r2, #1
        orrs    r3, r2
        str     r3, [r5, #G_SINCE]
1:      ldr     r2, [r4, #C_TICK]
        lsls    r2, r2, #1
        subs    r2, r2, r3
        adds    r2, #1
        lsrs    r2, r2, #1              @ for how many ticks
        ldrh    r1, [r7, #T_AGE_RAIL]
        cmp     r2, r1
        blo     gains
        ldrb    r1, [r7, #T_RAILS]
        cmp     r0, #0
        beq     low
        adds    r0, #1
        lsrs    r0, r0, #16
        bne     high
        ldrh    r0, [r5, #G_WORD]
        ldrh    r1, [r7, #T_AGE_FROZEN]
        cmp     r2, r1
        blo     gains
        lsls    r3, r3, #31
        beq     gains
        ldrh    r1, [r7, #T_LOW]
        cmp     r0, r1
        blo     gains
        ldrh    r1, [r7, #T_HIGH]
        cmp     r0, r1
        bhi     gains
        movs    r2, #FAULT_FROZEN
        b       free

low:    movs    r3, #1
        b       1f
high:   movs    r3, #2
1:      tst     r1, r3
        beq     gains
        movs    r2, #FAULT_RAIL
free:   movs    r0, #0
        str     r0, [r5, #G_CEILING]
        ldr     r1, [r4, #C_FAULTS]
        orrs    r1, r2
        str     r1, [r4, #C_FAULTS]
        str     r6, [r4, #C_FAULTY]
        b       gains

ramping:                                @ force comes and goes by itself: no sensor is judged by it
        subs    r3, #1
        str     r3, [r4, #C_RAMP]
moves:  strh    r0, [r5, #G_WORD]
        strh    r1, [r5, #G_DRIVE]
        ldr     r2, [r4, #C_TICK]
        lsls    r2, r2, #1
        str     r2, [r5, #G_SINCE]

gains:  ldr     r5, [r4, #C_GUARDS]
        ldr     r0, [r4, #C_GAINS]
        ldr     r1, [r0]
        ldr     r2, =STEP
        adds    r1, r1, r2
        .rept   PORTS
        ldr     r2, [r5, #G_CEILING]
        adds    r5, #16
        cmp     r1, r2
        bls     1f
        mov     r1, r2
1:
        .endr
        str     r1, [r0]
leave:
        .if     SMALL
        pop     {r6, r7}
        mov     r10, r6
        mov     r11, r7
        pop     {r4-r7, pc}
        .else
        pop     {r4-r11, pc}
        .endif
        .ltorg
