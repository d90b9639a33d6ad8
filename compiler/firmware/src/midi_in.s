@ MIDI that arrives: a program change plays a program, control changes 102 to 119 set the first live parameters, on any channel.
@
@   serial port, a byte a round -> message -> whippen_play, or a live value that waits until whippen_set takes it
@
@ Real-time bytes may come anywhere and change nothing. A status byte of the system ends running status, and what follows it is passed
@ over up to the next status byte; so is a byte that is wrong, and what follows it or one that was lost. A value that waits has the
@ next byte wait in the port.
@
@ Where PASS says so every message of a channel goes on to the next chip: whole, with its status, into a ring that midi.s sends. Of a
@ ring without room the message is lost and counted. A control change 88 waits for the message that it belongs to, so that none of the
@ keys' own comes between.
        .syntax unified
        .thumb
        .equ    I_STATUS, 0             @ running status; 0 for none
        .equ    I_FIRST, 4              @ the first byte of data, NONE before it
        .equ    I_WAITS, 8              @ the parameter that waits, from 1; 0 for none
        .equ    I_VALUE, 12
        .equ    LOST, 0x800             @ with a byte: those before it were lost
        .equ    NONE, 0x80
        .equ    FIRST_CONTROL, 102
        .equ    CONTROLS, 18

        .section .bss.midi_in, "aw", %nobits
        .balign 4
midi_in: .space 16
        .if     PASS
        .global passed
passed: .space  PASSED_RING + 4 * PASSED    @ what goes on
        .endif

        .section .text.firmware.midi_in, "ax"
        .global midi_in_step
        .type   midi_in_step, %function
midi_in_step:
        push    {r4, lr}
        ldr     r4, =midi_in
        ldr     r0, [r4, #I_WAITS]
        cmp     r0, #0
        bne     set
        bl      board_serial_take
        cmp     r0, #0
        blt     done
        lsrs    r1, r0, #8
        beq     1f
        movs    r2, #0
        str     r2, [r4, #I_STATUS]
        .if     PASS
        ldr     r3, =passed
        str     r2, [r3, #PASSED_AHEAD]
        .endif
        uxtb    r0, r0
        cmp     r1, #LOST >> 8
        bne     done
1:      cmp     r0, #0xf8
        bhs     done                    @ real time
        cmp     r0, #0xf0
        bhs     system
        movs    r1, #NONE
        cmp     r0, #0x80
        blo     data
status_byte:
        str     r0, [r4, #I_STATUS]
        str     r1, [r4, #I_FIRST]
        .if     PASS
        ldr     r3, =passed
        str     r1, [r3, #PASSED_FIRST]
        .endif
        b       done
system: movs    r0, #0
        b       status_byte
data:   ldr     r2, [r4, #I_STATUS]
        .if     PASS
        bl      pass
        .endif
        lsrs    r2, r2, #4
        cmp     r2, #0xc
        beq     play
        cmp     r2, #0xb                @ of all others nothing is wanted
        bne     done
        ldr     r3, [r4, #I_FIRST]
        cmp     r3, #NONE
        beq     first
        str     r1, [r4, #I_FIRST]
        subs    r3, #FIRST_CONTROL
        cmp     r3, #CONTROLS
        bhs     done
        ldr     r2, =lives
        ldr     r1, [r2]
        cmp     r3, r1
        bhs     done
        adds    r1, r3, #1
        str     r1, [r4, #I_WAITS]
        lsls    r3, r3, #4
        adds    r3, r2, r3
        lsls    r1, r0, #7              @ 0 to 16384
        orrs    r1, r0
        lsrs    r0, r1, #13
        adds    r1, r1, r0
        ldr     r2, [r3, #12]           @ lowest, highest
        ldr     r3, [r3, #16]
        subs    r3, r3, r2
        lsrs    r0, r3, #14
        muls    r0, r1, r0
        adds    r2, r2, r0
        lsls    r3, r3, #18
        lsrs    r3, r3, #18
        muls    r3, r1, r3
        ldr     r0, =1 << 13            @ to the nearest
        adds    r3, r3, r0
        lsrs    r3, r3, #14
        adds    r2, r2, r3
        str     r2, [r4, #I_VALUE]
        ldr     r0, [r4, #I_WAITS]
set:    subs    r0, #1
        ldr     r1, [r4, #I_VALUE]
        bl      whippen_set
        .if     LATCH
        cmp     r0, #3
        beq     done                    @ at another turn
        .endif
        movs    r0, #0
        str     r0, [r4, #I_WAITS]
done:   pop     {r4, pc}
first:  str     r0, [r4, #I_FIRST]
        pop     {r4, pc}
play:   bl      whippen_play
        pop     {r4, pc}

        .if     PASS
@ R0: a byte of data under the status R2, 0 where it belongs to nothing. What is whole goes into the ring. Keeps R0, R1 and R2.
        .type   pass, %function
pass:   push    {r0, r1, r2, r4, r5, lr}
        cmp     r2, #0
        beq     9f
        ldr     r4, =passed
        lsrs    r3, r2, #5
        cmp     r3, #0xc0 >> 5          @ program change, pressure: one byte of data
        beq     1f
        ldr     r3, [r4, #PASSED_FIRST]
        cmp     r3, #NONE
        beq     8f
        str     r1, [r4, #PASSED_FIRST]
        lsls    r0, r0, #8
        orrs    r0, r3
1:      lsls    r0, r0, #8
        orrs    r0, r2                  @ the message, its status in the lowest byte
        ldr     r5, [r4, #PASSED_AHEAD]
        cmp     r5, #0
        bne     2f
        lsls    r1, r0, #16
        lsrs    r1, r1, #20
        ldr     r3, =PREFIX
        cmp     r1, r3
        beq     7f
2:      ldr     r1, [r4, #PASSED_HEAD]
        ldr     r2, =passed_sent
        ldr     r2, [r2]
        subs    r2, r1, r2
        cmp     r2, #PASSED - 2
        bhi     6f
        cmp     r5, #0
        beq     3f
        bl      put_on
        movs    r5, #0
        str     r5, [r4, #PASSED_AHEAD]
3:      mov     r5, r0
        bl      put_on
        dmb     sy
        str     r1, [r4, #PASSED_HEAD]
        b       9f
6:      movs    r5, #0                  @ no room
        str     r5, [r4, #PASSED_AHEAD]
        ldr     r1, [r4, #PASSED_LOST]
        adds    r1, #1
        str     r1, [r4, #PASSED_LOST]
        b       9f
7:      str     r0, [r4, #PASSED_AHEAD]
        b       9f
8:      str     r0, [r4, #PASSED_FIRST]
9:      pop     {r0, r1, r2, r4, r5, pc}

@ The message R5 is the R1st of the ring at R4.
put_on: movs    r2, #PASSED - 1
        ands    r2, r1
        lsls    r2, r2, #2
        adds    r2, r2, r4
        str     r5, [r2, #PASSED_RING]
        adds    r1, #1
        bx      lr
        .endif
