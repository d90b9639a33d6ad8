@ The start of a bench of keys: the ADC and its clock, the DMA, pins, carriers. Called once, without interrupts.
@
@   enable low -> clocks -> cores before the DMA at memory -> ADC, DMA -> PWM -> pins -> words for 100 ms -> bridges awake
        .syntax unified
        .thumb

@ What is kept of the bench (offsets.rs).
        .section .bss.near.core0.bench, "aw", %nobits
        .balign 4
        .global bench
bench:  .space  16 + 16

@ Words of the ADC, by the DMA alone.
        .section .bss.ring, "aw", %nobits
        .balign 1 << RING_BITS
        .global samples
samples: .space 1 << RING_BITS

        .section .data.ring, "aw"
        .balign 32
commands:                               @ EN, START_ONCE, AINSEL: the DMA reads them round and round
        .word   5 | INPUT_0 << 12, 5 | INPUT_1 << 12, 5 | INPUT_2 << 12, 5 | INPUT_3 << 12
        .word   5 | INPUT_4 << 12, 5 | INPUT_5 << 12, 5 | INPUT_6 << 12, 5 | INPUT_7 << 12

        .section .text.start, "ax"
        .global board_converter
        .type   board_converter, %function
board_converter:
        push    {r4-r7, lr}
        bl      board_watchdog
        ldr     r0, =RESETS + 0x3000    @ clear: ADC, BUSCTRL, DMA, PLL_USB, PWM
        ldr     r1, =1 << 0 | 1 << 1 | 1 << 2 | 1 << 15 | 1 << 16
        str     r1, [r0]
        ldr     r0, =RESETS
