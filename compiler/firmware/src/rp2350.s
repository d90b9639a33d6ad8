@ The board: RP2350 at 150 MHz with the converter of the emulator; rp2.s and the texts of the converter have the rest. To run on a
@ board of your own, write these functions anew (docs/firmware.md): each may use R0 to R3 and R12.
        .syntax unified
        .thumb

        .section .text.start, "ax"

@ 12 MHz crystal, PLL at 1500 MHz / 5 / 2 = 150 MHz; clk_peri; microseconds for the watchdog (datasheet 8.1 to 8.6).
        .global board_clocks
        .type   board_clocks, %function
board_clocks:
        ldr     r0, =0x40048000         @ XOSC: 1 to 15 MHz, delay, enable
        movw    r1, #0xaa0
        str     r1, [r0]
        movs    r1, #47
        str     r1, [r0, #0xc]
        ldr     r1, =0xfabaa0
        str     r1, [r0]
1:      ldr     r1, [r0, #4]
        lsls    r1, r1, #1              @ STABLE
        bcc     1b
        ldr     r0, =0x40010000         @ CLOCKS
        ldr     r2, =0x40013000         @ and the copy that clears bits
        movs    r1, #1
        str     r1, [r2, #0x3c]         @ clk_sys from clk_ref: steppings A3 and A4 come up on the auxiliary source
2:      ldr     r1, [r0, #0x44]         @ SELECTED
        cmp     r1, #1 << 0
        bne     2b
        ldr     r1, =1 << 16            @ neither divided: their ROM leaves clk_ref at a fifth
        str     r1, [r0, #0x34]
        str     r1, [r0, #0x40]
        movs    r1, #2
        str     r1, [r0, #0x30]         @ clk_ref from the crystal
3:      ldr     r1, [r0, #0x38]
        cmp     r1, #1 << 2
        bne     3b
        ldr     r0, =RESETS + 0x3000    @ clear: PLL_SYS, IO_BANK0, PADS_BANK0
        ldr     r1, =1 << 14 | 1 << 6 | 1 << 9
        str     r1, [r0]
        ldr     r0, =RESETS
4:      ldr     r2, [r0, #8]            @ RESET_DONE
        bics    r2, r1, r2
        bne     4b
        ldr     r0, =0x40050000         @ PLL_SYS
        movs    r1, #1
        str     r1, [r0]                @ reference / 1
        movs    r1, #125
        str     r1, [r0, #8]            @ * 125
        movs    r1, #0xc
        str     r1, [r0, #4]            @ power to PLL and VCO, not to the dividers
5:      ldr     r1, [r0]
        cmp     r1, #0                  @ LOCK
        bge     5b
        ldr     r1, =5 << 16 | 2 << 12
        str     r1, [r0, #0xc]
        movs    r1, #4
        str     r1, [r0, #4]
        ldr     r0, =0x40010000
        movs    r1, #0
        str     r1, [r0, #0x3c]         @ clk_sys: auxiliary, which nobody listens to, is PLL_SYS
        movs    r1, #1
        str     r1, [r0, #0x3c]         @ and is taken
6:      ldr     r1, [r0, #0x44]
        cmp     r1, #1 << 1
        bne     6b
        movw    r1, #1 << 11
        str     r1, [r0, #0x48]         @ clk_peri from clk_sys
        ldr     r0, =0x40108000         @ TICKS: the watchdog's, 12 cycles of clk_ref
        movs    r1, #12
        str     r1, [r0, #0x34]
        movs    r1, #1
        str     r1, [r0, #0x30]
        bx      lr
