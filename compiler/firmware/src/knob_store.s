@ What a start finds of the motors, kept in a sector of flash, so that the next one need not turn them. A record counts where its check
@ is right, it is of these parts, and each motor does what it says of it: after a write that was cut off, with other parts, or where a
@ magnet was moved, the motors are found anew.
@
@   STORE_AT | "WHIP" | number of the parts | of each: turn, offset | CRC-32 of all these | ones, a page in all
@
@ Somebody asks for that by board_align: a word in the watchdog's scratch, which outlives a reset, then a reset.
        .syntax unified
        .thumb
        .if     STORE
        .equ    RECORD_MARK, 0x50494857
        .equ    ASKED, 0x4e474c41
        .equ    STEP, 3                 @ of 65536 a turn

@ The page as it is written.
        .section .bss.store, "aw", %nobits
        .balign 4
store_page: .space 256

        .section .text.start, "ax"
@ R0: not 0 where what is stored is taken.
        .global recall_alignment
        .type   recall_alignment, %function
recall_alignment:
        push    {r4-r6, lr}
        ldr     r5, =STORE_AT
        ldr     r0, [r5]
        ldr     r1, =RECORD_MARK
        cmp     r0, r1
        bne     8f
        ldr     r0, [r5, #4]
        ldr     r1, =STORE_NUMBER
        cmp     r0, r1
        bne     8f
        bl      record_check
        ldr     r1, [r5]                @ R5 is behind what is checked
        cmp     r0, r1
        bne     8f
        ldr     r5, =STORE_AT + 8
        ldr     r4, =knob
        movs    r6, #KNOBS
1:      ldr     r0, [r5]
        bl      set_factors
        ldr     r0, [r5, #4]
        str     r0, [r4, #K_OFFSET]
        adds    r4, #64
        adds    r5, #8
        subs    r6, #1
        bne     1b
        movs    r0, #1
        pop     {r4-r6, pc}
8:      movs    r0, #0
        pop     {r4-r6, pc}

@ R0: the CRC-32 of the record at R5, which is behind it then.
record_check:
        mov     r0, #-1
        ldr     r2, =0xedb88320
        movs    r3, #STORE_WORDS
1:      ldr     r1, [r5]
        adds    r5, #4
        eors    r0, r1
        movs    r1, #32
2:      lsrs    r0, r0, #1
        it      cs
        eorcs   r0, r0, r2
        subs    r1, #1
        bne     2b
        subs    r3, #1
        bne     1b
        mvns    r0, r0
        bx      lr

@ Whether each motor does what is stored of it. A field where its magnet is said to be makes no torque if that is right, and takes the
@ magnet along as it moves on by a twelfth of an electrical turn; a magnet opposite to it is pushed the other way. R0: not 0 where all do.
@
@   raise -> (stands?) -> a twelfth on -> (follows?) -> back -> none
        .global check_alignment
        .type   check_alignment, %function
check_alignment:
        push    {r4-r6, r8-r11, lr}     @ R7 goes on: the number of the last word
        ldr     r10, =knob_wires
        ldr     r4, =knob
        movs    r1, #KNOBS
        mov     r11, r1
1:      ldr     r8, [r4, #K_POSITION]
        ldr     r0, [r4, #K_TURN]
        ldr     r1, [r4, #K_FRAME_ANGLE]
        mul     r9, r0, r1
        ldr     r0, [r4, #K_OFFSET]
        add     r9, r9, r0
        sub     r9, r9, #16384          @ a quarter behind the voltage of a torque
        bl      raise
        bl      hold_on
        ldr     r0, [r4, #K_POSITION]
        sub     r5, r0, r8              @ how far it did not stand
        mov     r8, r0
        movs    r0, #STEP
        bl      move_on
        ldr     r0, [r4, #K_POSITION]
        sub     r8, r0, r8              @ how far it followed
        mvn     r0, #STEP - 1
        bl      move_on
        movs    r1, #0
        bl      hold
        cmp     r5, #0
        bpl     3f
        rsbs    r5, r5, #0
3:      ldr     r0, =STANDS
        cmp     r5, r0
        bgt     8f
        ldr     r0, [r4, #K_TURN]       @ its angle may fall in a turn of the field
        cmp     r0, #0
        bpl     4f
        rsb     r8, r8, #0
4:      ldr     r0, =FOLLOWS_LOW
        cmp     r8, r0
        blt     8f
        ldr     r0, =FOLLOWS_HIGH
        cmp     r8, r0
        bgt     8f
        adds    r4, #64                 @ the next one
        add     r10, r10, #12
        subs    r11, r11, #1
        bne     1b
        movs    r0, #1
        pop     {r4-r6, r8-r11, pc}
8:      movs    r0, #0
        pop     {r4-r6, r8-r11, pc}

@ The field moves by R0 in each of so many ticks that they are a twelfth of a turn, then stands there until the magnet does.
move_on:
        push    {r8, lr}
        mov     r8, r0
        ldr     r6, =65536 / 12 / STEP
1:      add     r9, r9, r8
        ldr     r1, =ALIGN
        bl      hold
        subs    r6, #1
        bne     1b
        pop     {r8, lr}

hold_on:
        push    {lr}
        ldr     r6, =WAIT
1:      ldr     r1, =ALIGN
        bl      hold
        subs    r6, #1
        bne     1b
        pop     {pc}
        .ltorg

@ Writes what was found, with disabled drivers, as nobody sees the sensors meanwhile; then goes on with the words there are.
        .global keep_alignment
        .type   keep_alignment, %function
keep_alignment:
        push    {r4-r6, lr}
        ldr     r0, =core0
        ldr     r0, [r0, #C_FAULTS]
        cmp     r0, #0
        bne     9f
        ldr     r0, =0xd0000000
        ldr     r1, =1 << PIN_ENABLE
        str     r1, [r0, #0x20]         @ SIO: GPIO_OUT_CLR
        ldr     r5, =store_page
        mov     r0, #-1
        movs    r1, #64
1:      str     r0, [r5]
        adds    r5, #4
        subs    r1, #1
        bne     1b
        sub     r5, r5, #256
        ldr     r0, =RECORD_MARK
        str     r0, [r5]
        ldr     r0, =STORE_NUMBER
        str     r0, [r5, #4]
        ldr     r4, =knob
        movs    r1, #KNOBS
        add     r6, r5, #8
2:      ldr     r0, [r4, #K_TURN]
        str     r0, [r6]
        ldr     r0, [r4, #K_OFFSET]
        str     r0, [r6, #4]
        adds    r4, #64
        adds    r6, #8
        subs    r1, #1
        bne     2b
        bl      record_check
        str     r0, [r5]
        movs    r0, #1
        ldr     r1, =write_store        @ in RAM
        blx     r1
        mov     r1, #8192               @ by now it may be anywhere
        bl      limit
        bl      next_word               @ words of before the write
        bl      next_word
        movs    r1, #STEPS_MAX
        bl      limit
        bl      enable_drivers
9:      pop     {r4-r6, pc}

@ Erases what is stored where somebody asked for that.
        .global forget_alignment
        .type   forget_alignment, %function
forget_alignment:
        ldr     r0, =SCRATCH
        ldr     r1, [r0]
        ldr     r2, =ASKED
        cmp     r1, r2
        bne     9f
        movs    r1, #0
        str     r1, [r0]
        movs    r0, #0
        ldr     r1, =write_store
        bx      r1
9:      bx      lr
        .ltorg

@ Erases the sector; writes the page into it where R0 is not 0. Flash answers nobody meanwhile: this lies in RAM and calls ROM alone,
@ interrupts are masked, the other core waits in ROM. The watchdog gets time for the slowest chip; what it would reset is disabled.
        .section .text.firmware.board, "ax"
        .type   write_store, %function
write_store:
        push    {r4-r7, lr}
        mov     r7, r0
        ldr     r1, =WATCHDOG
        ldr     r0, =STORE_WATCHDOG
        str     r0, [r1, #4]            @ LOAD
        ldr     r0, =0x4552             @ "RE", flash_range_erase (RP2350 datasheet 5.4.8)
        bl      rom_function
        mov     r4, r0
        ldr     r0, =0x5052             @ "RP", flash_range_program
        bl      rom_function
        mov     r5, r0
        ldr     r0, =0x4346             @ "FC", flash_flush_cache
        bl      rom_function
        mov     r6, r0
        ldr     r0, =0x4649             @ "IF", connect_internal_flash
        bl      rom_function
        blx     r0
        ldr     r0, =0x5845             @ "EX", flash_exit_xip
        bl      rom_function
        blx     r0
        ldr     r0, =STORE_OFFSET
        mov     r1, #4096
        mov     r2, #65536
        movs    r3, #0xd8
        blx     r4
        cmp     r7, #0
        beq     1f
        ldr     r0, =STORE_OFFSET
        ldr     r1, =store_page
        mov     r2, #256
        blx     r5
1:      blx     r6
        ldr     r0, =0x5843             @ "CX", flash_enter_cmd_xip
        bl      rom_function
        blx     r0
        ldr     r1, =WATCHDOG
        ldr     r0, =WATCHDOG_LOAD
        str     r0, [r1, #4]
        pop     {r4-r7, pc}

@ R0: a function of the ROM, by its two letters; secure, of Arm.
rom_function:
        movs    r1, #4
        movs    r2, #0x16
        ldrh    r2, [r2]
        bx      r2

@ The motors are found anew: drivers are disabled, and the chip starts again.
        .global board_align
        .type   board_align, %function
board_align:
        ldr     r0, =0xd0000000
        ldr     r1, =1 << PIN_ENABLE
        str     r1, [r0, #0x20]         @ SIO: GPIO_OUT_CLR
        ldr     r0, =SCRATCH
        ldr     r1, =ASKED
        str     r1, [r0]
        ldr     r0, =WATCHDOG + 0x2000
        ldr     r1, =1 << 31
        str     r1, [r0]                @ CTRL, set: TRIGGER
1:      b       1b
        .ltorg
        .endif
