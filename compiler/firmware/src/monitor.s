@ The monitor: answers requests on the serial port between ticks, on core 0, in place of MIDI (docs/monitor.md has the protocol).
@
@   bytes -> request -> done, at once or at other turns -> frames of an answer, filled a few words a turn -> bytes
@
@ A frame is COBS of | type | number | info, 2 bytes | words | CRC, 2 bytes | and a zero behind it. One request is done after the other;
@ what comes meanwhile waits in the port. A turn reads or writes few words, because they may be in the other core's memory and are
@ charged there (running.rs).
        .syntax unified
        .thumb
        .equ    M_STATE, 0              @ LISTENS, DOES, FILLS or SENDS
        .equ    M_OPEN, 4               @ whether a frame has begun
        .equ    M_LEFT, 8               @ bytes up to the next of its codes
        .equ    M_COUNT, 12             @ bytes of the request
        .equ    M_CRC, 16
        .equ    M_WRONG, 20             @ not 0 where something is wrong in it
        .equ    M_GIVEN, 24             @ how many words it has
        .equ    M_FROM, 28              @ what is answered
        .equ    M_WORDS, 32             @ words of it that are left
        .equ    M_FILLED, 36            @ bytes in this frame
        .equ    M_SENT, 40              @ its next byte, its end
        .equ    M_END, 44
        .equ    M_VALUE, 48
        .equ    M_COPIED, 52            @ words of a capture's setting that are in place, from 1
        .equ    M_REQUEST, 56
        .equ    REQUEST_MAX, 88
        .equ    M_FRAME, 152            @ in front of it the first code
        .equ    FRAME_DATA, 240
        .equ    LISTENS, 0
        .equ    DOES, 1
        .equ    FILLS, 2
        .equ    SENDS, 3
        .equ    BYTES, 16               @ of a turn
        .equ    BYTES_TAKEN, 96         @ a whole request
        .equ    PATIENCE, 250           @ looks for the next byte of one
        .equ    WORDS_READ, 4
        .equ    WORDS_MAX, 4096         @ of an answer
        .equ    AGAIN, 3

        .section .bss.monitor, "aw", %nobits
        .balign 4
monitor: .space M_FRAME + 4 + FRAME_DATA + 4

        .section .text.firmware.monitor, "ax"
        .global monitor_step
        .type   monitor_step, %function
