@ What RP2350 and RP2040 have alike: serial port, watchdog, two cores that ask SIO who they are. In instructions of both cores; each
@ function may use R0 to R3 and R12.
        .syntax unified
        .thumb

        .section .text.firmware.board, "ax"

@ The watchdog gets its time anew.
        .global board_feed
        .type   board_feed, %function
board_feed:
        ldr     r1, =WATCHDOG
        ldr     r0, =WATCHDOG_LOAD
        str     r0, [r1, #4]            @ LOAD
        bx      lr

@ R0: the byte that arrived, with 0x800 where those before it were lost, or other bits where it is of no use; -1 where there is none.
        .global board_serial_take
        .type   board_serial_take, %function
board_serial_take:
        ldr     r1, =UART
        ldr     r0, [r1, #0x18]         @ UARTFR: RXFE
        lsls    r0, r0, #27
        bmi     1f
        ldr     r0, [r1]                @ UARTDR
        bx      lr
1:      asrs    r0, r0, #31
        bx      lr

@ R0: not 0 where the serial port takes a byte. Core 1 asks, so this lies with its code; but for the monitor, which is core 0's.
        .if     MONITOR == 0
        .section .text.core1.firmware.board, "ax"
        .endif
        .global board_serial_ready
        .type   board_serial_ready, %function
board_serial_ready:
        ldr     r1, =UART
        ldr     r0, [r1, #0x18]         @ UARTFR
        mvns    r0, r0
        movs    r1, #0x20               @ TXFF
        ands    r0, r1
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

@ This core takes the interrupt of a tick from now on. Called once by each core. (Columns have one of their own.)
        .ifdef  COLUMNS_USED
        .else
        .global board_listen
        .type   board_listen, %function
board_listen:
        .ifdef  TICK_SLICE              @ the first tick shall not be late: an interrupt of before is none
        ldr     r1, =PWM + 0xf4
        ldr     r0, =1 << TICK_SLICE
        str     r0, [r1]                @ INTR
        ldr     r1, =0xe000e280 + 4 * (CONVERTER_IRQ / 32)
        ldr     r0, =1 << (CONVERTER_IRQ % 32)
        str     r0, [r1]                @ NVIC_ICPR
        .endif
        ldr     r1, =0xe000e100 + 4 * (CONVERTER_IRQ / 32)
        ldr     r0, =1 << (CONVERTER_IRQ % 32)
        str     r0, [r1]                @ NVIC_ISER
        .ifdef  CONVERTER
        ldr     r1, =0xd0000000
        ldr     r0, [r1]                @ SIO: number of this core
        adds    r0, #8
        movs    r1, #1
        lsls    r1, r0
        ldr     r0, =CONVERTER + 0x2000
        str     r1, [r0]                @ CTRL, set: this core serves
        .endif
        bx      lr
        .endif

@ UART0 on GPIO 0 and 1, its clock divided by 16 and by UART_DIVISOR and 64ths of UART_FRACTION: 31250 baud, or the monitor's. It leaves
@ its reset only where clk_peri runs.
        .global board_serial
        .type   board_serial, %function
board_serial:
        ldr     r0, =RESETS + 0x3000    @ clear
        ldr     r1, =RESET_UART
        str     r1, [r0]
        ldr     r0, =RESETS
1:      ldr     r2, [r0, #8]            @ RESET_DONE
        ands    r2, r1
        beq     1b
        ldr     r0, =UART
        ldr     r1, =UART_DIVISOR
        str     r1, [r0, #0x24]         @ UARTIBRD
        movs    r1, #UART_FRACTION
        str     r1, [r0, #0x28]         @ UARTFBRD
        movs    r1, #0x70
        str     r1, [r0, #0x2c]         @ UARTLCR_H: 8 bits, FIFO
        ldr     r1, =0x301
        str     r1, [r0, #0x30]         @ UARTCR: enabled, transmits, receives
        ldr     r0, =PADS_BANK
        movs    r1, #0x56
        str     r1, [r0, #4]            @ GPIO 0 leaves isolation, where there is any
        movs    r1, #0x5a
        str     r1, [r0, #8]            @ so does GPIO 1, which is high where nobody drives it
        ldr     r0, =IO_BANK0
        movs    r1, #2
        str     r1, [r0, #4]            @ GPIO 0 is UART0 TX
        str     r1, [r0, #12]           @ GPIO 1 is UART0 RX
        bx      lr

@ The watchdog bites after WATCHDOG_LOAD counts without food, and then resets all but the oscillators. After reset WDSEL selects
@ nothing, and a bite would do nothing. (POWMAN_WDSEL of RP2350 stays 0: its resets hold the pins where they are until the next start.)
        .global board_watchdog
        .type   board_watchdog, %function
board_watchdog:
        ldr     r0, =PSM
        ldr     r1, =PSM_STAGES
        str     r1, [r0, #8]            @ WDSEL
        ldr     r0, =WATCHDOG
        ldr     r1, =WATCHDOG_LOAD
        str     r1, [r0, #4]
        ldr     r1, =1 << 30
        str     r1, [r0]                @ CTRL: enabled
        bx      lr