1:      ldr     r2, [r0, #8]            @ RESET_DONE
        bics    r2, r1, r2
        bne     1b
        ldr     r0, =0xd0000000         @ SIO: bridges sleep before the pad leaves isolation
        ldr     r1, =1 << PIN_SLEEP
        str     r1, [r0, #0x20]
        str     r1, [r0, #0x38]
        bl      start_adc_clock
        ldr     r0, =BUSCTRL
        movs    r1, #BUS_PRIORITIES     @ both cores before the DMA
        str     r1, [r0]
2:      ldr     r1, [r0, #4]            @ BUS_PRIORITY_ACK
        cmp     r1, #0
        beq     2b
        bl      start_adc
        bl      start_dma
        .if     SOUND * I2S
        bl      start_sound
        .endif
        bl      start_slices
        bl      start_pins
        ldr     r0, =PWM + 0xf0         @ EN: all in one cycle
        ldr     r1, =SLICES_MASK
        str     r1, [r0]
        bl      wake
        pop     {r4-r7, pc}

@ 48 MHz from the other PLL: 12 MHz * 100 / 5 / 5.
start_adc_clock:
        ldr     r0, =0x40058000         @ PLL_USB
        movs    r1, #1
        str     r1, [r0]
        movs    r1, #100
        str     r1, [r0, #8]
        movs    r1, #0xc
        str     r1, [r0, #4]            @ power to PLL and VCO, not to the dividers
1:      ldr     r1, [r0]
        cmp     r1, #0                  @ LOCK
        bge     1b
        ldr     r1, =5 << 16 | 5 << 12
        str     r1, [r0, #0xc]
        movs    r1, #4
        str     r1, [r0, #4]
        ldr     r0, =0x40010000         @ CLOCKS
        ldr     r1, =1 << 16
        str     r1, [r0, #0x70]         @ CLK_ADC_DIV
        ldr     r1, =1 << 11
        str     r1, [r0, #0x6c]         @ CLK_ADC_CTRL: from PLL_USB, enabled
        bx      lr

@ Words go into its queue, and each asks for the DMA.
start_adc:
        ldr     r0, =ADC
        movs    r1, #1
        str     r1, [r0]                @ CS: EN
1:      ldr     r1, [r0]
        lsls    r1, r1, #23             @ READY
        bpl     1b
        ldr     r1, =1 << 24 | 8 | 1
        str     r1, [r0, #8]            @ FCS
        bx      lr

@ Channel 0: a command at each wrap of the slice that paces conversions. Channel 1: a word from the queue into the ring. Both are
@ endless, and ask for no interrupt.
start_dma:
        ldr     r0, =DMA
        ldr     r1, =commands + 4 * CONVERSION_AT_START
        ldr     r2, =ADC
        ldr     r3, =0xf0000001
        str     r1, [r0]                @ READ_ADDR
        str     r2, [r0, #4]            @ WRITE_ADDR
        str     r3, [r0, #8]            @ TRANS_COUNT
        ldr     r4, =samples + 2 * CONVERSION_AT_START
        adds    r2, #0xc                @ the queue
        str     r2, [r0, #0x40]
        str     r4, [r0, #0x44]
        str     r3, [r0, #0x48]
        ldr     r5, =bench
        ldr     r4, =samples
        str     r4, [r5, #B_AT]
        ldr     r1, =1 << 23 | 48 << 17 | 1 << 13 | 1 << 12 | RING_BITS << 8 | 1 << 6 | 1 << 2 | 1
        str     r1, [r0, #0x4c]         @ CTRL_TRIG: halfwords, the written address goes round
        ldr     r1, =1 << 23 | (32 + PACE_SLICE) << 17 | 5 << 8 | 1 << 4 | 2 << 2 | 1
        str     r1, [r0, #0xc]          @ words, the read address goes round
        bx      lr

@ (slice, where its counter begins, TOP, compare values), of the two that count time and of each key's.
start_slices:
        ldr     r3, =slices
        ldr     r4, =slices_end
        movs    r6, #16
1:      ldmia   r3!, {r0, r1, r2, r5}
        str     r6, [r0, #4]            @ DIV
        str     r1, [r0, #8]            @ CTR
        str     r5, [r0, #0xc]          @ CC
        str     r2, [r0, #0x10]         @ TOP
        cmp     r3, r4
        bne     1b
        ldr     r0, =PWM
        movw    r1, #1 << TICK_SLICE
        str     r1, [r0, #0xf8]         @ IRQ0_INTE
        bx      lr

@ Words must come in eights for a while; then the bridges wake, with no force, and none may tell of a fault then. Where something is
@ wrong they sleep, and no tick wakes them.
wake:   push    {lr}
        ldr     r5, =LOOK
        bl      look
        ldr     r0, =core0
        ldr     r0, [r0, #C_FAULTS]
        cbnz    r0, 1f
        ldr     r0, =0xd0000000
        ldr     r1, =1 << PIN_SLEEP
        str     r1, [r0, #0x18]         @ GPIO_OUT_SET
        ldr     r5, =SETTLE
        bl      look
        bl      board_end
1:      pop     {pc}

@ Passes R5 ticks, one after the other, which the watchdog sees.
look:   push    {lr}
        ldr     r4, =bench
        ldr     r6, =DMA + 0x40
1:      ldr     r1, [r4, #B_AT]
2:      ldr     r0, [r6, #4]            @ WRITE_ADDR
        eors    r0, r1
        lsrs    r0, r0, #4
        beq     2b
        bl      board_begin
        ldr     r0, =board_feed         @ in RAM
        blx     r0
        subs    r5, #1
        bne     1b
        pop     {pc}
        .ltorg

@ Outputs go to their safe state, at once and for good: the bridges sleep, then their inputs are low. Called after a fault.
        .section .text.firmware.board, "ax"
        .global board_off
        .type   board_off, %function
board_off:
        ldr     r0, =0xd0000000
        ldr     r1, =1 << PIN_SLEEP
        str     r1, [r0, #0x20]         @ SIO: GPIO_OUT_CLR
        movs    r1, #0
        ldr     r0, =PWM + 0xc
        movs    r2, #12
1:      str     r1, [r0]                @ CC of each slice
        adds    r0, #20
        subs    r2, #1
        bne     1b
        bx      lr
