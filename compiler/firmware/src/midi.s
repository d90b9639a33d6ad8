@ Events to MIDI: `note` becomes note on, with a velocity by table from its speed, `release` note off, with one from its speed where
@ it has any. Velocities have 14 bits; the low seven of them go ahead of the message, as control change 88, where FINE says so.
@
@   ring of core 0, ring of core 1 -> message of three or six bytes -> serial port, a byte whenever it takes one
@
@ Where PASS says so messages that arrived (midi_in.s) go ahead of the keys' own.
@
@ When a core plays another program, what the one before has emitted is sent first, then the end of every note that it left
@ sounding.
        .syntax unified
        .thumb
        .equ    T_HEAD, 0
        .equ    T_TAIL, 4

        .section .bss.core1.midi, "aw", %nobits
        .balign 4
message: .space 12                      @ bytes that are left, how many
reader0: .space 36                      @ the program whose events are read, and which keys sound, a bit each
        .if     CORES > 1
reader1: .space 36
        .endif

        .if     PASS
        .global passed_sent
passed_sent: .space 4                   @ how many messages of the ring
        .endif

        .section .text.core1.firmware.midi, "ax"
        .global midi_step
        .type   midi_step, %function
midi_step:
        push    {r4, r5, r6, lr}
        ldr     r4, =message
        ldr     r5, [r4, #8]
        cmp     r5, #0
        bne     1f
        .if     PASS
        bl      pass_on
        cmp     r0, #0
        bne     1f
        .endif
        ldr     r0, =core0
        ldr     r1, =reader0
        bl      take
        .if     CORES > 1
        cmp     r0, #0
        bne     1f
        ldr     r0, =core1
        ldr     r1, =reader1
        bl      take
        .endif
1:      ldr     r5, [r4, #8]            @ as much as the port takes
        cmp     r5, #0
        beq     9f
        bl      board_serial_ready
        cmp     r0, #0
        beq     9f
        ldr     r6, [r4]
        uxtb    r0, r6
        bl      board_serial_send
        lsrs    r6, r6, #8
        ldr     r0, [r4, #4]
        lsls    r1, r0, #24
        orrs    r6, r1
        str     r6, [r4]
        lsrs    r0, r0, #8
        str     r0, [r4, #4]
        subs    r5, #1
        str     r5, [r4, #8]
        b       1b
9:      pop     {r4, r5, r6, pc}

@ The oldest event of the core at R0, whose reader is at R1, into the message. R0: whether there was one that is sent.
take:   push    {r4-r7, lr}
        ldr     r6, [r0, #C_FIRST]
        mov     r12, r6
        ldr     r2, [r0, #C_PROGRAM]
        ldr     r3, [r1]
        adds    r1, #4                  @ the bits of its keys
        cmp     r3, #0
        beq     begun
        ldr     r6, [r3, #P_READER]
        .if     ZONES
zone:
        .endif
        ldr     r5, [r6, #R_STATE]
        ldr     r7, [r5, #T_TAIL]
        ldr     r4, [r5, #T_HEAD]
        cmp     r7, r4
        beq     empty
        dmb     sy
        ldr     r3, [r6, #R_MASK]
        ldr     r2, [r6, #R_EVENTS]
        movs    r0, r3
        ands    r0, r7
        adds    r2, r2, r0              @ tick, key, event, arguments
        ldr     r4, [r2, #4]
        adds    r0, r4, #1
        beq     mark
        ldr     r3, [r6, #R_EVENT]
        ldr     r2, [r2, #8]
        uxth    r0, r4
        lsrs    r4, r4, #16
        adds    r7, r7, r3
        dmb     sy
        str     r7, [r5, #T_TAIL]
        ldr     r3, [r6, #R_RELEASE]
        cmp     r4, r3
        beq     release
        ldr     r3, [r6, #R_NOTE]
        cmp     r4, r3
        bne     none
        ldr     r3, [r6, #R_SHIFT]
        ldr     r4, [r6, #R_VELOCITIES]
        cmp     r2, #0
        bge     1f
        movs    r2, #0
1:      bl      velocity
        bl      key_bit
        orrs    r7, r3
        movs    r2, #0x90
        b       put
release:
        ldr     r3, [r6, #R_RELEASE_SHIFT]
        ldr     r4, [r6, #R_RELEASE_VELOCITIES]
        cmp     r4, #0
        beq     off
        cmp     r2, #0                  @ upwards or downwards
        bge     1f
        rsbs    r2, r2, #0
1:      bl      velocity
        b       1f
off:    ldr     r4, =64 << 7
1:      bl      key_bit
        bics    r7, r3
        movs    r2, #0x80
put:    str     r7, [r5]                @ the message of R2, key R0 and velocity R4
        add     r0, r12
        adds    r0, #FIRST_NOTE
        ldr     r5, =message
        .if     FINE
        lsls    r3, r4, #25
        bne     fine
        .else
        adds    r4, #64                 @ to the nearest of seven bits
        .endif
        lsrs    r4, r4, #7
        lsrs    r3, r4, #7              @ 127 at most
        subs    r4, r4, r3
        lsls    r0, r0, #8
        orrs    r2, r0
        lsls    r4, r4, #16
        orrs    r2, r4
        str     r2, [r5]
        movs    r0, #3
        str     r0, [r5, #8]
        pop     {r4-r7, pc}
        .if     FINE
fine:   lsrs    r3, r3, #9              @ control change 88: the low bits of the next note
        lsls    r2, r2, #24
        orrs    r3, r2
        ldr     r2, =88 << 8 | 0xb0
        orrs    r3, r2
        str     r3, [r5]
        lsrs    r4, r4, #7
        lsls    r4, r4, #8
        orrs    r4, r0
        str     r4, [r5, #4]
        movs    r0, #6
        str     r0, [r5, #8]
        pop     {r4-r7, pc}
        .endif
mark:   orrs    r7, r3                  @ no event: the ring goes on at its beginning
        adds    r7, #1
        str     r7, [r5, #T_TAIL]
        b       none
empty:
        .if     ZONES
        ldr     r6, [r6, #R_NEXT]       @ the core's next zone
        cmp     r6, #0
        bne     zone
        .endif
        cmp     r3, r2
        beq     none
        movs    r0, #0                  @ another program plays: the first key that still sounds
1:      lsrs    r5, r0, #5
        lsls    r5, r5, #2
        ldr     r7, [r1, r5]
        cmp     r7, #0
        bne     2f
        adds    r0, #32
        lsrs    r5, r0, #8
        beq     1b
begun:  subs    r1, #4
        str     r2, [r1]
none:   movs    r0, #0
        pop     {r4-r7, pc}
2:      lsrs    r7, r7, #1
        bcs     off
        adds    r0, #1
        b       2b

@ R4: the velocity of the speed R2, by the table at R4 of one for each multiple of 2^R3, and lines between them.
velocity:
        mov     r5, r2
        lsrs    r5, r3
        cmp     r5, #127
        bls     1f
        movs    r5, #128
        lsls    r5, r5, #1
        ldrh    r4, [r4, r5]
        bx      lr
1:      mov     r7, r5
        lsls    r7, r3
        subs    r2, r2, r7
        lsls    r5, r5, #1
        adds    r5, r4, r5
        ldrh    r4, [r5]
        ldrh    r5, [r5, #2]
        subs    r5, r5, r4
        subs    r3, #8                  @ 1/256 of the way
        bmi     2f
        lsrs    r2, r3
        b       3f
2:      rsbs    r3, r3, #0
        lsls    r2, r3
3:      muls    r5, r2, r5
        lsrs    r5, r5, #8
        adds    r4, r4, r5
        bx      lr

@ Of the key R0, whose bits are at R1: R5 where they are, R7 the word, R3 its bit.
key_bit:
        lsrs    r5, r0, #5
        lsls    r5, r5, #2
        adds    r5, r1, r5
        movs    r7, #31
        ands    r7, r0
        movs    r3, #1
        lsls    r3, r7
        ldr     r7, [r5]
        bx      lr

        .if     PASS
@ The oldest message that is to go on, into the message at R4: two together where the first is a control change 88. R0: whether there
@ was one.
pass_on:
        push    {r5, r6, lr}
        ldr     r3, =passed
        ldr     r5, =passed_sent
        ldr     r1, [r5]
        ldr     r0, [r3, #PASSED_HEAD]
        subs    r0, r0, r1
        beq     9f
        dmb     sy
        bl      passed_message
        movs    r6, r2                  @ how many bytes
        str     r0, [r4]
        lsls    r0, r0, #16
        lsrs    r0, r0, #20
        ldr     r2, =PREFIX
        cmp     r0, r2
        bne     1f
        bl      passed_message
        adds    r6, r6, r2
        ldr     r2, [r4]
        lsls    r3, r0, #24
        orrs    r2, r3
        str     r2, [r4]
        lsrs    r0, r0, #8
        str     r0, [r4, #4]
1:      dmb     sy
        str     r1, [r5]
        str     r6, [r4, #8]
        movs    r0, #1
9:      pop     {r5, r6, pc}

@ R0: the R1st message of the ring at R3; R2: how many bytes it has. R1 goes up.
passed_message:
        movs    r2, #PASSED - 1
        ands    r2, r1
        lsls    r2, r2, #2
        adds    r2, r2, r3
        ldr     r0, [r2, #PASSED_RING]
        adds    r1, #1
        uxtb    r2, r0
        lsrs    r2, r2, #5
        subs    r2, #0xc0 >> 5
        beq     1f
        movs    r2, #1
1:      adds    r2, #2
        bx      lr
        .endif
