@ What stands for the boot ROM of RP2350 in the emulator: the wait of core 1 for its start over the FIFO (datasheet 5.3),
@ the look-up of ROM functions (5.4.1), and those few that firmware here calls: the flash chip's over QMI (12.14). Written for this project.
@ arm-none-eabi-as -mcpu=cortex-m33 -I . rp2350.s -o rp2350.o; arm-none-eabi-ld -Ttext=0 rp2350.o -o rp2350.elf; arm-none-eabi-objcopy -O binary rp2350.elf rp2350.bin
        .syntax unified
        .thumb
        .equ    AIRCR, 0xe000ed0c
        .equ    QMI, 0x400d0000

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
        .hword  leave + 1
        .ascii  "RE"                    @ flash_range_erase
        .hword  erase + 1
        .ascii  "RP"                    @ flash_range_program
        .hword  program + 1
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

@ Ones alone end the chip's reading ahead.
        .balign 4
leave:  push    {r4, lr}
        bl      direct
        bl      select
        movs    r0, #0xff
        bl      send
        movs    r0, #0xff
        bl      send
        bl      idle
        pop     {r4, pc}

@ erase(r0: where in the chip, r1: bytes, r2 and r3: what larger blocks are erased with), by sectors alone.
erase:  push    {r4-r7, lr}
        mov     r5, r0
        adds    r6, r0, r1
        bl      direct
1:      cmp     r5, r6
        bhs     finish
        movs    r0, #0x20
        bl      begin
        bl      wait
        add     r5, r5, #4096
        b       1b

@ program(r0: where in the chip, r1: data, r2: bytes), by pages.
program:
        push    {r4-r7, lr}
        mov     r5, r0
        mov     r7, r1
        adds    r6, r0, r2
        bl      direct
2:      cmp     r5, r6
        bhs     finish
        movs    r0, #2
        bl      begin
3:      ldrb    r0, [r7]
        bl      send
        adds    r7, #1
        adds    r5, #1
        tst     r5, #0xff
        bne     3b
        bl      wait
        b       2b
finish: bl      idle
        pop     {r4-r7, pc}

@ It may be written; then the command R0 and the address R5.
begin:  push    {r0, lr}
        bl      select
        movs    r0, #6
        bl      send
        bl      direct
        bl      select
        pop     {r0}
        bl      send
        lsrs    r0, r5, #16
        bl      send
        lsrs    r0, r5, #8
        bl      send
        mov     r0, r5
        bl      send
        pop     {pc}

@ The end of a command; until it is carried out.
wait:   push    {lr}
4:      bl      direct
        bl      select
        movs    r0, #5
        bl      send
        bl      send
        lsls    r0, r0, #31
        bmi     4b
        bl      direct
        pop     {pc}

@ Direct mode, with the chip and without it; and its end.
direct: ldr     r4, =QMI
        ldr     r0, =6 << 22 | 1
        str     r0, [r4]
        bx      lr
select: ldr     r0, =6 << 22 | 5
        str     r0, [r4]
        bx      lr
idle:   ldr     r0, =6 << 22
        str     r0, [r4]
        bx      lr

@ R0: a byte to the chip, then that from it.
send:   uxtb    r0, r0
        str     r0, [r4, #4]
5:      ldr     r1, [r4]
        lsls    r1, r1, #15             @ RXEMPTY
        bmi     5b
        ldr     r0, [r4, #8]
        bx      lr
        .balign 4
        .ltorg
