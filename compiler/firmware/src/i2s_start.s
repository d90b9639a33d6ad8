@ The start of a sound output: a state machine with its program, which stands until ticks are on time, and the pins
@ to the DAC. Called once, without interrupts.
        .syntax unified
        .thumb
        .if     SOUND

@ How many ticks have given no samples.
        .section .bss.near.core0.sound, "aw", %nobits
        .balign 4
        .global unsent
unsent: .space  4

        .section .text.start, "ax"
        .balign 4
@ Left and right by turns, a bit every four cycles, the highest first; side-set is the bit clock, then the side, which changes a bit
@ ahead. Y counts bits, X is 0: what is taken where there is no word.
sender: .short  0x6101                  @ 0: out pins, 1     side 0 [1]
        .short  0x0980                  @    jmp y-- 0       side 1 [1]
        .short  0x7101                  @    out pins, 1     side 2 [1]
        .short  0x9880                  @    pull noblock    side 3
        .short  0xf85e                  @    set y, 30       side 3
        .short  0x7101                  @ 5: out pins, 1     side 2 [1]
        .short  0x1985                  @    jmp y-- 5       side 3 [1]
        .short  0x6101                  @    out pins, 1     side 0 [1]
        .short  0x8880                  @    pull noblock    side 1
        .short  0xe85e                  @    set y, 30       side 1
sender_end:

        .global start_sound
        .type   start_sound, %function
start_sound:
        ldr     r0, =RESETS + 0x3000    @ clear: PIO1
        ldr     r1, =1 << 12
        str     r1, [r0]
        ldr     r0, =RESETS
1:      ldr     r2, [r0, #8]            @ RESET_DONE
        tst     r2, r1
        beq     1b
        ldr     r0, =PIO1
        ldr     r1, =sender
        ldr     r2, =sender_end
        add     r3, r0, #0x48           @ INSTR_MEM0
2:      ldrh    r12, [r1]
        str     r12, [r3]
        adds    r1, #2
        adds    r3, #4
        cmp     r1, r2
        bne     2b
        adds    r0, #0xc8               @ of machine 0
        ldr     r1, =1 << 16
        str     r1, [r0]                @ CLKDIV: 1, while it is set up
        ldr     r1, =9 << 12
        str     r1, [r0, #4]            @ EXECCTRL: wraps at the end
        movs    r1, #0
        str     r1, [r0, #8]            @ SHIFTCTRL: to the left, nothing by itself
        ldr     r1, =2 << 29 | 2 << 26 | 1 << 20 | PIN_SOUND_CLOCK << 10 | PIN_SOUND_CLOCK << 5 | PIN_SOUND_DATA
        str     r1, [r0, #0x14]         @ PINCTRL: set is both clocks, to drive them
        ldr     r1, =0xe083             @ set pindirs, 3
        str     r1, [r0, #0x10]
        nop
        ldr     r1, =2 << 29 | 1 << 26 | 1 << 20 | PIN_SOUND_CLOCK << 10 | PIN_SOUND_DATA << 5 | PIN_SOUND_DATA
        str     r1, [r0, #0x14]
        ldr     r1, =0xe081             @ set pindirs, 1
        str     r1, [r0, #0x10]
        nop
        ldr     r1, =0xe000             @ set pins, 0
        str     r1, [r0, #0x10]
        nop
        ldr     r1, =0xe020             @ set x, 0
        str     r1, [r0, #0x10]
        nop
        ldr     r1, =0xe040 | (SOUND_BITS - 2)
        str     r1, [r0, #0x10]         @ set y: so many bits of a right word come first
        nop
        movs    r1, #5                  @ jmp 5
        str     r1, [r0, #0x10]
        nop
        ldr     r1, =PERIOD << 8
        str     r1, [r0]                @ CLKDIV: 256 cycles a period, exactly
        ldr     r3, =sound_pins
        ldr     r2, =sound_pins_end
3:      ldrb    r12, [r3]
        ldr     r0, =IO_BANK0
        add     r0, r0, r12, lsl #3
        movs    r1, #7
        str     r1, [r0, #4]            @ CTRL: PIO1
        ldr     r0, =PADS_BANK0
        add     r0, r0, r12, lsl #2
        movs    r1, #0x56
        str     r1, [r0, #4]            @ an output, out of isolation
        adds    r3, #1
        cmp     r3, r2
        bne     3b
        bx      lr
        .ltorg
sound_pins:
        .byte   PIN_SOUND_CLOCK, PIN_SOUND_SIDE, PIN_SOUND_DATA
sound_pins_end:
        .balign 4
        .endif
