@ The start of a knob, or of KNOBS of them: pins, the state machines that read their angle sensors, the carrier, and where their motors'
@ magnets are, one after the other. Called once, without interrupts.
        .syntax unified
        .thumb

@ What is kept of the knob (offsets.rs).
        .section .bss.near.core0.knob, "aw", %nobits
        .balign 4
        .global knob
knob:   .space  64 * KNOBS

        .section .text.start, "ax"
        .balign 4
@ Once a period, side-set is the clock, set is select: 24 bits, read nine cycles after the edge that puts them out.
reader: .short  0xe001                  @    set pins, 1    side 0
        .short  0xa022 | IDLE_REST << 8 @    mov x, y       side 0 [IDLE_REST]
        .short  0x0f42                  @ 2: jmp x-- 2      side 0 [15]
        .short  0xef00                  @    set pins, 0    side 0 [15]
        .short  0xe037                  @    set x, 23      side 0
        .short  0xb642                  @ 5: nop            side 1 [6]
        .short  0xa342                  @    nop            side 0 [3]
        .short  0x4101                  @    in pins, 1     side 0 [1]
        .short  0x0045                  @    jmp x-- 5      side 0
        .short  0x8000                  @    push noblock   side 0
reader_end:

@ (pin, what its pad is told, function): outputs without pulls but to ground, inputs pulled up. The enable comes first.
        .global pins, pins_end
pins:
        .byte   PIN_ENABLE, 0x56, 5, 0
        .byte   PIN_FAULT, 0x5a, 5, 0
        .byte   PIN_CLOCK, 0x56, 6, 0
        .byte   PIN_SELECT, 0x56, 6, 0
        .byte   PIN_DATA, 0x5a, 6, 0
        .byte   PIN_PHASE0, 0x56, 4, 0
        .byte   PIN_PHASE1, 0x56, 4, 0
        .byte   PIN_PHASE2, 0x56, 4, 0
        .if     KNOBS > 1
        .byte   PIN_DATA_1, 0x5a, 6, 0
        .byte   PIN_PHASE0_1, 0x56, 4, 0
        .byte   PIN_PHASE1_1, 0x56, 4, 0
        .byte   PIN_PHASE2_1, 0x56, 4, 0
        .endif
        .if     KNOBS > 2
        .byte   PIN_DATA_2, 0x5a, 6, 0
        .byte   PIN_PHASE0_2, 0x56, 4, 0
        .byte   PIN_PHASE1_2, 0x56, 4, 0
        .byte   PIN_PHASE2_2, 0x56, 4, 0
        .endif
        .if     KNOBS > 3
        .byte   PIN_DATA_3, 0x5a, 6, 0
        .byte   PIN_PHASE0_3, 0x56, 4, 0
        .byte   PIN_PHASE1_3, 0x56, 4, 0
        .byte   PIN_PHASE2_3, 0x56, 4, 0
        .endif
pins_end:

        .global board_converter
        .type   board_converter, %function
board_converter:
        push    {r4-r11, lr}
        bl      board_watchdog          @ the motor is found under its eye
        ldr     r0, =RESETS + 0x3000    @ clear: PIO0, PWM
        ldr     r1, =1 << 11 | 1 << 16
        str     r1, [r0]
        ldr     r0, =RESETS
