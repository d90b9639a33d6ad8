@ The board: RP2040 at 133 MHz with the converter of the emulator; rp2.s and the texts of the converter have the rest. To run on a
@ board of your own, write these functions anew (docs/firmware.md): each may use R0 to R3 and R12.
        .syntax unified
        .thumb

@ The second stage: the ROM copies these 256 bytes, the last four a checksum that the linker puts there, and enters them with the flash
@ not yet to be read as memory. Every flash chip knows the plain read, command 03h with 24 bits of address (datasheet 2.8.1.3, 4.10).
        .section .boot2, "ax"
        ldr     r0, =0x18000000         @ SSI
        movs    r1, #0
        str     r1, [r0, #0x08]         @ SSIENR: off, or it cannot be set up
        movs    r1, #4
        str     r1, [r0, #0x14]         @ BAUDR: 33 MHz at 133 MHz, which every chip stands
        ldr     r1, =31 << 16 | 3 << 8
        str     r1, [r0, #0x00]         @ CTRLR0: one line, words of 32 bits, command and address before each
        movs    r1, #0
        str     r1, [r0, #0x04]         @ CTRLR1: one word each time
        ldr     r1, =0x03 << 24 | 2 << 8 | 6 << 2
        ldr     r2, =0x180000f4
        str     r1, [r2]                @ SPI_CTRLR0: 03h, 8 bits of command, 24 of address, on one line
        movs    r1, #1
        str     r1, [r0, #0x08]
        ldr     r0, =0x10000100         @ the vector table behind this block
        ldr     r1, =0xe000ed08
        str     r0, [r1]                @ VTOR
        ldr     r1, [r0]
        ldr     r2, [r0, #4]
        msr     msp, r1
        bx      r2
        .ltorg

        .section .text.start, "ax"

@ 12 MHz crystal, PLL at 1596 MHz / 6 / 2 = 133 MHz; clk_peri; microseconds for the watchdog (datasheet 2.15 to 2.18, 4.7).
        .global board_clocks
        .type   board_clocks, %function
board_clocks:
        ldr     r0, =0x40024000         @ XOSC: 1 to 15 MHz, delay, enable
        ldr     r1, =0xaa0
        str     r1, [r0]
        movs    r1, #47
        str     r1, [r0, #0xc]
        ldr     r1, =0xfabaa0
        str     r1, [r0]
1:      ldr     r1, [r0, #4]
        cmp     r1, #0                  @ STABLE
        bge     1b
        ldr     r0, =0x40008000         @ CLOCKS
        ldr     r2, =0x4000b000         @ and the copy that clears bits
        movs    r1, #1
        str     r1, [r2, #0x3c]         @ clk_sys from clk_ref, wherever a debugger left it
2:      ldr     r1, [r0, #0x44]         @ SELECTED
        cmp     r1, #1 << 0
        bne     2b
        ldr     r1, =1 << 8             @ neither divided
        str     r1, [r0, #0x34]
        str     r1, [r0, #0x40]
        movs    r1, #2
        str     r1, [r0, #0x30]         @ clk_ref from the crystal
3:      ldr     r1, [r0, #0x38]
        cmp     r1, #1 << 2
        bne     3b
        ldr     r0, =RESETS + 0x3000    @ clear: PLL_SYS, IO_BANK0, PADS_BANK0
        ldr     r1, =1 << 12 | 1 << 5 | 1 << 8
        str     r1, [r0]
        ldr     r0, =RESETS
4:      ldr     r2, [r0, #8]            @ RESET_DONE
        ands    r2, r1
        cmp     r2, r1
        bne     4b
        ldr     r0, =0x40028000         @ PLL_SYS
        movs    r1, #1
        str     r1, [r0]                @ reference / 1
        movs    r1, #133
        str     r1, [r0, #8]            @ * 133
        movs    r1, #0xc
        str     r1, [r0, #4]            @ power to PLL and VCO, not to the dividers
5:      ldr     r1, [r0]
        cmp     r1, #0                  @ LOCK
        bge     5b
        ldr     r1, =6 << 16 | 2 << 12
        str     r1, [r0, #0xc]
        movs    r1, #4
        str     r1, [r0, #4]
        ldr     r0, =0x40008000
        movs    r1, #0
        str     r1, [r0, #0x3c]         @ clk_sys: auxiliary, which nobody listens to, is PLL_SYS
        movs    r1, #1
        str     r1, [r0, #0x3c]         @ and is taken
6:      ldr     r1, [r0, #0x44]
        cmp     r1, #1 << 1
        bne     6b
        ldr     r1, =1 << 11
        str     r1, [r0, #0x48]         @ clk_peri from clk_sys
        ldr     r0, =WATCHDOG
        ldr     r1, =1 << 9 | 12        @ TICK: every 12 cycles of clk_ref
        str     r1, [r0, #0x2c]
        bx      lr
