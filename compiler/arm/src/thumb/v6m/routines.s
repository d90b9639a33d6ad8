@ What ARMv6-M has no instruction for. Operands in R0 and R1, the result in R0; R1 to R3, R12 and the flags are not kept.
        .syntax unified
        .thumb
        .text

@ The top word of a product with signs, rounded half up. With a = 2^16 ah + al and b alike,
@   a b = 2^32 ah bh + 2^16 (ah bl + al bh) + al bl
@ and each sum of a product of halves and 16 bits is a word. 20 cycles.
        .type   mul_top, %function
mul_top:
        uxth    r2, r0
        uxth    r3, r1
        asrs    r0, r0, #16
        asrs    r1, r1, #16
        mov     r12, r2
        muls    r2, r3, r2              @ al bl
        muls    r3, r0, r3              @ ah bl
        muls    r0, r1, r0              @ ah bh
        lsrs    r2, r2, #16
        adds    r3, r3, r2              @ ah bl + al bl / 2^16
        mov     r2, r12
        muls    r1, r2, r1              @ al bh
        uxth    r2, r3
        adds    r1, r1, r2
        asrs    r3, r3, #16
        adds    r0, r0, r3
        asrs    r1, r1, #16             @ the bit below is the carry
        adcs    r0, r1
        bx      lr

@ The same, rounded down.
        .type   mul_high, %function
mul_high:
        uxth    r2, r0
        uxth    r3, r1
        asrs    r0, r0, #16
        asrs    r1, r1, #16
        mov     r12, r2
        muls    r2, r3, r2
        muls    r3, r0, r3
        muls    r0, r1, r0
        lsrs    r2, r2, #16
        adds    r3, r3, r2
        mov     r2, r12
        muls    r1, r2, r1
        uxth    r2, r3
        adds    r1, r1, r2
        asrs    r3, r3, #16
        adds    r0, r0, r3
        asrs    r1, r1, #16
        adds    r0, r0, r1
        bx      lr

@ The same without signs.
        .type   umul_high, %function
umul_high:
        uxth    r2, r0
        uxth    r3, r1
        lsrs    r0, r0, #16
        lsrs    r1, r1, #16
        mov     r12, r2
        muls    r2, r3, r2
        muls    r3, r0, r3
        muls    r0, r1, r0
        lsrs    r2, r2, #16
        adds    r3, r3, r2              @ at most 65535 65535 + 65534: no carry
        mov     r2, r12
        muls    r1, r2, r1
        uxth    r2, r3
        adds    r1, r1, r2
        lsrs    r3, r3, #16
        adds    r0, r0, r3
        lsrs    r1, r1, #16
        adds    r0, r0, r1
        bx      lr

@ A quotient without signs, bit by bit: R2 is what remains, the quotient follows the dividend into R0. 0 for a divisor of 0.
        .type   divide, %function
divide: movs    r2, #0
        movs    r3, #32
        cmp     r1, #0
        beq     3f
@! rounds 32
1:      adds    r0, r0, r0
        adcs    r2, r2
        bcs     4f
        cmp     r2, r1
        blo     2f
4:      subs    r2, r2, r1
        adds    r0, #1
2:      subs    r3, #1
        bne     1b
        bx      lr
3:      movs    r0, #0
        bx      lr

@ How many zeros the word in R0 begins with.
        .type   leading_zeros, %function
leading_zeros:
        movs    r1, #32
        cmp     r0, #0
        beq     2f
        movs    r1, #0
        lsrs    r2, r0, #16
        bne     1f
        adds    r1, #16
        lsls    r0, r0, #16
1:      lsrs    r2, r0, #24
        bne     3f
        adds    r1, #8
        lsls    r0, r0, #8
3:      lsrs    r2, r0, #28
        bne     4f
        adds    r1, #4
        lsls    r0, r0, #4
4:      lsrs    r2, r0, #30
        bne     5f
        adds    r1, #2
        lsls    r0, r0, #2
5:      lsrs    r2, r0, #31
        bne     2f
        adds    r1, #1
2:      mov     r0, r1
        bx      lr
