@ Events to MIDI: `note` becomes note on, with a velocity by table from its speed, `release` note off.
@
@   ring of core 0, ring of core 1 -> message of three bytes -> serial port, a byte whenever it takes one
        .syntax unified
        .thumb
        .equ    T_HEAD, 0
        .equ    T_TAIL, 4

        .section .bss.core1.midi, "aw", %nobits
        .balign 4
message: .space 8                       @ bytes that are left, how many

        .section .text.core1.firmware.midi, "ax"
        .global midi_step
        .type   midi_step, %function
midi_step:
        push    {r4, r5, r6, lr}
        ldr     r4, =message
        ldr     r5, [r4, #4]
        cbnz    r5, 1f
        ldr     r0, =core0
        bl      take
        cbnz    r0, 1f
        ldr     r0, =core1
        bl      take
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

@ The oldest event of the core at R0 into the message. R0: whether there was one that is sent.
take:   push    {r4, r5, r6, r7, lr}
        ldr     r6, [r0, #C_FIRST]
        ldr     r5, [r0, #C_STATE]
        ldr     r1, [r5, #T_TAIL]
        ldr     r2, [r5, #T_HEAD]
        cmp     r1, r2
        beq     none
        dmb     sy
        movw    r2, #EVENTS
        movw    r3, #EVENTS_BYTES - 1
        ands    r3, r1
        adds    r2, r3
        adds    r2, r5                  @ tick, key, event, arguments
        ldrh    r3, [r2, #4]
        ldrh    r12, [r2, #6]
        ldr     r7, [r2, #8]
        adds    r1, #EVENT
        dmb     sy
        str     r1, [r5, #T_TAIL]
        adds    r3, r6
        adds    r3, #FIRST_NOTE
        cmp     r12, #EVENT_RELEASE
        beq     off
        cmp     r12, #EVENT_NOTE
        bne     none
        asrs    r7, r7, #SPEED_SHIFT
        usat    r7, #7, r7
        ldr     r1, =velocities
        ldrb    r1, [r1, r7]
        movs    r2, #0x90
        b       put
off:    movs    r2, #0x80
        movs    r1, #64
put:    orr     r2, r2, r3, lsl #8
        orr     r2, r2, r1, lsl #16
        str     r2, [r4]
        movs    r0, #3
        str     r0, [r4, #4]
        pop     {r4, r5, r6, r7, pc}
none:   movs    r0, #0
        pop     {r4, r5, r6, r7, pc}
