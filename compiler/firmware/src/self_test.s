@ A self-test of the core's cycles: little programs, and ticks of an instrument's key, under its cycle counter (SysTick where there is
@ none, on a Cortex-M0+). What is found is told beside what was expected (self_test.rs), as text on the serial port and in memory.
@
@   self_test_arena | head: counter = 0, R0, R1, ISB | the program | stub: counter to R0, to `finish` | .. | four words of the head |
@
@ A program has its registers and memory to itself, so what is needed behind it comes from the stub alone. What head and stub take
@ is the count of the empty program, which is subtracted. Nothing interrupts, and the other core never starts.
        .syntax unified
        .thumb
        .if     SMALL
        .equ    COUNTER, 0xe000e018     @ SysTick counts down 24 bits
        .else
        .equ    COUNTER, 0xe0001004     @ DWT_CYCCNT
        .endif
        .equ    TOLD, 16                @ ticks that differ have so many lines
        .equ    T_EXPECTED, 0           @ of a program's row
        .equ    T_STUB, 4
        .equ    T_BLOCKS, 8             @ (to, bytes, from).., 0
        .equ    T_WORDS, 12             @ (at, word).., 0
        .equ    T_TITLE, 16
        .equ    T_PAPER, 20
        .equ    T_FLAGS, 24
        .equ    T_REGISTERS, 28         @ R0 to R12, LR
        .equ    B_STATE, 8              @ of the block `self_test`
        .equ    B_OVERHEAD, 12
        .equ    B_DIFFER, 20
        .equ    B_TICKS_DIFFER, 28
        .equ    B_LONGEST, 32

        .section .vectors, "a"
        .global vectors
vectors:
        .word   STACK0, self_test_reset
        .rept   14
        .word   self_test_dead
        .endr

        .section .text.start, "ax"
        .global self_test_reset
        .type   self_test_reset, %function
