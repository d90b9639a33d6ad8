@ Everything that the assembler takes, once; the GNU assembler must make the same of it.
        .syntax unified
        .thumb
        .equ    SIO, 0xd0000000
        .equ    FIFO, SIO + 0x50
        .equ    MASK, (1 << 4 | 1 << 2) - 1

        .section .vectors, "a"
        .word   stack_top, start + 1, 7 + 2 * 3, -1
        .short  1, 0x1234, 'A'
        .byte   1, 2, 255, ~0 & 0xff
        .balign 4
        .word   later - table, table

        .text
        .global start
        .type   start, %function
start:  push    {r4-r7, lr}
        ldr     r4, =SIO
        ldr     r5, =0x12345678
        ldr     r6, =counter
        ldr     r7, =counter + 4
        ldr     r0, =0x12345678
        ldr     r1, =0xffffff00
        ldr     r2, =0x8765
        ldr     r8, =0x9abcdef0
        ldr     r3, [r4, #FIFO - SIO]
        str     r3, [r4, #0x54]
        adds    r0, #1 ; adds r1, r1, #MASK
        adds    r0, r0, #200
        add     r2, r2, r8
        add     sp, sp, #8
        sub     sp, #8
        movs    r0, #0
        mov     r9, #0xff00ff00
        movw    r0, #:lower16:counter
        movt    r0, #:upper16:counter
        movw    r0, #0xabcd
1:      subs    r0, #1
        bne     1b
        cbz     r0, 2f
        beq     far
        b       1f
2:      cmp     r1, #4
        itte    eq
        addeq   r0, r0, #1
        moveq   r1, #2
        movne   r1, #3
        it      lo
        bxlo    lr
1:      bl      helper
        bl      outside
        bhs     1b
        ldr     r0, later
        adr     r1, table
        tbb     [pc, r0]
table:  .byte   (2f - table) / 2, (3f - table) / 2
2:      ssat    r0, #16, r1
3:      smmul   r0, r1, r2
        smlal   r0, r1, r2, r3
        ldrh    r0, [r1], #2
        strh    r0, [r2, #-2]!
        ldrd    r0, r1, [r3, #8]
        ldrsh   r0, [r1, r2]
        ldr     r0, [r1, r2, lsl #2]
        stmia   r3!, {r0, r1}
        ldmia   r3, {r0, r1, r4}
        msr     msp, r0
        mrs     r0, primask
        cpsid   i
        dsb     sy
        wfe
        bkpt    #0xab
        ldrex   r0, [r1]
        strex   r2, r0, [r1]
        clz     r0, r1
        lsls    r0, r1, #3
        asr     r8, r9, #3
        mvns    r0, r1
        uxth    r0, r1
        bx      lr
        .p2align 2
later:  .word   0x11223344
        .ltorg
        .space  300
far:    ldr     r0, =0x5a5a1234
        b       start
        bne     1b
        b       outside
        pop     {r4-r7, pc}
        .size   start, . - start
helper: bx      lr
        .p2align 4
        .set    N, 0
        .rept   3
        .if     N > 1
        b       1f
        .endif
        addw    r0, r0, #N * 100
1:      .set    N, N + 1
        .endr
        udf     #0

        .data
counter: .word  5, start
        .asciz  "a;b@c\n"
        .bss
        .p2align 2
stack:  .space  64
stack_top:
