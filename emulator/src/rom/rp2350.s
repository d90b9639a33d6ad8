@ What stands for the boot ROM of RP2350 in the emulator: the wait of core 1 for its start over the FIFO (datasheet 5.3),
@ and the look-up of ROM functions (5.4.1) with the few that need no flash chip. Written for this project.
@ arm-none-eabi-as -mcpu=cortex-m33 rp2350.s -o rp2350.o; arm-none-eabi-ld -Ttext=0 rp2350.o -o rp2350.elf; arm-none-eabi-objcopy -O binary rp2350.elf rp2350.bin
        .syntax unified
        .thumb
        .equ    SIO, 0xd0000000
        .equ    FIFO_ST, 0x50
        .equ    FIFO_WR, 0x54
        .equ    FIFO_RD, 0x58
        .equ    AIRCR, 0xe000ed0c
        .equ    VTOR, 0xe000ed08

        .word   0x20082000              @ vector table: a stack, then core 1's wait for everything
        .word   core1 + 1
        .word   core1 + 1
        .word   core1 + 1
        .ascii  "Mu"                    @ 0x10: the magic number, then the version
        .byte   2, 2
        .hword  0                       @ 0x14: no data table
        .hword  lookup + 1              @ 0x16
        .word   0                       @ 0x18

@ Core 1: empty the FIFO, say 0, then wait for 0 0 1 and the three words; every word is answered with itself.
        .balign 4
core1:  ldr     r4, =SIO
0:      ldr     r0, [r4, #FIFO_ST]
        lsls    r0, #31                 @ VLD
        beq     1f
        ldr     r0, [r4, #FIFO_RD]
        b       0b
1:      movs    r0, #0
        bl      answer
restart:
        movs    r5, #0                  @ how many words were right
next:   ldr     r0, [r4, #FIFO_ST]
        lsls    r0, #31
        bne     2f
        wfe
        b       next
2:      ldr     r0, [r4, #FIFO_RD]
        bl      answer
        cmp     r5, #3
        bhs     4f
        lsrs    r1, r5, #1              @ expected: 0 0 1
        cmp     r0, r1
        beq     3f
        cmp     r0, #0                  @ a 0 out of turn is the first word of another attempt
        bne     restart
        movs    r5, #1
        b       next
4:      mov     r6, r7                  @ the last three words, oldest in r6
        mov     r7, r8
        mov     r8, r0
3:      adds    r5, #1
        cmp     r5, #6
        blo     next
        ldr     r1, =VTOR               @ vector table, stack, entry
        str     r6, [r1]
        msr     msp, r7
        blx     r8
        b       core1

@ The word in r0 to core 0.
answer: ldr     r1, [r4, #FIFO_ST]
        lsls    r1, #30                 @ RDY
        bpl     answer
        str     r0, [r4, #FIFO_WR]
        sev
        bx      lr

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
