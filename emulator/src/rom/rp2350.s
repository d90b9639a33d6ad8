@ What stands for the boot ROM of RP2350 in the emulator: the wait of core 1 for its start over the FIFO (datasheet 5.3),
@ and the look-up of ROM functions (5.4.1) with the few that need no flash chip. Written for this project.
@ arm-none-eabi-as -mcpu=cortex-m33 -I . rp2350.s -o rp2350.o; arm-none-eabi-ld -Ttext=0 rp2350.o -o rp2350.elf; arm-none-eabi-objcopy -O binary rp2350.elf rp2350.bin
        .syntax unified
        .thumb
        .equ    AIRCR, 0xe000ed0c

        .word   0x20082000              @ vector table: a stack, then core 1's wait for everything
        .word   core1 + 1
        .word   core1 + 1
        .word   core1 + 1
        .ascii  "Mu"                    @ 0x10: the magic number, then the version
        .byte   2, 2
        .hword  0                       @ 0x14: no data table
        .hword  lookup + 1              @ 0x16
        .word   0                       @ 0x18

        .include "core1.s"

@ lookup(r0: two letters, r1: which kind): the function, or 0.
        .balign 4
lookup: uxth    r0, r0
        lsls    r1, #29                 @ kind 4: a function of Arm, secure
        bpl     8f
        adr     r1, table
6:      ldrh    r2, [r1]
        cbz     r2, 8f
        cmp     r2, r0
        beq     7f
        adds    r1, #4
        b       6b
7:      ldrh    r0, [r1, #2]
        bx      lr
8:      movs    r0, #0
        bx      lr

        .balign 4
table:  .ascii  "FC"                    @ flash_flush_cache
        .hword  done + 1
        .ascii  "IF"                    @ connect_internal_flash
        .hword  done + 1
        .ascii  "EX"                    @ flash_exit_xip
        .hword  done + 1
        .ascii  "CX"                    @ flash_enter_cmd_xip
        .hword  done + 1
        .ascii  "SR"                    @ bootrom_state_reset
        .hword  done + 1
        .ascii  "RB"                    @ reboot
        .hword  reboot + 1
        .word   0

done:   movs    r0, #0
        bx      lr

        .balign 4
reboot: ldr     r0, =AIRCR
        ldr     r1, =0x05fa0004         @ SYSRESETREQ
        str     r1, [r0]
9:      b       9b
        .balign 4
        .ltorg