1:      ldr     r2, [r0, #8]            @ RESET_DONE
        bics    r2, r1, r2
        bne     1b
        ldr     r0, =0xd0000000         @ SIO: the enable is low before its pad leaves isolation
        ldr     r1, =1 << PIN_ENABLE
        str     r1, [r0, #0x20]
        str     r1, [r0, #0x38]
        .if     STORE
        bl      forget_alignment        @ where somebody asked for that
        .endif
        .if     SOUND * I2S
        bl      start_sound
        .endif
        bl      start_reader
        bl      start_carrier
        bl      start_pins
        ldr     r0, =PWM + 0xf0         @ EN: the carrier, and the reader so many cycles later
        ldr     r1, =SLICES
        ldr     r2, =PIO0
        movs    r3, #(1 << KNOBS) - 1
        str     r1, [r0]
        str     r3, [r2]                @ CTRL: all machines in one cycle
        bl      find_motors
        pop     {r4-r11, pc}

@ The state machines, each with its wait before the first frame.
start_reader:
        ldr     r0, =PIO0
        ldr     r1, =reader
        ldr     r2, =reader_end
        add     r3, r0, #0x48           @ INSTR_MEM0
1:      ldrh    r4, [r1]
        str     r4, [r3]
        adds    r1, #2
        adds    r3, #4
        cmp     r1, r2
        bne     1b
        adds    r0, #0xc8               @ of machine 0
        ldr     r6, =knob_pins
        ldr     r7, =KNOBS
        ldr     r8, =PIO0 + 0x10        @ TXF0
3:
        ldr     r1, =1 << 16
        str     r1, [r0]                @ CLKDIV
        ldr     r1, =9 << 12
        str     r1, [r0, #4]            @ EXECCTRL: wraps behind the push
        movs    r1, #0
        str     r1, [r0, #8]            @ SHIFTCTRL: to the left, nothing by itself
        ldr     r1, =1 << 29 | 1 << 26 | PIN_CLOCK << 10 | PIN_CLOCK << 5
        str     r1, [r0, #0x14]         @ PINCTRL: set is the clock, to drive it
        ldr     r1, =0xe081             @ set pindirs, 1
        str     r1, [r0, #0x10]
        nop
        ldr     r2, [r6]                @ PINCTRL: set is select, its data line
        str     r2, [r0, #0x14]
        str     r1, [r0, #0x10]
        ldr     r1, =0xe001             @ set pins, 1
        str     r1, [r0, #0x10]
        ldr     r1, =IDLE_ROUNDS
        str     r1, [r8]
        ldr     r1, =0x80a0             @ pull
        str     r1, [r0, #0x10]
        nop
        ldr     r1, =0xa047             @ mov y, osr
        str     r1, [r0, #0x10]
        ldr     r1, =FIRST_ROUNDS
        str     r1, [r8]
        ldr     r1, =0x80a0
        str     r1, [r0, #0x10]
        nop
        ldr     r1, =0xa027             @ mov x, osr
        str     r1, [r0, #0x10]
        nop
        movs    r1, #2                  @ jmp 2
        str     r1, [r0, #0x10]
        adds    r0, #0x18
        adds    r6, #4
        add     r8, r8, #4
        subs    r7, #1
        bne     3b
        ldr     r0, =PIO0 + 0x170
        movs    r1, #1
        str     r1, [r0]                @ IRQ0_INTE: a word of machine 0
        bx      lr

@ Three phases at half of the supply, counting up and down.
start_carrier:
        ldr     r7, =knob_wires
        ldr     r8, =knob_wires + 12 * KNOBS
        ldr     r2, =PWM_MIDDLE << 16 | PWM_MIDDLE
        ldr     r3, =PWM_TOP
        movs    r4, #16
        movs    r5, #2                  @ CSR: phase-correct
        movs    r6, #0
2:      ldr     r0, [r7]
        ldr     r1, [r7, #4]
1:      str     r5, [r0]
        str     r4, [r0, #4]            @ DIV
        str     r6, [r0, #8]            @ CTR
        str     r2, [r0, #0xc]          @ CC
        str     r3, [r0, #0x10]         @ TOP
        cmp     r0, r1
        mov     r0, r1
        bne     1b
        adds    r7, #12
        cmp     r7, r8
        bne     2b
        bx      lr

@ Where the magnet is: a field that stands still pulls it there, and one that turns once takes it along, there and back, so that what
@ friction holds back cancels out. Where it is known from a start before (knob_store.s), a small motion shows whether that is right.
@
@   look (disabled) -> known and still right, or of each: raise -> once forward -> wait -> once back -> wait -> direction, offset
find_motors:
        push    {lr}
        mov     r1, #8192               @ the first word may be any
        bl      limit
        movs    r7, #0                  @ the number of the last word
        bl      next_word
        movs    r1, #STEPS_MAX
        bl      limit
        ldr     r5, =LOOK
1:      bl      next_word
        subs    r5, #1
        bne     1b
        ldr     r4, =knob
        movs    r5, #KNOBS
2:      ldr     r0, [r4, #K_AGE]
        cmp     r0, #8                  @ a word may be wrong now and then
        bhs     lost
        adds    r4, #64
        subs    r5, #1
        bne     2b
        bl      enable_drivers
        cmp     r0, #0
        bne     begin                   @ a sensor without its magnet
        .if     STORE
        bl      recall_alignment
        cmp     r0, #0
        beq     find_all
        bl      check_alignment
        cmp     r0, #0
        bne     begin
find_all:
        .endif
        ldr     r10, =knob_wires
        ldr     r4, =knob
        movs    r1, #KNOBS
        mov     r11, r1
find_motor:
        mov     r9, #16384              @ where the field begins to turn
        bl      raise
        movs    r5, #0
3:      bl      field                   @ forward
        adds    r5, #1
        cmp     r5, #8192
        bls     3b
        subs    r5, #1
        bl      stand
        ldr     r8, [r4, #K_POSITION]
        ldr     r9, [r4, #K_FRAME_ANGLE]
4:      bl      field                   @ and back
        subs    r5, #1
        bpl     4b
        movs    r5, #0
        bl      stand
        ldr     r1, [r4, #K_POSITION]
        subs    r0, r8, r1              @ how far an electrical turn is
        mov     r8, r0
        bl      set_factors
        ldr     r0, [r4, #K_TURN]
        cmp     r8, #0
        bpl     5f
        rsb     r8, r8, #0
5:
        ldr     r1, =TURNED_LOW
        cmp     r8, r1
        blt     lost
        ldr     r1, =TURNED_HIGH
        cmp     r8, r1
        bgt     lost
        ldr     r1, [r4, #K_FRAME_ANGLE]
        muls    r1, r0, r1              @ both ends are electrical angle 0: the middle of what they say
        mul     r9, r9, r0
        sub     r9, r9, r1
        sxth    r9, r9
        add     r1, r1, r9, asr #1
        mov     r0, #32768              @ phase a is minus the sine
        sub     r0, r0, r1
        str     r0, [r4, #K_OFFSET]
        movs    r1, #0
        bl      hold                    @ no force
        adds    r4, #64                 @ the next one
        add     r10, r10, #12
        subs    r11, r11, #1
        bne     find_motor
        .if     STORE
        bl      keep_alignment
        .endif
        b       begin
lost:   ldr     r0, =0xd0000000         @ it is disabled, and no tick enables it
        ldr     r1, =1 << PIN_ENABLE
        str     r1, [r0, #0x20]
        ldr     r0, =core0
        ldr     r1, [r0, #C_FAULTS]
        orr     r1, r1, #FAULT_ALIGN
        str     r1, [r0, #C_FAULTS]
begin:  movs    r0, #0                  @ where each stands now is its middle
        ldr     r4, =knob
        movs    r1, #KNOBS
1:      str     r0, [r4, #K_TICK]
        str     r0, [r4, #K_POSITION]
        str     r0, [r4, #K_SPEED]
        adds    r4, #64
        subs    r1, #1
        bne     1b
        pop     {pc}

@ Drivers are enabled where there is no fault. R0: the faults.
        .global enable_drivers
        .type   enable_drivers, %function
enable_drivers:
        ldr     r0, =core0
        ldr     r0, [r0, #C_FAULTS]
        cmp     r0, #0
        bne     1f
        ldr     r2, =0xd0000000
        ldr     r1, =1 << PIN_ENABLE
        str     r1, [r2, #0x18]         @ SIO: GPIO_OUT_SET
1:      bx      lr

@ Direction and factors of the knob at R4, whose angle falls in a turn of the field where R0 is below 0. Keeps R4 and on.
        .global set_factors
        .type   set_factors, %function
set_factors:
        push    {r5, lr}
        cmp     r0, #0
        ldr     r0, =TURN0
        ldr     r1, =-GAIN0             @ a positive word is against the angle
        ldr     r2, =-LEAD0
        ldr     r3, =BACK0
        bpl     5f
        rsbs    r0, r0, #0
        rsbs    r1, r1, #0
        rsbs    r2, r2, #0
        rsbs    r3, r3, #0
5:      str     r0, [r4, #K_TURN]
        str     r1, [r4, #K_GAIN]
        str     r2, [r4, #K_LEAD]
        str     r3, [r4, #K_BACK]
        pop     {r5, pc}

@ R1: how far each may turn in a tick.
        .global limit
        .type   limit, %function
limit:  ldr     r4, =knob
        movs    r0, #KNOBS
1:      str     r1, [r4, #K_LIMIT]
        adds    r4, #64
        subs    r0, #1
        bne     1b
        bx      lr

@ A field at the electrical angle R9 grows. R6: a counter.
        .global raise
        .type   raise, %function
raise:  push    {lr}
        movs    r6, #0
1:      ldr     r1, =ALIGN
        ldr     r2, =RAISE
        muls    r1, r6, r1
        udiv    r1, r1, r2
        bl      hold
        adds    r6, #1
        ldr     r2, =RAISE
        cmp     r6, r2
        bne     1b
        pop     {pc}

@ A field at the electrical angle R9, with the amplitude R1; then a word.
        .global hold
        .type   hold, %function
hold:   push    {lr}
        mov     r0, r9
        mov     r2, r10
        bl      board_phases
        bl      next_word
        pop     {pc}

@ The field at step R5 of 8192 of an electrical turn, which begins and ends slowly; then a word.
field:  push    {lr}
        ldr     r3, =sines
        lsrs    r0, r5, #4              @ half a turn of the table: its cosine
        add     r0, r0, #256
        ldrsh   r0, [r3, r0, lsl #1]
        ldr     r1, [r3, #512]          @ the largest sine
        sxth    r1, r1
        subs    r0, r1, r0
        lsls    r0, r0, #15
        udiv    r0, r0, r1
        add     r0, r0, #16384          @ phase a is its cosine
        ldr     r1, =ALIGN
        mov     r2, r10
        bl      board_phases
        bl      next_word
        pop     {pc}

@ The field stands still.
stand:  push    {lr}
        ldr     r6, =WAIT
1:      bl      field
        subs    r6, #1
        bne     1b
        pop     {pc}

@ Waits for the word behind number R7, which the watchdog sees.
        .global next_word
        .type   next_word, %function
next_word:
        push    {lr}
1:      bl      board_begin
        cmp     r0, r7
        beq     1b
        mov     r7, r0
        ldr     r0, =board_feed         @ in RAM
        blx     r0
        pop     {pc}
        .ltorg

@ Outputs go to their safe state, at once and for good: the driver is disabled, then its phases are low. Called after a fault.
        .section .text.firmware.board, "ax"
        .global board_off
        .type   board_off, %function
board_off:
        ldr     r0, =0xd0000000
        ldr     r1, =1 << PIN_ENABLE
        str     r1, [r0, #0x20]         @ SIO: GPIO_OUT_CLR
        movs    r1, #0
        ldr     r0, =knob_wires
        ldr     r2, =knob_wires + 12 * KNOBS
1:      ldr     r3, [r0]
        str     r1, [r3, #0xc]
        ldr     r3, [r0, #4]
        str     r1, [r3, #0xc]
        adds    r0, #12
        cmp     r0, r2
        bne     1b
        bx      lr
