@ What stands for the boot ROM of RP2040 in the emulator: the wait of core 1 for its start over the FIFO (datasheet 2.8.2),
@ and the tables of ROM functions (2.8.3) with those that need no flash chip: memory, bits. Written for this project.
@ arm-none-eabi-as -mcpu=cortex-m0plus -I . rp2040.s -o rp2040.o; arm-none-eabi-ld -Ttext=0 rp2040.o -o rp2040.elf; arm-none-eabi-objcopy -O binary rp2040.elf rp2040.bin
        .syntax unified
        .thumb
        .equ    AIRCR, 0xe000ed0c

        .word   0x20042000              @ vector table: a stack, then core 1's wait for everything
        .word   core1 + 1
        .word   core1 + 1
        .word   core1 + 1
        .ascii  "Mu"                    @ 0x10: the magic number, then the version
        .byte   1, 3
        .hword  functions               @ 0x14
        .hword  nothing                 @ 0x16: no data
        .hword  lookup + 1              @ 0x18
        .hword  0

        .include "core1.s"

@ lookup(r0: table, r1: two letters): the function, or 0.
        .balign 4
lookup: ldrh    r2, [r0]
        cmp     r2, #0
        beq     8f
        cmp     r2, r1
        beq     7f
        adds    r0, #4
        b       lookup
7:      ldrh    r0, [r0, #2]
        bx      lr
8:      movs    r0, #0
        bx      lr

        .balign 4
functions:
        .ascii  "MC"                    @ memcpy
        .hword  copy + 1
        .ascii  "C4"                    @ memcpy of words
        .hword  copy + 1
        .ascii  "MS"                    @ memset
        .hword  set + 1
        .ascii  "S4"                    @ memset of words
        .hword  set + 1
        .ascii  "L3"                    @ clz32
        .hword  clz + 1
        .ascii  "T3"                    @ ctz32
        .hword  ctz + 1
        .ascii  "P3"                    @ popcount32
        .hword  popcount + 1
        .ascii  "R3"                    @ reverse32
        .hword  reverse + 1
        .ascii  "WV"                    @ wait_for_vector
        .hword  core1 + 1
        .ascii  "FC"                    @ flash_flush_cache
        .hword  done + 1
        .ascii  "IF"                    @ connect_internal_flash
        .hword  done + 1
        .ascii  "EX"                    @ flash_exit_xip
        .hword  done + 1
        .ascii  "CX"                    @ flash_enter_cmd_xip
        .hword  done + 1
        .ascii  "UB"                    @ reset_to_usb_boot
        .hword  reboot + 1
nothing:
        .word   0

@ copy(to, from, bytes): to.
copy:   movs    r3, r0
1:      subs    r2, #1
        bmi     done
        ldrb    r0, [r1, r2]
        strb    r0, [r3, r2]
        movs    r0, r3
        b       1b

@ set(to, byte, bytes): to.
set:    subs    r2, #1
        bmi     done
        strb    r1, [r0, r2]
        b       set

clz:    movs    r1, #32                 @ how often it can be halved
1:      cmp     r0, #0
        beq     2f
        lsrs    r0, #1
        subs    r1, #1
        b       1b
2:      movs    r0, r1
        bx      lr

ctz:    movs    r1, #32                 @ how often it can be doubled
1:      cmp     r0, #0
        beq     2f
        lsls    r0, #1
        subs    r1, #1
        b       1b
2:      movs    r0, r1
        bx      lr

popcount:
        movs    r1, #0
        movs    r2, #0
1:      lsrs    r0, #1
        adcs    r1, r2
        cmp     r0, #0
        bne     1b
        movs    r0, r1
        bx      lr

reverse:
        movs    r2, #32
1:      lsrs    r0, #1
        adcs    r1, r1
        subs    r2, #1
        bne     1b
        movs    r0, r1
done:   bx      lr

        .balign 4
reboot: ldr     r0, =AIRCR
        ldr     r1, =0x05fa0004         @ SYSRESETREQ
        str     r1, [r0]
9:      b       9b
        .balign 4
        .ltorg