self_test_reset:
        cpsid   i
        bl      board_clocks            @ before there is anything in RAM
        bl      fill_memory
        bl      board_serial
        .if     SMALL
        ldr     r0, =0xe000e010
        ldr     r1, =0xffffff
        str     r1, [r0, #4]
        movs    r1, #5                  @ the core's clock, no exception
        str     r1, [r0]
        .else
        ldr     r0, =0xe000edfc         @ DEMCR: TRCENA
        ldr     r1, =1 << 24
        str     r1, [r0]
        ldr     r0, =0xe0001000         @ DWT_CTRL: CYCCNTENA
        movs    r1, #1
        str     r1, [r0]
        ldr     r0, =0xe000ed88         @ CPACR: floating point
        ldr     r1, =15 << 20
        str     r1, [r0]
        dsb     sy
        isb     sy
        .endif
        ldr     r0, =self_test_main
        bx      r0

@ What a debugger reads.
        .section .data.self_test, "aw"
        .balign 4
        .global self_test
self_test:
        .ascii  "WHST"
        .word   1                       @ version of this table
        .word   0                       @ 0: under way, 1: done, 2: the processor met a fault
        .word   0                       @ cycles of the empty program
        .word   PROGRAMS, 0             @ programs, and how many of them differ
        .word   TICKS, 0                @ ticks, and how many of them differ
        .word   0                       @ cycles of the longest
        .word   self_test_found, self_test_ticks_found
        .word   self_test_rows, self_test_ticks_expected
saved:  .word   0, finish               @ the stack while a program runs

        .section .bss.self_test, "aw", %nobits
        .balign 4
        .global self_test_found, self_test_ticks_found
self_test_found: .space 4 * PROGRAMS
self_test_ticks_found: .space 4 * TICKS
        .balign 256
        .space  64                      @ below it is what a program pushes
        .balign 256
        .global self_test_data
self_test_data: .space 256
        .balign 4
self_test_words: .space 4 * WORDS + 8

        .section .text.core1.self_test.arena, "ax"
        .balign 16
self_test_arena:
        ldr     r0, [pc, #0x10c]
        ldr     r1, [pc, #0x110]
        str     r1, [r0]
        ldr     r0, [pc, #0x110]
        ldr     r1, [pc, #0x110]
        nop
        isb     sy
        .global self_test_code
self_test_code: .space 0x100
        .word   COUNTER, 0, 0, 0

@ The count, as the end of every program.
        .section .text.core1.self_test, "ax"
        .balign 4
stubs:
        .if     SMALL
        ldr     r0, [pc, #4]            @ where it is word aligned
        ldr     r0, [r0]
        ldr     r1, [pc, #4]
        bx      r1
        .word   COUNTER, finish
        .space  8
        ldr     r0, [pc, #8]            @ and where it is not
        ldr     r0, [r0]
        ldr     r1, [pc, #8]
        bx      r1
        nop
        .short  COUNTER & 0xffff, COUNTER >> 16
far:    .short  0, 0                    @ finish, from `saved`
        .else
        movw    r0, #COUNTER & 0xffff
        movt    r0, #COUNTER >> 16
        ldr     r0, [r0]
        movw    r1, #:lower16:saved
        movt    r1, #:upper16:saved
        ldr     r1, [r1, #4]
        bx      r1
        .balign 4
        .endif
        .equ    STUB_BYTES, 24

@ What the row at R4 takes, head and stub included, in R0.
        .global self_test_run
        .type   self_test_run, %function
self_test_run:
        push    {r4-r7, lr}
        mov     r0, r8
        mov     r1, r9
        mov     r2, r10
        mov     r3, r11
        push    {r0-r3}
        ldr     r0, =saved
        mov     r1, sp
        str     r1, [r0]
        ldr     r0, =self_test_data     @ every word is its address
        mov     r1, r0
        movs    r2, #64
1:      str     r0, [r1]
        adds    r1, #4
        subs    r2, #1
        bne     1b
        ldr     r3, [r4, #T_WORDS]      @ but for these
2:      ldmia   r3!, {r1}
        cmp     r1, #0
        beq     3f
        ldmia   r3!, {r2}
        str     r2, [r1]
        b       2b
3:      ldr     r5, [r4, #T_BLOCKS]
4:      ldmia   r5!, {r0}
        cmp     r0, #0
        beq     5f
        ldmia   r5!, {r1, r2}
        bl      copy
        b       4b
5:      ldr     r0, [r4, #T_STUB]
        movs    r1, #STUB_BYTES
        ldr     r2, =stubs
        .if     SMALL
        movs    r3, #2
        tst     r0, r3
        beq     6f
        ldr     r3, =saved
        ldr     r3, [r3, #4]
        ldr     r5, =far
        strh    r3, [r5]
        lsrs    r3, r3, #16
        strh    r3, [r5, #2]
        adds    r2, #STUB_BYTES
6:
        .endif
        bl      copy
        adds    r4, #T_REGISTERS
        ldr     r0, =self_test_code + 0x100
        ldr     r1, [r4]
        ldr     r2, [r4, #4]
        str     r1, [r0, #8]
        str     r2, [r0, #12]
        dsb     sy
        isb     sy
        .if     SMALL
        .else
        ldr     r0, =ones               @ numbers that no unit has trouble with
        vldmia  r0, {s0-s31}
        .endif
        ldr     r0, [r4, #4 * 8]
        mov     r8, r0
        ldr     r0, [r4, #4 * 9]
        mov     r9, r0
        ldr     r0, [r4, #4 * 10]
        mov     r10, r0
        ldr     r0, [r4, #4 * 11]
        mov     r11, r0
        ldr     r0, [r4, #4 * 12]
        mov     r12, r0
        ldr     r0, [r4, #4 * 13]
        mov     lr, r0
        ldr     r1, =self_test_data
        mov     sp, r1
        subs    r4, #T_REGISTERS - T_FLAGS
        ldr     r1, [r4]
        adds    r4, #T_REGISTERS - T_FLAGS + 8
        ldr     r0, =self_test_arena + 1
        ldmia   r4!, {r2, r3}
        mov     r5, r4
        ldr     r4, [r5]
        ldr     r6, [r5, #8]
        ldr     r7, [r5, #12]
        ldr     r5, [r5, #4]
        msr     apsr_nzcvq, r1
        bx      r0
        .type   finish, %function
finish: ldr     r1, =saved
        ldr     r1, [r1]
        mov     sp, r1
        pop     {r1-r4}
        mov     r8, r1
        mov     r9, r2
        mov     r10, r3
        mov     r11, r4
        .if     SMALL
        mvns    r0, r0                  @ it counts down; less 2^32 - 2^24, which the difference has not
        lsls    r0, r0, #8
        lsrs    r0, r0, #8
        .endif
        pop     {r4-r7, pc}

@ R1 bytes to R0 from R2, halfword by halfword.
        .type   copy, %function
copy:   ldrh    r3, [r2]
        strh    r3, [r0]
        adds    r0, #2
        adds    r2, #2
        subs    r1, #2
        bne     copy
        bx      lr

@ All programs, then all ticks.
        .global self_test_main
        .type   self_test_main, %function
self_test_main:
        ldr     r0, =self_test_banner
        bl      text
        ldr     r4, =self_test_empty
        bl      self_test_run
        ldr     r7, =self_test
        str     r0, [r7, #B_OVERHEAD]
        ldr     r4, =self_test_rows
        ldr     r5, =self_test_found
        ldr     r6, =PROGRAMS
1:      bl      self_test_run
        ldr     r1, [r7, #B_OVERHEAD]
        subs    r0, r0, r1
        stmia   r5!, {r0}
        bl      tell_program
        adds    r4, #T_REGISTERS + 4 * 14
        subs    r6, #1
        bne     1b
        bl      ticks
        bl      tell_end
        movs    r0, #1
dead:   ldr     r1, =self_test
        str     r0, [r1, #B_STATE]
1:      wfi
        b       1b
        .global self_test_dead
        .type   self_test_dead, %function
self_test_dead:
        cpsid   i
        movs    r0, #2
        b       dead

@ Of the row at R4, which took R0: expected, found, what it is, and if they differ by how much and of what the expected was made.
        .type   tell_program, %function
tell_program:
        push    {r4-r7, lr}
        mov     r5, r0
        ldr     r6, [r4, #T_EXPECTED]
        mov     r0, r6
        bl      number
        mov     r0, r5
        bl      number
        ldr     r0, [r4, #T_TITLE]
        bl      text
        subs    r5, r5, r6
        beq     1f
        ldr     r7, =self_test
        ldr     r0, [r7, #B_DIFFER]
        adds    r0, #1
        str     r0, [r7, #B_DIFFER]
        mov     r0, r5
        bl      differs
        ldr     r0, [r4, #T_PAPER]
        bl      text
1:      ldr     r0, =line_end
        bl      text
        pop     {r4-r7, pc}

@ Ticks of a key, one word after the other in all of its places.
        .type   ticks, %function
ticks:  push    {r4-r7, lr}
        ldr     r0, =tested_state
        ldr     r1, =self_test_words
        ldr     r2, =tested_init
        blx     r2
        ldr     r0, =tested_state + GAIN
        ldr     r1, =65536              @ all its force
        str     r1, [r0]
        ldr     r4, =self_test_motion
        ldr     r5, =self_test_ticks_found
        ldr     r6, =self_test_ticks_expected
        movs    r7, #0
1:      ldr     r1, =self_test_words
        ldrh    r2, [r4]
        movs    r3, #0
2:      strh    r2, [r1, r3]
        adds    r3, #2
        cmp     r3, #2 * WORDS
        bne     2b
        bl      tick
        str     r0, [r5]
        ldr     r3, =self_test
        ldr     r1, [r3, #B_LONGEST]
        cmp     r0, r1
        bls     3f
        str     r0, [r3, #B_LONGEST]
3:      ldr     r1, [r6]
        subs    r0, r0, r1
        beq     4f
        bl      tell_tick
4:      adds    r4, #2
        adds    r5, #4
        adds    r6, #4
        adds    r7, #1
        ldr     r0, =TICKS
        cmp     r7, r0
        bne     1b
        pop     {r4-r7, pc}

@ The cycles of a tick in R0, from one reading of the counter to the next.
        .type   tick, %function
tick:   push    {r4-r7, lr}
        mov     r0, r8
        mov     r1, r9
        mov     r2, r10
        mov     r3, r11
        push    {r0-r3}
        ldr     r0, =tested_state
        ldr     r1, =self_test_words
        ldr     r3, =tested_tick
        ldr     r4, =COUNTER
        movs    r2, #0
        str     r2, [r4]
        isb     sy
        blx     r3
        ldr     r4, =COUNTER
        ldr     r0, [r4]
        .if     SMALL
        mvns    r0, r0
        lsls    r0, r0, #8
        lsrs    r0, r0, #8
        .endif
        pop     {r1-r4}
        mov     r8, r1
        mov     r9, r2
        mov     r10, r3
        mov     r11, r4
        pop     {r4-r7, pc}

@ Of tick R7, which took R0 more than was expected: one line, for the first few of them.
        .type   tell_tick, %function
tell_tick:
        push    {r4-r7, lr}
        mov     r4, r0
        ldr     r3, =self_test
        ldr     r0, [r3, #B_TICKS_DIFFER]
        adds    r0, #1
        str     r0, [r3, #B_TICKS_DIFFER]
        cmp     r0, #TOLD
        bhi     1f
        ldr     r0, [r6]
        bl      number
        ldr     r0, [r5]
        bl      number
        ldr     r0, =tick_title
        bl      text
        mov     r0, r7
        bl      number
        mov     r0, r4
        bl      differs
        ldr     r0, =line_end
        bl      text
1:      pop     {r4-r7, pc}

@ How many there were, and how many of them differ.
        .type   tell_end, %function
tell_end:
        push    {r4, lr}
        ldr     r4, =self_test
        ldr     r0, [r4, #B_DIFFER]
        bl      number
        ldr     r0, =self_test_sum
        bl      text
        ldr     r0, [r4, #B_TICKS_DIFFER]
        bl      number
        ldr     r0, =self_test_ticks_sum
        bl      text
        ldr     r0, [r4, #B_LONGEST]
        bl      number
        ldr     r0, =line_end
        bl      text
        pop     {r4, pc}

@ That something differs by R0.
        .type   differs, %function
differs:
        push    {r4, lr}
        mov     r4, r0
        ldr     r0, =more
        cmp     r4, #0
        bgt     1f
        ldr     r0, =less
        rsbs    r4, r4, #0
1:      bl      text
        mov     r0, r4
        bl      number
        pop     {r4, pc}

@ The number in R0, below 10^7, with a blank before it: at least seven places.
        .type   number, %function
number: push    {r4-r7, lr}
        mov     r4, r0
        ldr     r5, =powers
        movs    r6, #' '
1:      ldmia   r5!, {r7}
        movs    r0, #'0'
2:      cmp     r4, r7
        blo     3f
        subs    r4, r4, r7
        adds    r0, #1
        b       2b
3:      cmp     r0, #'0'
        beq     4f
        movs    r6, #'0'
4:      cmp     r7, #1
        beq     5f
        cmp     r0, #'0'
        bne     5f
        mov     r0, r6
5:      bl      byte
        cmp     r7, #1
        bne     1b
        pop     {r4-r7, pc}

@ The text at R0, up to a 0.
        .type   text, %function
text:   push    {r4, lr}
        mov     r4, r0
1:      ldrb    r0, [r4]
        adds    r4, #1
        cmp     r0, #0
        beq     2f
        bl      byte
        b       1b
2:      pop     {r4, pc}

@ The byte in R0, once the port takes it.
        .type   byte, %function
byte:   push    {r4, lr}
        mov     r4, r0
1:      bl      board_serial_ready
        cmp     r0, #0
        beq     1b
        mov     r0, r4
        bl      board_serial_send
        pop     {r4, pc}

        .section .rodata.self_test.texts, "a"
        .balign 4
powers: .word   1000000, 100000, 10000, 1000, 100, 10, 1
ones:
        .rept   32
        .word   0x3f800000
        .endr
more:   .asciz  " DIFFERS: more by"
less:   .asciz  " DIFFERS: less by"
tick_title: .asciz "  tick"
line_end: .asciz "\r\n"
