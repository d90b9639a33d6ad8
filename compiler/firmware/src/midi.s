@ Events to MIDI: `note` becomes note on, with a velocity by table from its speed, `release` note off.
@
@   ring of core 0, ring of core 1 -> message of three bytes -> serial port, a byte whenever it takes one
@
@ When a core plays another program, what the one before has emitted is sent first, then the end of every note that it left
@ sounding.
        .syntax unified
        .thumb
        .equ    T_HEAD, 0
        .equ    T_TAIL, 4

        .section .bss.core1.midi, "aw", %nobits
        .balign 4
message: .space 8                       @ bytes that are left, how many
reader0: .space 36                      @ the program whose events are read, and which keys sound, a bit each
        .if     CORES > 1
reader1: .space 36
        .endif

        .section .text.core1.firmware.midi, "ax"
        .global midi_step
        .type   midi_step, %function
midi_step:
        push    {r4, r5, r6, lr}
        ldr     r4, =message
        ldr     r5, [r4, #4]
        cmp     r5, #0
        bne     1f
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
1:      ldr     r5, [r4, #4]            @ as much as the port takes
        cmp     r5, #0
        beq     9f
        bl      board_serial_ready
        cmp     r0, #0
        beq     9f
        ldr     r6, [r4]
        uxtb    r0, r6
        bl      board_serial_send
        lsrs    r6, r6, #8
        str     r6, [r4]
        subs    r5, #1
        str     r5, [r4, #4]
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
        beq     off
        ldr     r3, [r6, #R_NOTE]
        cmp     r4, r3
        bne     none
        ldr     r3, [r6, #R_SHIFT]
        asrs    r2, r3
        bpl     1f
        movs    r2, #0
1:      cmp     r2, #127
        bls     2f
        movs    r2, #127
2:      ldr     r4, [r6, #R_VELOCITIES]
        ldrb    r4, [r4, r2]
        bl      key_bit
        orrs    r7, r3
        movs    r2, #0x90
        b       put
off:    bl      key_bit
        bics    r7, r3
        movs    r2, #0x80
        movs    r4, #64
put:    str     r7, [r5]
        add     r0, r12
        adds    r0, #FIRST_NOTE
        lsls    r0, r0, #8
        orrs    r2, r0
        lsls    r4, r4, #16
        orrs    r2, r4
        ldr     r4, =message
        str     r2, [r4]
        movs    r0, #3
        str     r0, [r4, #4]
        pop     {r4-r7, pc}
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
