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
        cbnz    r5, 1f
        ldr     r0, =core0
        ldr     r1, =reader0
        bl      take
        .if     CORES > 1
        cbnz    r0, 1f
        ldr     r0, =core1
        ldr     r1, =reader1
        bl      take
        .endif
1:      ldr     r5, [r4, #4]            @ as much as the port takes
        cbz     r5, 9f
        bl      board_serial_ready
        cbz     r0, 9f
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
take:   push    {r4-r10, lr}
        ldr     r9, [r0, #C_PROGRAM]
        ldr     r6, [r0, #C_FIRST]
        ldr     r10, [r1], #4           @ R1: the bits of its keys
        cmp     r10, #0
        beq     begun
        ldr     r8, [r10, #P_READER]
        ldr     r5, [r8, #R_STATE]
        ldr     r7, [r5, #T_TAIL]
        ldr     r2, [r5, #T_HEAD]
        cmp     r7, r2
        beq     empty
        dmb     sy
        movw    r3, #EVENTS_BYTES - 1
        ldr     r2, [r8, #R_EVENTS]
        ands    r3, r7
        add     r2, r2, r3              @ tick, key, event, arguments
        ldr     r3, [r8, #R_EVENT]
        ldrh    r0, [r2, #4]
        ldrh    r12, [r2, #6]
        ldr     r2, [r2, #8]
        add     r7, r7, r3
        dmb     sy
        str     r7, [r5, #T_TAIL]
        lsrs    r5, r0, #5              @ the key's bit: R4 of the word at R5
        add     r5, r1, r5, lsl #2
        movs    r4, #1
        and     r3, r0, #31
        lsls    r4, r3
        ldr     r7, [r5]
        ldr     r3, [r8, #R_RELEASE]
        cmp     r12, r3
        beq     off
        ldr     r3, [r8, #R_NOTE]
        cmp     r12, r3
        bne     none
        orrs    r7, r4
        ldr     r3, [r8, #R_SHIFT]
        asrs    r2, r3
        usat    r2, #7, r2
        ldr     r1, [r8, #R_VELOCITIES]
        ldrb    r1, [r1, r2]
        movs    r2, #0x90
        b       put
off:    bics    r7, r4
        movs    r2, #0x80
        movs    r1, #64
put:    str     r7, [r5]
        adds    r0, r6
        adds    r0, #FIRST_NOTE
        orr     r2, r2, r0, lsl #8
        orr     r2, r2, r1, lsl #16
        ldr     r4, =message
        str     r2, [r4]
        movs    r0, #3
        str     r0, [r4, #4]
        pop     {r4-r10, pc}
empty:  cmp     r10, r9
        beq     none
        movs    r0, #0                  @ another program plays: the first key that still sounds
1:      lsrs    r5, r0, #5
        add     r5, r1, r5, lsl #2
        ldr     r7, [r5]
        cbnz    r7, 2f
        adds    r0, #32
        cmp     r0, #256
        blo     1b
begun:  str     r9, [r1, #-4]
none:   movs    r0, #0
        pop     {r4-r10, pc}
2:      rbit    r3, r7
        clz     r3, r3
        add     r0, r0, r3
        movs    r4, #1
        lsls    r4, r3
        b       off
