@ What a tick needs of a board with columns of converters: words of the ADCs that the DMA has put into rings, words for the DACs that it
@ takes from memory. Assembled for each core that plays, and once for the start. Core 0 alone goes to the registers of PIO and DMA.
@
@   board_begin   core 0: words of the tick before are sent, of all columns -> where the DMA has come to in every ring -> newest words ->
@                 sensor words, of one half alone
@                 core 1: what core 0 said of this tick -> newest words of its own columns -> sensor words
@   board_end     drive words -> words of the DACs, in the half that is sent next; core 0: what is to be of the next tick
        .syntax unified
        .thumb
        .section .text.frame, "ax"

@ R0: the number of this tick; R1: 0. Frames of the coming tick begin at once, so what the tick before has made is sent first. A tick that
@ is late for that, finds words in a queue that should have gone, or core 1 not done, sends nothing, and counts as missed: all forces go to
@ zero. So they do where no eight is new and whole in every ring, because frames stop, a word was lost or one came too many. After 10 ms of
@ that, or eight ticks in a row that sent nothing, the amplifiers are switched off; so they are at once where one tells of a fault.
        .global board_begin
        .type   board_begin, %function
board_begin:
        .if     CORE == 0
        ldr     r3, =PIO0
        ldr     r4, =PWM
        ldr     r1, =DMA
        ldr     r3, [r3, #0xc]          @ FLEVEL
        ldr     r5, =LEVELS0
        ldr     r7, =columns
        movw    r0, #SENDERS
        ands    r3, r3, r5
        .if     LEVELS2
        ldr     r5, =PIO2
        ldr     r6, =LEVELS2
        ldr     r5, [r5, #0xc]
        and     r5, r5, r6
        orrs    r3, r3, r5
        .endif
        ldr     r12, [r7, #B_TICK]
        .if     (CORES - 1) * (1 - START)
        ldr     r5, =columns1
        ldr     r5, [r5, #D_DONE]
        eor     r5, r5, r12
        orrs    r3, r3, r5
        .endif
        .global board_timed, board_looks
        ldr     r2, [r4, #20 * TICK_SLICE + 8] @ CTR: how long ago the wrap was
board_timed:
        it      ne
        movne   r2, #LATE + 1
        cmp     r2, #LATE
        it      ls
        strls   r0, [r1, #0x450]        @ MULTI_CHAN_TRIGGER
        mov     r0, #1 << TICK_SLICE
        str     r0, [r4, #0xf4]         @ INTR
board_looks:
        ldr     r3, [r1, #0x44]         @ WRITE_ADDR of channel 1: column 0
        movs    r5, #0
        .set    NTH, 1
        .rept   (COLUMNS_USED - 1) / 2
        ldr     r0, [r1, #0x44 + 0x80 * NTH]
        ldr     r4, [r1, #0xc4 + 0x80 * NTH]
        eor     r0, r0, r3
        eor     r4, r4, r3
        orr     r5, r5, r0
        orr     r5, r5, r4
        .set    NTH, NTH + 2
        .endr
        .rept   (COLUMNS_USED - 1) % 2
        ldr     r0, [r1, #0x44 + 0x80 * NTH]
        eor     r0, r0, r3
        orr     r5, r5, r0
        .endr
        ldr     r6, [r7, #B_AT]
        lsls    r5, r5, #32 - RING_BITS
        orrs    r5, r5, r3, lsl #28
        bne     stale
        sub     r6, r3, r6
        lsls    r6, r6, #32 - RING_BITS
        beq     stale
        add     r0, r12, r6, lsr #36 - RING_BITS
        str     r3, [r7, #B_AT]
        str     r0, [r7, #B_TICK]
        .if     FAULT_WIRED
        ldr     r5, =0xd0000000
        ldr     r5, [r5, #4]            @ SIO: GPIO_IN
        lsls    r5, r5, #31 - PIN_FAULT
        bpl     pulled
        .endif
        .if     START == 0
        cmp     r2, #LATE
        bhi     unsent
        .endif
        movs    r1, #0
        str     r1, [r7, #B_AGE]
        sub     r3, r3, #16
        ldr     r2, =samples
        ubfx    r3, r3, #0, #RING_BITS
        add     r2, r2, r3
        ldr     r3, =words0
        .set    KEYS_HERE, KEYS0
        .else
        ldr     r1, =PWM
        ldr     r7, =columns1
        mov     r0, #1 << TICK_SLICE1
        str     r0, [r1, #0xf4]         @ INTR
        ldr     r6, =core1
        ldrd    r0, r2, [r7, #D_NEXT]   @ and D_AT
        ldr     r3, [r7, #D_HALF]
        ldr     r5, [r6, #C_TICK]
        str     r3, [r7, #D_OWN_HALF]
        adds    r5, #1
        movs    r4, #0
        cmp     r0, r5
        bne     astray
1:      str     r4, [r7, #D_AGE]
        ldr     r3, =samples1
        ubfx    r2, r2, #0, #RING_BITS
        movs    r1, #0
        add     r2, r2, r3
        ldr     r3, =words1
        .set    KEYS_HERE, KEYS1
        .endif
        .set    NTH, 0                  @ by STRD, as it is known where that goes
        .rept   KEYS_HERE / 8
        ldmia   r2, {r4-r7}
        strd    r4, r5, [r3, #16 * NTH]
        strd    r6, r7, [r3, #16 * NTH + 8]
        add     r2, r2, #1 << RING_BITS
        .set    NTH, NTH + 1
        .endr
        .set    NTH, 0
        .rept   (KEYS_HERE % 8 + 1) / 2
        ldr     r4, [r2, #4 * NTH]
        str     r4, [r3, #16 * (KEYS_HERE / 8) + 4 * NTH]
        .set    NTH, NTH + 1
        .endr
        .if     (CORES - 1) * START     @ keys of core 1 start from where they are, too
        ldr     r2, =columns
        ldr     r3, =samples1
        ldr     r2, [r2, #B_AT]
        sub     r2, r2, #16
        ubfx    r2, r2, #0, #RING_BITS
        add     r2, r2, r3
        ldr     r3, =words1
        .rept   KEYS1 / 8
        ldmia   r2, {r4-r7}
        stmia   r3!, {r4-r7}
        add     r2, r2, #1 << RING_BITS
        .endr
        .set    NTH, 0
        .rept   (KEYS1 % 8 + 1) / 2
        ldr     r4, [r2, #4 * NTH]
        str     r4, [r3, #4 * NTH]
        .set    NTH, NTH + 1
        .endr
        .endif
        bx      lr

        .if     CORE == 0
        .if     FAULT_WIRED             @ an amplifier tells of a fault: all are off, and this tick is a missed one
pulled: ldr     r2, =core0
        ldr     r3, [r2, #C_FAULTS]
        ldr     r4, =0xd0000000
        orr     r3, r3, #FAULT_DRIVER
        str     r3, [r2, #C_FAULTS]
        ldr     r3, =1 << PIN_ENABLE
        str     r3, [r4, #0x20]         @ SIO: GPIO_OUT_CLR
        movs    r4, #0
        b       3f
        .endif
unsent: movs    r4, #AGE_UNSENT
        b       3f
stale:  bic     r3, r3, #15
        add     r0, r12, #1
        str     r3, [r7, #B_AT]
        str     r0, [r7, #B_TICK]
        movs    r4, #1
3:      ldr     r2, =core0
        ldr     r3, [r2, #C_TICK]       @ so that this tick is a missed one
        cbz     r3, 4f
        subs    r3, #1
        str     r3, [r2, #C_TICK]
4:      ldr     r3, [r7, #B_AGE]
        movs    r1, #0
        adds    r4, r4, r3
        movw    r3, #AGE_WRONG
        str     r4, [r7, #B_AGE]
        .else
@ The number is not the one that comes next. Where ticks of this core were missed, that is counted; where core 0 has said nothing new,
@ it has not finished its tick, and this core lets go of its keys.
astray: cmp     r5, #1                  @ the first tick may have any number
        beq     1b
        subs    r3, r0, r5
        bpl     1b
        subs    r3, r0, #2
        str     r3, [r6, #C_TICK]
        ldr     r2, =codes1             @ what core 0 sends when it goes on is no force
        ldr     r3, =FREE
        .set    NTH, 0
        .rept   16 * ((KEYS1 + 7) / 8)
        str     r3, [r2, #4 * NTH]
        .set    NTH, NTH + 1
        .endr
        ldr     r4, [r7, #D_AGE]
        movs    r1, #0
        adds    r4, #1
        movs    r3, #BEHIND
        str     r4, [r7, #D_AGE]
        mov     r2, r6
        .endif
        cmp     r4, r3
        it      ls
        bxls    lr
        ldr     r3, [r2, #C_FAULTS]
        orr     r3, r3, #FAULT_SENSOR
        str     r3, [r2, #C_FAULTS]
        ldr     r2, =0xd0000000
        ldr     r3, =1 << PIN_ENABLE
        str     r3, [r2, #0x20]         @ SIO: GPIO_OUT_CLR
        bx      lr

@ The drive words are in place, two in each word. A word for a DAC: write and update one channel, its number, the code from bit 4 on,
@ with 0x8000 for no force. What lies below the code is ignored. The DMA has come to the end of a half or stands within one, of which the
@ word before tells; the other half is sent next, and then that one. Core 1 lets go of all its keys where the alarm came up meanwhile.
        .global board_end
        .type   board_end, %function
board_end:
        .if     CORE == 0
        ldr     r1, =DMA
        .if     CORES > 1
        ldr     r7, =columns
        ldr     r6, [r1, #0x80]         @ READ_ADDR of channel 2: column 0
        ldr     r4, [r7, #B_TICK]
        ldr     r5, [r7, #B_AT]
        ldr     r7, =columns1
        .if     START
        str     r4, [r7, #D_DONE]       @ core 1 does not play yet
        .endif
        adds    r4, #1
        .else
        ldr     r6, [r1, #0x80]
        .endif
        sub     r6, r6, #4
        ldr     r0, =codes
        and     r6, r6, #32
        .if     CORES > 1
        strd    r4, r5, [r7, #D_NEXT]   @ and D_AT
        str     r6, [r7, #D_HALF]
        .endif
        rsb     r6, r6, #32
        ldr     r1, =words0 + DISTANCE0
        add     r0, r0, r6
        .set    KEYS_HERE, KEYS0
        .else
        ldr     r5, =alarm
        ldr     r6, =core1
        ldr     r7, =columns1
        ldr     r5, [r5]
        ldr     r4, [r6, #C_ALARM]
        ldr     r6, [r7, #D_OWN_HALF]
        ldr     r0, =codes1
        cmp     r5, r4
        bne     let_go
        and     r6, r6, #32
        ldr     r1, =words1 + DISTANCE1
        add     r0, r0, r6
        .set    KEYS_HERE, KEYS1
        .endif
        .set    COLUMNS_HERE, (KEYS_HERE + 7) / 8
        ldr     r4, [r1]
        ldr     r2, =0x03080000
        ldr     r3, =0x03180000
        .set    NTH, 0                  @ a pair of channels of each column, then the next pair
        .rept   4 * COLUMNS_HERE
        .set    COLUMN, NTH % COLUMNS_HERE
        .set    PAIR, NTH / COLUMNS_HERE
        .set    KEY, 8 * COLUMN + 2 * PAIR
        .set    NTH, NTH + 1
        sxth    r5, r4
        .if     PULLS_DOWN
        asr     r6, r4, #16
        .else
        add     r6, r3, r4, asr #12
        .endif
        .if     4 * COLUMNS_HERE - NTH
        ldr     r4, [r1, #16 * (NTH % COLUMNS_HERE) + 4 * (NTH / COLUMNS_HERE)]
        .endif
        .if     PULLS_DOWN
        rsb     r5, r5, #0
        rsb     r6, r6, #0
        ssat    r5, #16, r5
        ssat    r6, #16, r6
        add     r6, r3, r6, lsl #4
        .endif
        add     r5, r2, r5, lsl #4
        .if     KEY < KEYS_HERE
        str     r5, [r0, #64 * COLUMN + 8 * PAIR]
        .endif
        .if     KEY + 1 < KEYS_HERE
        str     r6, [r0, #64 * COLUMN + 8 * PAIR + 4]
        .endif
        .if     COLUMN == COLUMNS_HERE - 1
        add     r2, r2, #0x200000
        add     r3, r3, #0x200000
        .endif
        .endr
        .if     CORE
5:      ldr     r6, =core1
        ldr     r4, [r6, #C_TICK]
        str     r4, [r7, #D_DONE]
        bx      lr
let_go: ldr     r2, =FREE               @ in whatever is sent next
        .set    NTH, 0
        .rept   16 * COLUMNS_HERE
        str     r2, [r0, #4 * NTH]
        .set    NTH, NTH + 1
        .endr
        b       5b
        .else
        bx      lr
        .endif
        .ltorg
