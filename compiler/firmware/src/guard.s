@ One key each tick: its heat, and its sensor.
@
@   heat at its limit: the ceiling of its gain becomes rated / peak current, until half of the heat is gone
@   a sensor word that stays
@     at a rail (0 or 65535) for 10 ms, or
@     in mid-travel for 100 ms while the drive moves by more than 1 N from where it was
@   is a fault: the key goes free (its ceiling is 0) until the next start. A constant word alone is none: a resting key has one.
        .syntax unified
        .thumb
        .section .text.frame, "ax"
guard:  ldr     r6, [r4, #C_TURN]
        ldr     r8, =guards
        ldr     r5, =HEAT_MAX
        adds    r6, #1
        cmp     r6, #KEYS
        it      hs
        movhs   r6, #0
        str     r6, [r4, #C_TURN]
        add     r8, r8, r6, lsl #4
        add     r7, r10, r6, lsl #1
        ldr     r2, [r8, #G_HEAT]
        ldr     r3, [r8, #G_CEILING]
        ldrh    r0, [r7]
        ldrsh   r1, [r7, #DISTANCE]
        cmp     r2, r5
        bhs     hot
        cmp     r3, #CEILING_HOT
        beq     cooling
sensor: ldrh    r2, [r8, #G_WORD]
        ldr     r7, [r4, #C_TICK]
        ldr     r3, [r4, #C_RAMP]
        cbnz    r3, ramping
        ldr     r3, [r8, #G_SINCE]      @ twice the tick of the last change; bit 0: the drive has moved since
        cmp     r0, r2
        bne     moves
        ldrsh   r2, [r8, #G_DRIVE]
        rsb     r7, r3, r7, lsl #1      @ twice its age in ticks; less 1 where the drive has moved
        subs    r1, r1, r2
        it      mi
        rsbmi   r1, r1, #0
        cmp     r1, #MOVED
        it      hi
        orrhi   r3, r3, #1
        movw    r1, #2 * AGE_RAIL - 1
        str     r3, [r8, #G_SINCE]
        cmp     r7, r1
        bhs     stuck
        pop     {r4-r11, pc}

ramping:                                @ force comes and goes by itself: no sensor is judged by it
        subs    r3, #1
        str     r3, [r4, #C_RAMP]
moves:  strh    r0, [r8, #G_WORD]
        strh    r1, [r8, #G_DRIVE]
        lsls    r7, r7, #1
        str     r7, [r8, #G_SINCE]
        pop     {r4-r11, pc}

hot:    cmp     r3, #CEILING_HOT
        bls     sensor
        mov     r3, #CEILING_HOT
        str     r3, [r8, #G_CEILING]
        ldr     r3, [r4, #C_FAULTS]
        orr     r3, r3, #FAULT_HOT
        str     r3, [r4, #C_FAULTS]
        b       ramp
cooling:
        cmp     r2, r5, lsr #1
        bhs     sensor
        mov     r3, #65536
        str     r3, [r8, #G_CEILING]
ramp:   movw    r3, #RAMP
        str     r3, [r4, #C_RAMP]
        b       sensor

stuck:  movs    r2, #FAULT_RAIL
        cbz     r0, free
        movw    r1, #65535
        cmp     r0, r1
        beq     free
        movw    r1, #2 * AGE_FROZEN - 1
        cmp     r7, r1
        blo     leave
        lsls    r3, r3, #31
        beq     leave
        movw    r1, #MID_LOW
        cmp     r0, r1
        blo     leave
        movw    r1, #MID_HIGH
        cmp     r0, r1
        bhi     leave
        movs    r2, #FAULT_FROZEN
free:   movs    r0, #0
        str     r0, [r8, #G_CEILING]
        ldr     r1, [r4, #C_FAULTS]
        orrs    r1, r2
        str     r1, [r4, #C_FAULTS]
        str     r6, [r4, #C_FAULTY]
leave:  pop     {r4-r11, pc}
