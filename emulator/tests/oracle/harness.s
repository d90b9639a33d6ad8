@ Runs cases one after another and writes the state after each to the host's console.
@
@ A case is 17 words (51 with a floating-point unit): R0 to R12, SP, LR, APSR, seed, address of its code; FPSCR, S0 to S31. Its
@ code ends with SVC; whatever exception comes ends it. The record of a case is 20 words: the frame (R0 to R3, R12, LR, PC, XPSR),
@ R4 to R11, SP, exception number, CFSR, checksum of the window; EXC_RETURN, FPSCR, S0 to S31.

        .syntax unified
        .thumb
        .text
vectors:
        .word   STACK_TOP
        .word   reset + 1
        .rept   14
        .word   handler + 1
        .endr

        .thumb_func
reset:
        .if     FPU
        ldr     r0, =0xe000ed88
        ldr     r1, =0x00f00000
        str     r1, [r0]
        dsb
        isb
        .endif
        .if     MAINLINE
        ldr     r0, =0xe000ed24
        ldr     r1, =0x00070000
        str     r1, [r0]
        ldr     r0, =0xe000ed14
        ldr     r1, [r0]
        ldr     r2, =CCR_BITS
        orrs    r1, r2
        str     r1, [r0]
        .endif
        ldr     r1, =open_block
        movs    r0, #1
        bkpt    #0xab
        ldr     r1, =write_block
        str     r0, [r1]
        ldr     r4, =cases
        ldr     r5, =COUNT
next:
        ldr     r0, =progress
        str     r4, [r0]
        str     r5, [r0, #4]
        mov     r1, sp
        str     r1, [r0, #8]
@ Fills the window.
        ldr     r0, =WINDOW
        ldr     r1, [r4, #64]
        ldr     r2, =1664525
        ldr     r3, =1013904223
        movs    r6, #128
1:      muls    r1, r2, r1
        adds    r1, r1, r3
        str     r1, [r0]
        adds    r0, #4
        subs    r6, #1
        bne     1b
@ Enters the case.
        mov     r0, r4
        .if     FPU
        ldr     r1, [r0, #72]
        vmsr    fpscr, r1
        add     r1, r0, #76
        vldm    r1, {s0-s31}
        .endif
        ldr     r1, [r0, #56]
        mov     lr, r1
        ldr     r1, [r0, #32]
        mov     r8, r1
        ldr     r1, [r0, #36]
        mov     r9, r1
        ldr     r1, [r0, #40]
        mov     r10, r1
        ldr     r1, [r0, #44]
        mov     r11, r1
        ldr     r1, [r0, #48]
        mov     r12, r1
        ldr     r1, [r0, #52]
        mov     sp, r1
        ldr     r1, [r0, #68]
        push    {r1}
        ldr     r1, [r0, #60]
        .if     MAINLINE
        msr     apsr_nzcvqg, r1
        .else
        msr     apsr_nzcvq, r1
        .endif
        ldmia   r0, {r0-r7}
        pop     {pc}

        .thumb_func
handler:
        ldr     r0, =record + 32
        stmia   r0!, {r4-r7}
        mov     r4, r8
        mov     r5, r9
        mov     r6, r10
        mov     r7, r11
        stmia   r0!, {r4-r7}
        mov     r1, sp
        str     r1, [r0]
        mrs     r2, ipsr
        str     r2, [r0, #4]
        .if     MAINLINE
        ldr     r3, =0xe000ed28
        ldr     r2, [r3]
        str     r2, [r3]
        .else
        movs    r2, #0
        .endif
        str     r2, [r0, #8]
        .if     FPU
        mov     r2, lr
        str     r2, [r0, #16]
        vmrs    r2, fpscr
        str     r2, [r0, #20]
        add     r3, r0, #24
        vstm    r3, {s0-s31}
        .endif
        ldr     r0, =record
        ldmia   r1!, {r4-r7}
        stmia   r0!, {r4-r7}
        ldmia   r1!, {r4-r7}
        stmia   r0!, {r4-r7}
@ The checksum of the window.
        ldr     r1, =WINDOW
        movs    r2, #128
        movs    r3, #0
        movs    r5, #13
1:      ldr     r4, [r1]
        adds    r1, #4
        rors    r3, r5
        eors    r3, r4
        subs    r2, #1
        bne     1b
        ldr     r0, =record + 76
        str     r3, [r0]
@ Back to Thread mode on the harness's own stack.
        ldr     r0, =progress
        ldr     r0, [r0, #8]
        subs    r0, #32
        mov     sp, r0
        ldr     r1, =resume
        str     r1, [r0, #24]
        ldr     r1, =0x01000000
        str     r1, [r0, #28]
        ldr     r0, =0xfffffff9
        bx      r0

        .thumb_func
resume:
        movs    r0, #5
        ldr     r1, =write_block
        bkpt    #0xab
        ldr     r0, =progress
        ldr     r4, [r0]
        ldr     r5, [r0, #4]
        adds    r4, #CASE_BYTES
        subs    r5, #1
        beq     2f
        b       next
2:      movs    r0, #0x18
        ldr     r1, =0x20026
        bkpt    #0xab
        b       .
        .pool

name:   .asciz  ":tt"
        .balign 4
open_block:
        .word   name, 4, 3

        .section .ram, "aw", %nobits
progress:
        .space  16
record:
        .space  256

        .section .ramdata, "aw"
write_block:
        .word   0, record, RECORD_BYTES
