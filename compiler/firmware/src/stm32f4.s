@ The board: an STM32F407 with a crystal of 8 MHz at 168 MHz, and the converter of the emulator. To run on a board of your own, write
@ these functions anew (docs/firmware.md): each may use R0 to R3 and R12, and those that a tick calls count in its cycles.
@ Numbers in parentheses are sections of the manual RM0090.
        .syntax unified
        .thumb
        .equ    USART1, 0x40011000
        .equ    IWDG, 0x40003000
        .equ    RCC, 0x40023800

        .section .text.firmware.board, "ax"

@ The watchdog gets its time anew.
        .global board_feed
        .type   board_feed, %function
board_feed:
        ldr     r1, =IWDG
        movw    r0, #0xaaaa
        str     r0, [r1]                @ KR
        bx      lr

@ R0: the byte that arrived, with 0x800 where those before it were lost, or other bits where it is of no use; -1 where there is none.
        .global board_serial_take
        .type   board_serial_take, %function
board_serial_take:
        ldr     r1, =USART1
        ldr     r0, [r1]                @ SR: RXNE
        lsls    r2, r0, #26
        bpl     1f
        ldr     r1, [r1, #4]            @ DR
        lsls    r0, r0, #28             @ PE, FE, NF; ORE: the next one was lost
        lsrs    r0, r0, #16
        orrs    r0, r1
        bx      lr
1:      mov     r0, #-1
        bx      lr

@ R0: not 0 where the serial port takes a byte.
        .global board_serial_ready
        .type   board_serial_ready, %function
board_serial_ready:
        ldr     r1, =USART1
        ldr     r0, [r1]                @ SR
        and     r0, r0, #0x80           @ TXE
        bx      lr

@ Sends the byte in R0.
        .global board_serial_send
        .type   board_serial_send, %function
board_serial_send:
        ldr     r1, =USART1
        str     r0, [r1, #4]            @ DR
        bx      lr

@ Once, at the start.
        .section .text.start, "ax"

@ This core takes the converter's interrupt from now on.
        .global board_listen
        .type   board_listen, %function
board_listen:
        ldr     r1, =0xe000e100 + 4 * (CONVERTER_IRQ / 32)
        mov     r0, #1 << (CONVERTER_IRQ % 32)
        str     r0, [r1]                @ NVIC_ISER
        ldr     r0, =CONVERTER
        movw    r1, #0x103
        str     r1, [r0]                @ CTRL: as it is, and this core serves
        bx      lr

@ SRAM1 at address 0, from where it is fetched without the system bus (2.4); 8 MHz / 8 * 336 / 2 = 168 MHz (7.3).
        .global board_clocks
        .type   board_clocks, %function
board_clocks:
        ldr     r0, =RCC
        ldr     r1, =1 << 14 | 1 << 4   @ APB2ENR: SYSCFG, USART1
        str     r1, [r0, #0x44]
        movs    r1, #1                  @ AHB1ENR: GPIOA; CCM stays on
        orr     r1, r1, #1 << 20
        str     r1, [r0, #0x30]
        ldr     r1, [r0, #0x44]         @ a cycle or two until they are there
        ldr     r2, =0x40013800
        movs    r1, #3
        str     r1, [r2]                @ SYSCFG_MEMRMP: SRAM1
        dsb     sy
        isb     sy
        ldr     r1, [r0]                @ CR: the crystal
        orr     r1, r1, #1 << 16
        str     r1, [r0]
1:      ldr     r1, [r0]
        lsls    r1, r1, #14             @ HSERDY
        bpl     1b
        ldr     r2, =0x40023c00
        movw    r1, #0x705              @ FLASH_ACR: 5 wait states, caches, prefetch (3.5.1)
        str     r1, [r2]
        ldr     r1, =7 << 24 | 1 << 22 | 336 << 6 | 8
        str     r1, [r0, #4]            @ PLLCFGR
        movw    r1, #4 << 13 | 5 << 10  @ CFGR: APB2 at half, APB1 at a quarter
        str     r1, [r0, #8]
        ldr     r1, [r0]
        orr     r1, r1, #1 << 24
        str     r1, [r0]
2:      ldr     r1, [r0]
        lsls    r1, r1, #6              @ PLLRDY
        bpl     2b
        ldr     r1, [r0, #8]
        orr     r1, r1, #2
        str     r1, [r0, #8]            @ from the PLL
3:      ldr     r1, [r0, #8]
        and     r1, r1, #0xc
        cmp     r1, #8                  @ SWS
        bne     3b
        bx      lr

@ USART1 on PA9 and PA10 at 31250 baud, or what UART_DIVISOR and UART_FRACTION (64ths) say: half of the clock by eight times that, 84 MHz
@ / 2688.
        .global board_serial
        .type   board_serial, %function
board_serial:
        ldr     r0, =USART1
        movw    r1, #8 * UART_DIVISOR + UART_FRACTION / 8
        str     r1, [r0, #8]            @ BRR
        movw    r1, #1 << 13 | 1 << 3 | 1 << 2
        str     r1, [r0, #0xc]          @ CR1: enabled, transmits, receives
        ldr     r0, =0x40020000         @ GPIOA: 9 is USART1_TX, 10 is USART1_RX
        ldr     r1, [r0]
        bic     r1, r1, #15 << 18
        orr     r1, r1, #10 << 18
        str     r1, [r0]                @ MODER
        ldr     r1, [r0, #0x24]
        bic     r1, r1, #255 << 4
        orr     r1, r1, #0x77 << 4
        str     r1, [r0, #0x24]         @ AFRH
        ldr     r1, [r0, #0xc]
        bic     r1, r1, #3 << 20
        orr     r1, r1, #1 << 20
        str     r1, [r0, #0xc]          @ PUPDR: high where nobody drives it
        bx      lr

@ The watchdog bites after WATCHDOG_US without food: 32 kHz / 4. Its oscillator is between 17 and 47 kHz (21.3).
        .global board_watchdog
        .type   board_watchdog, %function
board_watchdog:
        ldr     r0, =IWDG
        movw    r1, #0xcccc
        str     r1, [r0]                @ KR: go, from 0xfff; now its oscillator runs
        movw    r1, #0x5555
        str     r1, [r0]                @ KR: unlocked
        movs    r1, #0
        str     r1, [r0, #4]            @ PR: / 4
        movs    r1, #WATCHDOG_US * 8 / 1000
        str     r1, [r0, #8]            @ RLR
1:      ldr     r1, [r0, #0xc]          @ SR: neither is still on its way
        cmp     r1, #0
        bne     1b
        movw    r1, #0xaaaa
        str     r1, [r0]                @ KR: from RLR
        bx      lr
