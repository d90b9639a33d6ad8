@ The start of columns of converters: state machines, converters, the DMA, pins. Called once, without interrupts.
@
@   enable low -> cores before the DMA at memory -> machines -> pins -> no force, ADC set up, reference -> DMA -> PWM -> words for 100 ms
@   -> enable                                      then, once all keys have begun and core 1 waits: both cores take their ticks
        .syntax unified
        .thumb

@ What is kept of the columns (offsets.rs).
        .section .bss.near.core0.columns, "aw", %nobits
        .balign 4
        .global columns
columns: .space 12

@ What core 0 says of the next tick: its number, where the DMA comes to before it, the half of words for the DACs; then which half core 1
@ writes in this one, how often in a row nothing new was said, and the last tick that it has finished.
        .if     CORES > 1
        .section .bss.near.core1.columns, "aw", %nobits
        .balign 4
        .global columns1
columns1: .space 24
        .endif

@ Words of the ADCs, by the DMA alone: a ring for each column.
        .section .bss.ring, "aw", %nobits
        .balign 1 << RING_BITS
        .global samples
samples: .space COLUMNS0 << RING_BITS
        .if     CORES > 1
        .section .bss.core1.ring, "aw", %nobits
        .balign 1 << RING_BITS
        .global samples1
samples1: .space (COLUMNS_USED - COLUMNS0) << RING_BITS
        .endif

@ Words for the DACs: two halves of eight for each column; a channel without a key has an idle word.
        .section .data.ring, "aw"
        .balign 64
        .global codes
codes:
        .rept   16 * COLUMNS0
        .word   IDLE
        .endr
commands:                               @ of ADCs, in the upper half: the last frame begins the sequence anew
        .word   0, 0, 0, 0, 0, 0, 0, 0xa000 << 16
        .if     CORES > 1
        .section .data.core1.ring, "aw"
        .balign 64
        .global codes1
codes1:
        .rept   16 * (COLUMNS_USED - COLUMNS0)
        .word   IDLE
        .endr
        .endif

        .section .text.start, "ax"
        .balign 4
@ Select and clock by side-set, the select above; a word is a frame, with a command in its upper half. 9 cycles a bit.
programs_of_machines:
        .short  0x90a0                  @ 0:  pull block      side 2
        .short  0xe53f                  @     set x, 31       side 0 [5]
        .short  0x6b01                  @ 2:  out pins, 1     side 1 [3]
        .short  0xa342                  @     nop             side 0 [3]
        .short  0x0042                  @     jmp x-- 2       side 0
@ A column: a word out and one in with each frame, whoever makes it; without a word it sends X, and what nobody takes is lost.
        .short  0x2080 | PIN_SELECT     @ 5:  wait 1 gpio
        .short  0x2000 | PIN_SELECT     @     wait 0 gpio
        .short  0x8080                  @     pull noblock
        .short  0xe05f                  @     set y, 31
        .short  0x6401                  @ 9:  out pins, 1     [4]
        .short  0x4201                  @     in pins, 1      [2]
        .short  0x0089                  @     jmp y-- 9
        .short  0x8000                  @     push noblock
        .balign 4

@ (command of the ADCs, word of the DACs), a frame each. No force comes first: a DAC keeps its codes while the chip starts anew.
frames:
        .word   0x8500 << 16, FREE      @ ADC: reset
        .word   0, 0x08000001           @ DAC: its own reference
        .set    NTH, 5
        .rept   8
        .word   (NTH << 9 | 1 << 8 | RANGE) << 16, FREE
        .set    NTH, NTH + 1
        .endr
        .word   0xa000 << 16, FREE      @ ADC: the sequence begins with the next frame
frames_end:

        .global board_converter
        .type   board_converter, %function
board_converter:
        push    {r4-r7, lr}
        bl      board_watchdog
        ldr     r0, =RESETS + 0x3000    @ clear: BUSCTRL, DMA, PIO0, PIO2, PWM
        ldr     r1, =1 << 1 | 1 << 2 | 1 << 11 | 1 << 13 | 1 << 16
        str     r1, [r0]
        ldr     r0, =RESETS