monitor_step:
        push    {r4-r7, lr}
        ldr     r4, =monitor
        .if     CORES > 1
        bl      follow
        .endif
        ldr     r0, [r4, #M_STATE]
        cmp     r0, #DOES
        beq     does
        blo     listen
        cmp     r0, #FILLS
        bne     1f
        b       fill
1:      b       send

@ What arrives, up to the end of a frame: between two turns more may come than a port holds, so the rest of a request is waited for.
listen: movs    r7, #BYTES_TAKEN
        movs    r6, #0
1:      bl      board_serial_take
        cmp     r0, #0
        bge     3f
        subs    r6, #1
        bpl     1b
        b       out
3:      movs    r6, #PATIENCE
        lsrs    r1, r0, #8
        bne     wrong
        cmp     r0, #0
        beq     whole
        ldr     r1, [r4, #M_LEFT]
        cmp     r1, #0
        bne     2f
        subs    r1, r0, #1              @ a code: a zero stands behind so many bytes
        str     r1, [r4, #M_LEFT]
        movs    r0, #0
        ldr     r1, [r4, #M_OPEN]
        cmp     r1, #0
        bne     put
        movs    r1, #1
        str     r1, [r4, #M_OPEN]
        b       next
2:      subs    r1, #1
        str     r1, [r4, #M_LEFT]
put:    ldr     r1, [r4, #M_COUNT]
        cmp     r1, #REQUEST_MAX
        bhs     wrong
        adds    r2, r4, r1
        adds    r2, #M_REQUEST
        strb    r0, [r2]
        adds    r1, #1
        str     r1, [r4, #M_COUNT]
        ldr     r1, [r4, #M_CRC]
        bl      add_to_crc
        str     r1, [r4, #M_CRC]
next:   subs    r7, #1
        bne     1b
out:    pop     {r4-r7, pc}
wrong:  movs    r0, #1
        str     r0, [r4, #M_WRONG]
        b       next

@ A zero: the frame is whole, and right where with its CRC nothing remains.
whole:  ldr     r0, [r4, #M_WRONG]
        ldr     r1, [r4, #M_LEFT]
        orrs    r0, r1
        ldr     r1, [r4, #M_CRC]
        orrs    r0, r1
        ldr     r1, [r4, #M_COUNT]
        movs    r2, #0
        str     r2, [r4, #M_WRONG]
        str     r2, [r4, #M_LEFT]
        str     r2, [r4, #M_CRC]
        str     r2, [r4, #M_COUNT]
        str     r2, [r4, #M_OPEN]
        subs    r1, #6
        bmi     next
        cmp     r0, #0
        bne     next                    @ nobody is answered: who asked asks again
        lsrs    r1, r1, #2
        str     r1, [r4, #M_GIVEN]
        str     r2, [r4, #M_COPIED]
        movs    r0, #DOES
        str     r0, [r4, #M_STATE]
        b       out

@ R1: the CRC with the byte R0 behind it; polynomial 0x1021, from 0. Keeps R0.
add_to_crc:
        lsrs    r2, r1, #8
        eors    r2, r0
        lsrs    r3, r2, #4
        eors    r2, r3
        lsls    r1, r1, #8
        eors    r1, r2
        lsls    r3, r2, #5
        eors    r1, r3
        lsls    r3, r2, #12
        eors    r1, r3
        uxth    r1, r1
        bx      lr

@ A request. What cannot be done at once is done at another turn.
does:   movs    r0, #0
        str     r0, [r4, #M_WORDS]
        movs    r5, r4
        adds    r5, #M_REQUEST
        ldrb    r6, [r5]
        adds    r5, #4                  @ its words
        ldr     r7, [r4, #M_GIVEN]
        cmp     r6, #1
        beq     identify
        cmp     r6, #2
        beq     read
        cmp     r6, #3
        beq     set
        cmp     r6, #4
        beq     get
        cmp     r6, #5
        bne     1f
        b       capturing
1:      movs    r0, #4
        b       answer
short:  movs    r0, #5
        b       answer

identify:
        ldr     r0, =monitor_facts
        movs    r1, #FACTS
give:   str     r0, [r4, #M_FROM]
        str     r1, [r4, #M_WORDS]
done:   movs    r0, #0
        b       answer

read:   cmp     r7, #2
        bne     short
        ldr     r0, [r5]
        ldr     r1, [r5, #4]
        subs    r2, r1, #1
        ldr     r3, =WORDS_MAX
        cmp     r2, r3
        bhs     range
        bl      in_memory
        bne     outside
        ldr     r0, [r5]
        ldr     r1, [r5, #4]
        b       give
range:  movs    r0, #2
        b       answer
outside:
        movs    r0, #6
        b       answer

set:    cmp     r7, #2
        bne     short
        ldr     r0, [r5]
        ldr     r1, [r5, #4]
        bl      whippen_set
        .if     LATCH
        cmp     r0, #AGAIN
        beq     out
        .endif
        b       answer

get:    cmp     r7, #1
        bne     short
        ldr     r0, [r5]
        ldr     r1, =lives
        ldr     r1, [r1]
        cmp     r0, r1
        bhs     none
        bl      whippen_get
        str     r0, [r4, #M_VALUE]
        movs    r0, r4
        adds    r0, #M_VALUE
        movs    r1, #1
        b       give
none:   movs    r0, #1

@ R0: what came of it, in the info of every frame; the number of the frame is beside it.
answer: ldr     r1, [r4, #M_REQUEST]
        uxth    r1, r1
        lsls    r0, r0, #16
        orrs    r0, r1
        adds    r0, #0x80
        ldr     r1, =monitor + M_FRAME
        str     r0, [r1]
        movs    r0, #0
        str     r0, [r4, #M_FILLED]
        movs    r0, #FILLS
        str     r0, [r4, #M_STATE]
        pop     {r4-r7, pc}

@ Some words into the frame; then its CRC and its codes.
fill:   ldr     r0, [r4, #M_FROM]
        ldr     r1, [r4, #M_WORDS]
        ldr     r5, [r4, #M_FILLED]
        ldr     r6, =monitor + M_FRAME + 4
        movs    r7, #WORDS_READ
1:      cmp     r1, #0
        beq     2f
        cmp     r5, #FRAME_DATA
        beq     2f
        ldr     r2, [r0]
        str     r2, [r6, r5]
        adds    r0, #4
        adds    r5, #4
        subs    r1, #1
        subs    r7, #1
        bne     1b
        str     r0, [r4, #M_FROM]
        str     r1, [r4, #M_WORDS]
        str     r5, [r4, #M_FILLED]
        pop     {r4-r7, pc}
2:      str     r0, [r4, #M_FROM]
        str     r1, [r4, #M_WORDS]
        subs    r6, #4                  @ from its header on
        adds    r5, r5, r6
        adds    r5, #4                  @ the end of its words
        movs    r7, r6
        movs    r1, #0
3:      ldrb    r0, [r7]
        bl      add_to_crc
        adds    r7, #1
        cmp     r7, r5
        bne     3b
        lsrs    r0, r1, #8
        strb    r0, [r7]
        strb    r1, [r7, #1]
        adds    r7, #2
        subs    r5, r6, #1              @ where the code is that is to come
        str     r5, [r4, #M_SENT]
4:      ldrb    r0, [r6]
        cmp     r0, #0
        bne     5f
        subs    r0, r6, r5
        strb    r0, [r5]
        movs    r5, r6
5:      adds    r6, #1
        cmp     r6, r7
        bne     4b
        subs    r0, r6, r5
        strb    r0, [r5]
        movs    r0, #0
        strb    r0, [r6]
        adds    r6, #1
        str     r6, [r4, #M_END]
        movs    r0, #SENDS
        str     r0, [r4, #M_STATE]
        pop     {r4-r7, pc}

@ As many bytes as the port takes; then the next frame, if the answer has more.
send:   movs    r7, #BYTES
        ldr     r5, [r4, #M_SENT]
        ldr     r6, [r4, #M_END]
1:      bl      board_serial_ready
        cmp     r0, #0
        beq     2f
        ldrb    r0, [r5]
        bl      board_serial_send
        adds    r5, #1
        cmp     r5, r6
        beq     3f
        subs    r7, #1
        bne     1b
2:      str     r5, [r4, #M_SENT]
        pop     {r4-r7, pc}
3:      ldr     r0, [r4, #M_WORDS]
        cmp     r0, #0
        beq     4f
        ldr     r1, =monitor + M_FRAME  @ its header has been changed by codes: anew, with the next number
        ldr     r0, [r4, #M_REQUEST]
        uxth    r0, r0
        adds    r0, #0x80
        ldr     r2, [r4, #M_COPIED]
        adds    r2, #1
        str     r2, [r4, #M_COPIED]
        lsls    r2, r2, #24
        orrs    r0, r2
        str     r0, [r1]
        movs    r0, #0
        str     r0, [r4, #M_FILLED]
        movs    r0, #FILLS
        b       5f
4:      movs    r0, #LISTENS
5:      str     r0, [r4, #M_STATE]
        pop     {r4-r7, pc}

@ A capture's setting: what it has is judged, the ring is stopped until no tick of its core can be in it, then it is put in place, a few
@ words a turn, and starts. R5: the words of the request, R7: how many.
capturing:
        cmp     r7, #SETTING + 1
        beq     1f
        b       short
1:      ldr     r0, [r5]                @ the core
        adds    r5, #4
        cmp     r0, #CORES
        blo     1f
        b       range
1:      ldr     r7, =monitor_captures
        lsls    r0, r0, #4
        adds    r7, r7, r0              @ its block, its capture, what memory it has
        ldr     r0, [r4, #M_COPIED]
        cmp     r0, #0
        bne     2f
        bl      judge
        cmp     r0, #0
        bne     answer_it
        movs    r0, #1
        str     r0, [r4, #M_COPIED]
2:      ldr     r6, [r7]
        ldr     r1, [r6, #C_TICK]
        ldr     r6, [r7, #4]
        ldr     r2, [r6, #V_NEXT]
        cmp     r2, #0
        beq     3f
        movs    r2, #0
        str     r2, [r6, #V_NEXT]
        str     r1, [r6, #V_HALT]
        pop     {r4-r7, pc}
3:      ldr     r2, [r6, #V_HALT]
        subs    r2, r1, r2
        cmp     r2, #2
        blo     9f
        subs    r0, #1
        bne     7f
        str     r0, [r6, #V_GROUP]      @ it belongs to none until its group is there, the last word
7:      cmp     r0, #SETTING
        beq     5f
        lsls    r2, r0, #2
        adds    r6, #V_SETTING
        movs    r3, #WORDS_READ
4:      ldr     r1, [r5, r2]
        str     r1, [r6, r2]
        adds    r0, #1
        adds    r2, #4
        cmp     r0, #SETTING
        beq     6f
        subs    r3, #1
        bne     4b
6:      adds    r0, #1
        str     r0, [r4, #M_COPIED]
9:      pop     {r4-r7, pc}
5:      ldr     r2, [r7, #8]            @ where the ring begins
        str     r2, [r6, #V_START]
        ldr     r3, [r5, #V_BYTES - V_SETTING]
        adds    r3, r3, r2
        str     r3, [r6, #V_END]
        str     r1, [r6, #V_AT]
        str     r1, [r6, #V_HALT]
        ldr     r3, [r5, #V_POST - V_SETTING]
        adds    r3, r3, r1
        str     r3, [r6, #V_STOP]
        dmb     sy
        str     r2, [r6, #V_NEXT]
        movs    r0, #0
        str     r0, [r4, #M_COPIED]
answer_it:
        b       answer

        .ltorg
