@ The delay lines of a program that begins: as long as one of them is not empty this is called in place of the keys, so all drive
@ words stay zero. In instructions that all cores have.
@
@   alarmed -> emptying, half a kilobyte a tick -> beginning, a key a tick
@
@   lines   | from, to, word | .. | 0 |     what memory is to hold (emptying.rs): C_PIECE is the piece, C_SLOT how far it is
        .syntax unified
        .thumb
        .section .text.frame, "ax"
        .if     EMPTIES

@ With the state at R0, the words at R1 and the block at R4, as the keys' code. Keeps no register.
        .type   emptying, %function
emptying:
        ldr     r2, [r4, #C_SLOT]
        cmp     r2, #0
        beq     6f
        ldr     r0, =RAMP               @ force comes back over the whole ramp
        str     r0, [r4, #C_RAMP]
        mov     r0, r2
        ldr     r5, [r4, #C_PIECE]
        ldr     r1, [r5, #4]
        ldr     r2, [r5, #8]
        subs    r1, #16
        mov     r3, r2
        mov     r6, r2
        mov     r7, r2
        movs    r5, #EMPTY_ROUNDS
@! rounds EMPTY_ROUNDS
1:      cmp     r0, r1
        bhi     2f
        stmia   r0!, {r2, r3, r6, r7}
        subs    r5, #1
        bne     1b
        b       5f
2:      adds    r1, #16                 @ less than four words are left
        movs    r5, #4
@! rounds 4
3:      cmp     r0, r1
        bhs     4f
        str     r2, [r0]
        adds    r0, #4
        subs    r5, #1
        bne     3b
4:      ldr     r5, [r4, #C_PIECE]
        adds    r5, #12
        str     r5, [r4, #C_PIECE]
        ldr     r0, [r5]
5:      str     r0, [r4, #C_SLOT]
        bx      lr
6:      ldr     r2, =beginning
        str     r2, [r4, #C_CODE]
        b       beginning
        .ltorg
        .endif
