@ What a tick needs of a board with columns of converters: words of the ADCs that the DMA has put into rings, words for the DACs that it
@ takes from memory. Assembled for the core that plays, and once for the start.
@
@   board_begin   words of the tick before are sent -> where the DMA has come to in every ring -> newest words -> sensor words, of one
@                 half alone
@   board_end     drive words -> words of the DACs, in the half that is sent next
        .syntax unified
        .thumb
        .section .text.frame, "ax"

@ R0: the number of this tick: as many as there were eights of words; R1: 0. Frames of the coming tick begin at once, so what the tick
@ before has made is sent first. A tick that is late for that, or finds words in a queue that should have gone, sends nothing, and its
@ number is one too large: that is a missed tick, so all forces go to zero. So it is where no eight is new and whole in every ring,
@ because frames stop, a word was lost or one came too many: sensor words stay as they were. After 10 ms of that the amplifiers are
@ switched off.
        .global board_begin
        .type   board_begin, %function
board_begin:
        ldr     r1, =PWM
        mov     r0, #1 << TICK_SLICE
        str     r0, [r1, #0xf4]         @ INTR
        ldr     r2, [r1, #20 * TICK_SLICE + 8] @ CTR: how long ago that was
        ldr     r3, =PIO0
        ldr     r5, =LEVELS0
        ldr     r3, [r3, #0xc]          @ FLEVEL
        ldr     r1, =DMA
        movw    r0, #SENDERS
        ands    r3, r3, r5
        bne     1f
        .if     LEVELS2
        ldr     r3, =PIO2
        ldr     r5, =LEVELS2
        ldr     r3, [r3, #0xc]
        ands    r3, r3, r5
        bne     1f
        .endif
        cmp     r2, #LATE
        bhi     2f
        str     r0, [r1, #0x450]        @ MULTI_CHAN_TRIGGER
        b       2f
1:      mov     r2, #LATE + 1
2:      ldr     r3, [r1, #0x44]         @ WRITE_ADDR of channel 1: column 0
        movs    r5, #0
        .set    NTH, 1
        .rept   COLUMNS_USED - 1
        ldr     r0, [r1, #0x44 + 0x80 * NTH]
        eor     r0, r0, r3
        orr     r5, r5, r0
        .set    NTH, NTH + 1
        .endr
        ldr     r7, =columns
        lsls    r5, r5, #32 - RING_BITS
        ldr     r6, [r7, #B_AT]
        ldr     r0, [r7, #B_TICK]
        orrs    r5, r5, r3, lsl #28
        bne     stale
        sub     r6, r3, r6
        ubfx    r6, r6, #4, #RING_BITS - 4
        cbz     r6, stale
        add     r0, r0, r6
        cmp     r2, #LATE
        it      hi
        addhi   r0, r0, #1
        str     r3, [r7, #B_AT]
        str     r0, [r7, #B_TICK]
        movs    r1, #0
        str     r1, [r7, #B_AGE]
        sub     r3, r3, #16
        ldr     r2, =samples
        ubfx    r3, r3, #0, #RING_BITS
        add     r2, r2, r3
        ldr     r3, =words0
        .rept   KEYS0 / 8
        ldmia   r2, {r4-r7}
        stmia   r3!, {r4-r7}
        add     r2, r2, #1 << RING_BITS
        .endr
        .set    NTH, 0
        .rept   (KEYS0 % 8 + 1) / 2
        ldr     r4, [r2, #4 * NTH]
        str     r4, [r3, #4 * NTH]
        .set    NTH, NTH + 1
        .endr
        bx      lr

stale:  ldr     r1, [r7, #B_AGE]
        adds    r0, #2
        adds    r1, #1
        str     r0, [r7, #B_TICK]
        str     r1, [r7, #B_AGE]
        movw    r2, #AGE_WRONG
        cmp     r1, r2
        movw    r1, #0
        it      ls
        bxls    lr
        ldr     r2, =0xd0000000
        ldr     r3, =1 << PIN_ENABLE
        str     r3, [r2, #0x20]         @ SIO: GPIO_OUT_CLR
        ldr     r2, =core0
        ldr     r3, [r2, #C_FAULTS]
        orr     r3, r3, #FAULT_SENSOR
        str     r3, [r2, #C_FAULTS]
        bx      lr

@ The drive words are in place, two in each word. A word for a DAC: write and update one channel, its number, the code from bit 4 on,
@ with 0x8000 for no force. What lies below the code is ignored. The DMA has come to the end of a half or stands within one, of which the
@ word before tells; the other half is sent next.
        .global board_end
        .type   board_end, %function
board_end:
        ldr     r1, =DMA
        ldr     r2, [r1, #0x80]         @ READ_ADDR of channel 2: column 0
        ldr     r0, =codes
        sub     r2, r2, #4
        and     r2, r2, #32
        eor     r2, r2, #32
        add     r0, r0, r2
        ldr     r1, =words0 + DISTANCE0
        ldr     r2, =0x03080000
        ldr     r3, =0x03180000
        .set    NTH, 0
        .rept   (KEYS0 + 1) / 2
        ldr     r4, [r1, #4 * NTH]
        sxth    r5, r4
        .if     PULLS_DOWN
        asr     r4, r4, #16
        rsb     r5, r5, #0
        rsb     r4, r4, #0
        ssat    r5, #16, r5
        ssat    r4, #16, r4
        add     r6, r3, r4, lsl #4
        .else
        add     r6, r3, r4, asr #12
        .endif
        add     r5, r2, r5, lsl #4
        str     r5, [r0, #64 * (NTH / 4) + 8 * (NTH % 4)]
        .if     2 * NTH + 1 < KEYS0
        str     r6, [r0, #64 * (NTH / 4) + 8 * (NTH % 4) + 4]
        .endif
        .if     NTH % 4 == 3
        sub     r2, r2, #0x600000
        sub     r3, r3, #0x600000
        .else
        add     r2, r2, #0x200000
        add     r3, r3, #0x200000
        .endif
        .set    NTH, NTH + 1
        .endr
        bx      lr
        .ltorg