1:      ldr     r2, [r0, #8]            @ RESET_DONE
        bics    r2, r1, r2
        bne     1b
        ldr     r0, =0xd0000000         @ SIO: amplifiers are off before the pad leaves isolation
        ldr     r1, =1 << PIN_ENABLE
        str     r1, [r0, #0x20]
        str     r1, [r0, #0x38]
        ldr     r0, =BUSCTRL
        movs    r1, #BUS_PRIORITIES     @ both cores before the DMA
        str     r1, [r0]
2:      ldr     r1, [r0, #4]            @ BUS_PRIORITY_ACK
        cmp     r1, #0
        beq     2b
        bl      start_machines
        bl      start_pins
        bl      start_converters
        bl      start_dma
        .if     SOUND * I2S
        bl      start_sound
        .endif
        bl      start_slices
        bl      wake
        pop     {r4-r7, pc}

@ Machine 0 of PIO0 makes the frames, one for each column follows them. Machines go before pins are theirs, so the select is high by then.
start_machines:
        push    {r4-r7, lr}
        ldr     r0, =PIO0
        bl      load_programs
        ldr     r0, =PIO2
        bl      load_programs
        ldr     r0, =PIO0 + 0xc8
        ldr     r1, =4 << 12
        str     r1, [r0, #4]            @ EXECCTRL: wraps at the end
        movs    r1, #0
        str     r1, [r0, #8]            @ SHIFTCTRL: to the left, nothing by itself
        ldr     r1, =2 << 29 | 1 << 26 | 1 << 20 | PIN_CLOCK << 10 | PIN_COMMAND << 5 | PIN_COMMAND
        str     r1, [r0, #0x14]         @ PINCTRL
        ldr     r2, =0xf081             @ set pindirs, 1  side 2
        str     r2, [r0, #0x10]
        nop
        ldr     r2, =2 << 29 | 2 << 26 | 1 << 20 | PIN_CLOCK << 10 | PIN_CLOCK << 5 | PIN_COMMAND
        str     r2, [r0, #0x14]
        ldr     r2, =0xf083             @ set pindirs, 3  side 2
        str     r2, [r0, #0x10]
        nop
        ldr     r3, =machines
        ldr     r4, =machines_end
1:      ldmia   r3!, {r0, r1, r2}
        adds    r3, #ROW - 12
        ldr     r7, =12 << 12 | 5 << 7
        str     r7, [r0, #4]
        movs    r7, #0
        str     r7, [r0, #8]
        str     r2, [r0, #0x14]
        ldr     r7, =IDLE
        str     r7, [r1]                @ TXF
        ldr     r7, =0xe081             @ set pindirs, 1
        str     r7, [r0, #0x10]
        nop
        ldr     r7, =0x80a0             @ pull block
        str     r7, [r0, #0x10]
        nop
        ldr     r7, =0xa027             @ mov x, osr
        str     r7, [r0, #0x10]
        nop
        movs    r7, #5                  @ jmp 5
        str     r7, [r0, #0x10]
        cmp     r3, r4
        bne     1b
        ldr     r0, =PIO0
        movs    r1, #MACHINES0
        str     r1, [r0]                @ CTRL
        ldr     r0, =PIO2
        movs    r1, #MACHINES2
        str     r1, [r0]
        pop     {r4-r7, pc}

load_programs:                          @ R0: a block
        ldr     r1, =programs_of_machines
        adds    r0, #0x48               @ INSTR_MEM0
        movs    r3, #13
1:      ldrh    r2, [r1]
        str     r2, [r0]
        adds    r1, #2
        adds    r0, #4
        subs    r3, #1
        bne     1b
        bx      lr

@ Frames by hand, with more than 2 us between them; then what the machines have received is thrown away.
start_converters:
        push    {r4-r7, lr}
        ldr     r3, =frames
        ldr     r4, =frames_end
1:      ldmia   r3!, {r5, r6}
        ldr     r0, =machines
        ldr     r1, =machines_end
2:      ldr     r2, [r0, #4]
        str     r6, [r2]                @ TXF
        adds    r0, #ROW
        cmp     r0, r1
        bne     2b
        ldr     r0, =PIO0
        str     r5, [r0, #0x10]         @ TXF0
        movs    r0, #200                @ three cycles a round, and more from flash
3:      subs    r0, #1
        bne     3b
        cmp     r3, r4
        bne     1b
        ldr     r0, =machines
        ldr     r1, =machines_end
4:      ldr     r2, [r0, #4]
        movs    r3, #4
5:      ldr     r4, [r2, #0x10]         @ RXF
        subs    r3, #1
        bne     5b
        adds    r0, #ROW
        cmp     r0, r1
        bne     4b
        pop     {r4-r7, pc}

@ Channel 0: a command at each wrap of the slice that paces frames, for ever. Of column C, channel 1 + 2 C: a word from the queue into the
@ ring, for ever; channel 2 + 2 C: eight words to the queue, when a tick begins. None asks for an interrupt.
start_dma:
        push    {r4-r7, lr}
        ldr     r7, =columns
        ldr     r4, =samples
        str     r4, [r7, #B_AT]
        ldr     r0, =DMA + 0x40
        ldr     r3, =machines
        ldr     r12, =machines + ROW * COLUMNS_USED
1:      adds    r3, #4
        ldmia   r3!, {r1, r2, r4-r7}    @ TXF, -, CTRL of both channels, ring, words
        str     r6, [r0, #4]            @ WRITE_ADDR
        str     r7, [r0, #0x40]         @ READ_ADDR
        str     r1, [r0, #0x44]
        movs    r2, #8
        str     r2, [r0, #0x48]         @ TRANS_COUNT
        str     r5, [r0, #0x50]         @ CTRL, without a start
        adds    r1, #0x10               @ RXF
        str     r1, [r0]
        ldr     r2, =0xf0000001
        str     r2, [r0, #8]
        str     r4, [r0, #0xc]          @ CTRL_TRIG
        adds    r0, #0x80
        cmp     r3, r12
        bne     1b
        ldr     r0, =DMA
        ldr     r1, =commands
        str     r1, [r0]
        ldr     r1, =PIO0 + 0x10
        str     r1, [r0, #4]
        str     r2, [r0, #8]
        ldr     r1, =1 << 23 | (32 + PACE_SLICE) << 17 | 5 << 8 | 1 << 4 | 2 << 2 | 1
        str     r1, [r0, #0xc]          @ words, the read address goes round
        pop     {r4-r7, pc}

@ All slices begin in one cycle: where the frame of the eighth wrap of one is over, the other wraps, and that of core 1.
start_slices:
        ldr     r0, =PWM + 20 * PACE_SLICE
        movs    r1, #16
        str     r1, [r0, #4]            @ DIV
        movs    r2, #0
        str     r2, [r0, #8]            @ CTR
        ldr     r2, =FRAME_CYCLES - 1
        str     r2, [r0, #0x10]         @ TOP
        ldr     r0, =PWM + 20 * TICK_SLICE
        str     r1, [r0, #4]
        ldr     r2, =PERIOD - LAST_FRAME
        str     r2, [r0, #8]
        ldr     r3, =PERIOD - 1
        str     r3, [r0, #0x10]
        .if     CORES > 1
        ldr     r0, =PWM + 20 * TICK_SLICE1
        str     r1, [r0, #4]
        str     r2, [r0, #8]
        str     r3, [r0, #0x10]
        .endif
        ldr     r0, =PWM
        ldr     r1, =1 << TICK_SLICE
        str     r1, [r0, #0xf8]         @ IRQ0_INTE
        ldr     r1, =1 << TICK_SLICE | 1 << PACE_SLICE | (CORES - 1) << TICK_SLICE1
        str     r1, [r0, #0xf0]         @ EN
        bx      lr

@ Words must come in eights for a while, and no force goes out; then the amplifiers get their current. Where something is wrong they do
@ not, and no tick gives it to them.
wake:   push    {r4-r7, lr}
        ldr     r0, =LOOK
        bl      look
        ldr     r0, =core0
        ldr     r0, [r0, #C_FAULTS]
        cbnz    r0, 1f
        ldr     r0, =0xd0000000
        ldr     r1, =1 << PIN_ENABLE
        str     r1, [r0, #0x18]         @ GPIO_OUT_SET
        ldr     r0, =SETTLE
        bl      look
1:      pop     {r4-r7, pc}

@ Passes R0 ticks, one after the other, which the watchdog sees.
look:   push    {r4, lr}
        push    {r0}
1:      bl      board_end
        ldr     r1, =PWM
2:      ldr     r0, [r1, #0xf4]         @ INTR
        lsls    r0, r0, #31 - TICK_SLICE
        bpl     2b
        movs    r0, #10                 @ as long as an exception's entry, and more
3:      subs    r0, #1
        bne     3b
        bl      board_begin
        ldr     r0, =board_feed         @ in RAM
        blx     r0
        ldr     r0, [sp]
        subs    r0, #1
        str     r0, [sp]
        bne     1b
        pop     {r0}
        pop     {r4, pc}

@ This core takes the interrupt of a tick from now on. Called once by each core, by core 1 first: its interrupts come when core 0 takes
@ its own, so that both begin with one tick, which the one before has prepared. Ticks send at their beginning, so the first one is on time.
        .global board_listen
        .type   board_listen, %function
board_listen:
        ldr     r1, =0xe000e100
        .if     CORES > 1
        ldr     r0, =0xd0000000
        ldr     r0, [r0]                @ SIO: number of this core
        cmp     r0, #0
        beq     1f
        mov     r0, #1 << INTERRUPT1
        str     r0, [r1]                @ NVIC_ISER
        bx      lr
1:      push    {r4-r7, lr}
        movs    r0, #1
        bl      look
        bl      board_end
        pop     {r4-r7, lr}
        ldr     r1, =0xe000e100
        .endif
        ldr     r2, =PWM
        mov     r3, #1 << TICK_SLICE | (CORES - 1) << TICK_SLICE1
        mov     r0, #1 << CONVERTER_IRQ
        str     r3, [r2, #0xf4]         @ INTR
        str     r0, [r1, #0x180]        @ NVIC_ICPR
        str     r0, [r1]
        .if     CORES > 1
        mov     r3, #1 << TICK_SLICE1
        str     r3, [r2, #0x104]        @ IRQ1_INTE
        .endif
        bx      lr
        .ltorg

@ Outputs go to their safe state, at once and for good: the amplifiers are off; then no force in all words that are sent, and they are
@ sent. Called after a fault.
        .section .text.firmware.board, "ax"
        .global board_off
        .type   board_off, %function
board_off:
        ldr     r0, =0xd0000000
        ldr     r1, =1 << PIN_ENABLE
        str     r1, [r0, #0x20]         @ SIO: GPIO_OUT_CLR
        ldr     r0, =codes
        ldr     r1, =codes + 64 * COLUMNS0
        ldr     r2, =FREE
1:      str     r2, [r0]
        adds    r0, #4
        cmp     r0, r1
        bne     1b
        .if     CORES > 1
        ldr     r0, =codes1
        ldr     r1, =codes1 + 64 * (COLUMNS_USED - COLUMNS0)
2:      str     r2, [r0]
        adds    r0, #4
        cmp     r0, r1
        bne     2b
        .endif
        ldr     r0, =DMA + 0x450
        ldr     r1, =SENDERS
        str     r1, [r0]                @ MULTI_CHAN_TRIGGER
        bx      lr
