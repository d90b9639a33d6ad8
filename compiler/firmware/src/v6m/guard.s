@ One key each tick on a Cortex-M0+, its heat and its sensor: as firmware/guard.s, which says what happens.
        .syntax unified
        .thumb
        .section .text.frame, "ax"
guard:  ldr     r6, [r4, #C_TURN]
        adds    r6, #1
        cmp     r6, #KEYS
        blo     1f
        movs    r6, #0
1:      str     r6, [r4, #C_TURN]
        ldr     r5, [r4, #C_GUARDS]
        lsls    r7, r6, #4
        adds    r5, r5, r7
        ldr     r7, [r4, #C_ROW]
        lsls    r0, r6, #1
        adds    r7, r7, r0
        ldr     r1, =DISTANCE
        ldrsh   r1, [r7, r1]
        ldrh    r0, [r7]
        ldr     r2, [r5, #G_HEAT]
        ldr     r3, [r5, #G_CEILING]
        ldr     r7, =HEAT_MAX
        cmp     r2, r7
        bhs     hot
        ldr     r7, =CEILING_HOT
        cmp     r3, r7
        beq     cooling
sensor: ldrh    r2, [r5, #G_WORD]
        ldr     r7, [r4, #C_TICK]
        ldr     r3, [r4, #C_RAMP]
        cmp     r3, #0
        bne     ramping
        ldr     r3, [r5, #G_SINCE]      @ twice the tick of the last change; bit 0: the drive has moved since
        cmp     r0, r2
        bne     moves
        movs    r2, #G_DRIVE
        ldrsh   r2, [r5, r2]
        subs    r1, r1, r2
        bpl     1f
        rsbs    r1, r1, #0
1:      lsls    r7, r7, #1
        subs    r7, r7, r3              @ twice its age in ticks; less 1 where the drive has moved
        ldr     r2, =MOVED
        cmp     r1, r2
        bls     1f
        movs    r2, #1
        orrs    r3, r2
1:      str     r3, [r5, #G_SINCE]
        ldr     r1, =2 * AGE_RAIL - 1
        cmp     r7, r1
        bhs     stuck
        b       leave

ramping:                                @ force comes and goes by itself: no sensor is judged by it
        subs    r3, #1
        str     r3, [r4, #C_RAMP]
moves:  strh    r0, [r5, #G_WORD]
        strh    r1, [r5, #G_DRIVE]
        lsls    r7, r7, #1
        str     r7, [r5, #G_SINCE]
        b       leave

hot:    ldr     r7, =CEILING_HOT
        cmp     r3, r7
        bls     sensor
        str     r7, [r5, #G_CEILING]
        ldr     r3, [r4, #C_FAULTS]
        movs    r7, #FAULT_HOT
        orrs    r3, r7
        str     r3, [r4, #C_FAULTS]
        b       ramp
cooling:
        ldr     r7, =HEAT_MAX / 2
        cmp     r2, r7
        bhs     sensor
        ldr     r3, =65536
        str     r3, [r5, #G_CEILING]
ramp:   ldr     r3, =RAMP
        str     r3, [r4, #C_RAMP]
        b       sensor

stuck:  movs    r2, #FAULT_RAIL
        cmp     r0, #0
        beq     free
        ldr     r1, =65535
        cmp     r0, r1
        beq     free
        ldr     r1, =2 * AGE_FROZEN - 1
        cmp     r7, r1
        blo     leave
        lsls    r3, r3, #31
        beq     leave
        ldr     r1, =MID_LOW
        cmp     r0, r1
        blo     leave
        ldr     r1, =MID_HIGH
        cmp     r0, r1
        bhi     leave
        movs    r2, #FAULT_FROZEN
free:   movs    r0, #0
        str     r0, [r5, #G_CEILING]
        ldr     r1, [r4, #C_FAULTS]
        orrs    r1, r2
        str     r1, [r4, #C_FAULTS]
        str     r6, [r4, #C_FAULTY]
leave:  pop     {r6, r7}
        mov     r10, r6
        mov     r11, r7
        pop     {r4-r7, pc}
        .ltorg
