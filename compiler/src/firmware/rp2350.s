@ The board: RP2350 at 150 MHz with the converter of the emulator. To run on a board of your own, write these functions anew
@ (docs/firmware.md): each may use R0 to R3 and R12, and those that a tick calls count in its cycles.
        .syntax unified
        .thumb
        .equ    UART, 0x40070000
        .equ    WATCHDOG, 0x400d8000

        .section .text.firmware.board, "ax"

@ The watchdog gets its time anew.
        .global board_feed
        .type   board_feed, %function
board_feed:
        ldr     r1, =WATCHDOG
        movw    r0, #WATCHDOG_US
        str     r0, [r1, #4]            @ LOAD
        bx      lr

@ R0: not 0 where the serial port takes a byte. Core 1 asks, so this lies with its code.
        .section .text.core1.firmware.board, "ax"
        .global board_serial_ready
        .type   board_serial_ready, %function
board_serial_ready:
        ldr     r1, =UART
        ldr     r0, [r1, #0x18]         @ UARTFR
        mvns    r0, r0
        and     r0, r0, #0x20           @ TXFF
        bx      lr

@ Sends the byte in R0.
        .global board_serial_send
        .type   board_serial_send, %function
board_serial_send:
        ldr     r1, =UART
        str     r0, [r1]                @ UARTDR
        bx      lr

@ Once, at the start.
        .section .text.start, "ax"

@ This core takes the converter's interrupt from now on. Called once by each core.
        .global board_listen
        .type   board_listen, %function
board_listen:
        ldr     r1, =0xe000e100 + 4 * (CONVERTER_IRQ / 32)
        mov     r0, #1 << (CONVERTER_IRQ % 32)
        str     r0, [r1]                @ NVIC_ISER
        ldr     r1, =0xd0000000
        ldr     r0, [r1]                @ SIO: number of this core
        mov     r1, #1 << 8
        lsls    r1, r0
        ldr     r0, =CONVERTER + 0x2000
        str     r1, [r0]                @ CTRL, set: this core serves
        bx      lr

@ 12 MHz crystal, PLL at 1500 MHz / 5 / 2 = 150 MHz; clk_peri; microseconds for the watchdog (datasheet 8.1 to 8.6).
        .global board_clocks
        .type   board_clocks, %function
board_clocks:
        ldr     r0, =0x40048000         @ XOSC: 1 to 15 MHz, delay, enable
        movw    r1, #0xaa0
        str     r1, [r0]
        movs    r1, #47
        str     r1, [r0, #0xc]
        ldr     r1, =0xfab000
        str     r1, [r0]
1:      ldr     r1, [r0, #4]
        lsls    r1, r1, #1              @ STABLE
        bcc     1b
        ldr     r0, =0x40010000         @ clk_ref from the crystal
        movs    r1, #2
        str     r1, [r0, #0x30]
2:      ldr     r1, [r0, #0x38]
        cmp     r1, #1 << 2
        bne     2b
        ldr     r0, =0x40023000         @ RESETS, clear: PLL_SYS, UART0, IO_BANK0, PADS_BANK0
        ldr     r1, =1 << 14 | 1 << 26 | 1 << 6 | 1 << 9
        str     r1, [r0]
        ldr     r0, =0x40020000
3:      ldr     r2, [r0, #8]            @ RESET_DONE
        bics    r2, r1, r2
        bne     3b
        ldr     r0, =0x40050000         @ PLL_SYS
        movs    r1, #1
        str     r1, [r0]                @ reference / 1
        movs    r1, #125
        str     r1, [r0, #8]            @ * 125
        movs    r1, #0xc
        str     r1, [r0, #4]            @ power to PLL and VCO, not to the dividers
4:      ldr     r1, [r0]
        cmp     r1, #0                  @ LOCK
        bge     4b
        ldr     r1, =5 << 16 | 2 << 12
        str     r1, [r0, #0xc]
        movs    r1, #4
        str     r1, [r0, #4]
        ldr     r0, =0x40010000
        movs    r1, #0
        str     r1, [r0, #0x3c]         @ clk_sys: auxiliary is PLL_SYS
        movs    r1, #1
        str     r1, [r0, #0x3c]         @ and is taken
5:      ldr     r1, [r0, #0x44]
        cmp     r1, #2
        bne     5b
        movw    r1, #1 << 11
        str     r1, [r0, #0x48]         @ clk_peri from clk_sys
        ldr     r0, =0x40108000         @ TICKS: the watchdog's, 12 cycles of clk_ref
        movs    r1, #12
        str     r1, [r0, #0x28]
        movs    r1, #1
        str     r1, [r0, #0x24]
        bx      lr

@ UART0 on GPIO 0 at 31250 baud: 150 MHz / 16 / 300.
        .global board_serial
        .type   board_serial, %function
board_serial:
        ldr     r0, =UART
        mov     r1, #300
        str     r1, [r0, #0x24]         @ UARTIBRD
        movs    r1, #0
        str     r1, [r0, #0x28]         @ UARTFBRD
        movs    r1, #0x70
        str     r1, [r0, #0x2c]         @ UARTLCR_H: 8 bits, FIFO
        movw    r1, #0x101
        str     r1, [r0, #0x30]         @ UARTCR: enabled, transmits
        ldr     r0, =0x40028000         @ IO_BANK0: GPIO 0 is UART0 TX
        movs    r1, #2
        str     r1, [r0, #4]
        ldr     r0, =0x40038000         @ PADS_BANK0: GPIO 0 leaves isolation
        movs    r1, #0x56
        str     r1, [r0, #4]
        bx      lr

@ The watchdog bites after WATCHDOG_US without food.
        .global board_watchdog
        .type   board_watchdog, %function
board_watchdog:
        ldr     r0, =WATCHDOG
        movw    r1, #WATCHDOG_US
        str     r1, [r0, #4]
        mov     r1, #1 << 30
        str     r1, [r0]                @ CTRL: enabled
        bx      lr

@ The converter: double buffers of both cores' keys, no core served yet, and go.
        .global board_converter
        .type   board_converter, %function
board_converter:
        ldr     r0, =CONVERTER
        movw    r1, #KEYS0 + KEYS1
        str     r1, [r0, #0x08]
        ldr     r1, =words0
        str     r1, [r0, #0x0c]
        ldr     r1, =words0 + DISTANCE0
        str     r1, [r0, #0x10]
        movw    r1, #2 * DISTANCE0
        str     r1, [r0, #0x14]
        movw    r1, #KEYS0              @ from this key on
        str     r1, [r0, #0x24]
        ldr     r1, =words1
        str     r1, [r0, #0x28]
        ldr     r1, =words1 + DISTANCE1
        str     r1, [r0, #0x2c]
        movw    r1, #2 * DISTANCE1
        str     r1, [r0, #0x30]
        ldr     r1, =RATE
        str     r1, [r0, #0x18]
        movs    r1, #3
        str     r1, [r0]
        bx      lr
