@ Where execution goes: branches, exceptions, priorities, faults, lazy saving of floating-point registers. Everything of
@ interest is written to a log (R11), which goes to the host's console at the end.

        .syntax unified
        .thumb
        .text
vectors:
        .word   STACK_TOP, reset + 1, h_nmi + 1, h_fault + 1, h_fault + 1, h_fault + 1, h_fault + 1, 0
        .word   0, 0, 0, h_svc + 1, 0, 0, h_pendsv + 1, h_systick + 1
        .rept   8
        .word   h_irq + 1
        .endr

        .macro  log register
        str     \register, [r11]
        add     r11, r11, #4
        .endm
        .macro  flags
        mrs     r12, apsr
        log     r12
        .endm
        .macro  put address, value
        ldr     r0, =\address
        ldr     r1, =\value
        str     r1, [r0]
        dsb
        isb
        .endm

        .macro  context
        ldr     r0, =0xe000ef34
        ldr     r1, [r0]
        ldr     r2, =FPCCR_STATUS
        ands    r1, r2
        log     r1
        .endm

        .thumb_func
reset:
        ldr     r11, =journal
        put     0xe000ed24, 0x00070000

@ Every condition with every combination of flags, as a branch and in an IT block.
        movs    r7, #0
1:      lsls    r6, r7, #28
        movs    r5, #0
        .irp    cond, eq, ne, cs, cc, mi, pl, vs, vc, hi, ls, ge, lt, gt, le
        lsls    r5, r5, #1
        msr     apsr_nzcvq, r6
        b\cond  2f
        b       3f
2:      add     r5, r5, #1
3:      lsls    r5, r5, #1
        msr     apsr_nzcvq, r6
        it      \cond
        addw\cond r5, r5, #1
        .endr
        log     r5
        adds    r7, r7, #1
        cmp     r7, #16
        bne     1b
        b       calls
        .ltorg

@ Calls and jumps.
leaf:   log     lr
        bx      lr
calls:  bl      leaf
        adr     r0, leaf
        orr     r0, r0, #1
        blx     r0
        movs    r0, #0
        cbz     r0, 1f
        log     r0
1:      movs    r0, #3
        cbnz    r0, 2f
        log     r0
2:      log     r0
        movs    r1, #2
        tbb     [pc, r1]
3:      .byte   (4f - 3b) / 2, (5f - 3b) / 2, (6f - 3b) / 2, 0
4:      log     r1
5:      log     r1
6:      movs    r1, #1
        tbh     [pc, r1, lsl #1]
7:      .short  (8f - 7b) / 2, (9f - 7b) / 2
8:      log     r1
9:      adr     r2, 10f
        orr     r2, r2, #1
        push    {r0, r2}
        pop     {r3, pc}
        log     r3
        .balign 4
10:     log     r3
        adr     r2, 11f
        orr     r2, r2, #1
        push    {r2}
        ldr     pc, [sp], #4
        log     r2
        .balign 4
11:     adr     r2, 12f
        orr     r2, r2, #1
        push    {r2}
        mov     r4, sp
        ldm     r4!, {pc}
        log     r2
        .balign 4
12:     add     sp, sp, #4
        log     r4
        adr     r2, 13f
        mov     pc, r2
        log     r2
        .balign 4
13:
@ IT blocks of four, some of which change the flags they depend on.
        movs    r0, #0
        cmp     r0, #0
        ittee   eq
        addeq   r0, #1
        addeq   r0, #2
        addne   r0, #4
        addne   r0, #8
        log     r0
        movs    r0, #5
        cmp     r0, #7
        itete   lt
        cmplt   r0, #1
        addge   r0, #16
        addlt   r0, #32
        addge   r0, #64
        log     r0
        flags

@ Special registers.
        .irp    value, 0x00, 0xf0, 0x70, 0x20
        ldr     r0, =\value
        msr     basepri, r0
        mrs     r1, basepri
        log     r1
        movs    r0, #0x40
        msr     basepri_max, r0
        mrs     r1, basepri
        log     r1
        .endr
        movs    r0, #0
        msr     basepri, r0
        cpsid   i
        mrs     r1, primask
        log     r1
        cpsid   f
        mrs     r1, faultmask
        log     r1
        cpsie   if
        mrs     r1, faultmask
        log     r1
        ldr     r0, =0x1234567b
        msr     psp, r0
        mrs     r1, psp
        log     r1
        mrs     r1, xpsr
        log     r1
        mrs     r1, control
        log     r1

@ Calls of the supervisor, on both stacks.
        svc     #1
        ldr     r0, =process_stack
        msr     psp, r0
        movs    r0, #2
        msr     control, r0
        isb
        sub     sp, sp, #4
        svc     #2
        flags
        mov     r1, sp
        log     r1
        movs    r0, #0
        msr     control, r0
        isb

@ Interrupts by priority: 0 to 5 at 0x80, 0x40, 0x40, 0xc0, 0x20, 0x80.
        put     0xe000e400, 0xc0404080
        put     0xe000e404, 0x00008020
        put     0xe000e100, 0x3f
        cpsid   i
        put     0xe000e200, 0x3f
        ldr     r0, =0xe000ed04
        ldr     r1, [r0]
        ldr     r2, =0x041ff800         @ QEMU leaves out RETTOBASE's neighbours
        ands    r1, r2
        log     r1
        cpsie   i
        isb
        log     r11
        movs    r0, #0x80
        msr     basepri, r0
        put     0xe000e200, 0x3f
        log     r11
        movs    r0, #0
        msr     basepri, r0
        isb
        log     r11
@ With a group of two bits, 0x20 and 0x40 do not preempt each other but 0x80 and 0x40 do.
        put     0xe000ed0c, 0x05fa0600
        put     0xe000e200, 0x3f
        put     0xe000ed0c, 0x05fa0000
@ PendSV at the lowest priority, pended by a handler; NMI above all.
        put     0xe000ed20, 0x00f00000
        put     0xe000ed04, 0x10000000
        log     r11
        put     0xe000ed04, 0x80000000
        b       float
        .ltorg

float:
        put     0xe000ed88, 0x00f00000
        mrs     r1, control
        log     r1
        vmov.f32 s0, #1.5
        vmov.f32 s15, #2.5
        vmov.f32 s16, #3.5
        mrs     r1, control
        log     r1
        ldr     r0, =0xe000ef34
        ldr     r1, [r0]
        ubfx    r1, r1, #30, #2
        log     r1
        movs    r9, #1
        put     0xe000e200, 0x8
        movs    r9, #2
        put     0xe000e200, 0x8
        movs    r9, #0
        vmov    r1, s0
        log     r1
        vmov    r1, s15
        log     r1
        vmov    r1, s16
        log     r1
        vmrs    r1, fpscr
        log     r1
        mrs     r1, control
        log     r1
@ Whose context it is: with all faults ready, none enabled, behind a mask, in a handler, unprivileged.
        movs    r9, #3
        put     0xe000e200, 0x8
        put     0xe000ed24, 0
        vmov    r1, s0
        put     0xe000e200, 0x8
        put     0xe000ed24, 0x00070000
        put     0xe000ed18, 0x00408020
        movs    r0, #0x60
        msr     basepri, r0
        vmov    r1, s0
        put     0xe000e200, 0x10
        movs    r0, #0
        msr     basepri, r0
        put     0xe000ed18, 0x00808080
        vmov    r1, s0
        put     0xe000e200, 0x1
        put     0xe000ed18, 0
        vmov    r1, s0
        movs    r0, #1
        msr     control, r0
        isb
        vmov    r1, s0
        svc     #4
        movs    r9, #0
@ The same with floating-point registers saved at once.
        ldr     r0, =0xe000ef34
        ldr     r1, [r0]
        bic     r1, r1, #0x40000000
        str     r1, [r0]
        dsb
        isb
        movs    r9, #2
        put     0xe000e200, 0x8
        movs    r9, #0
        vmov    r1, s0
        log     r1
        vmov    r1, s15
        log     r1
        mrs     r1, control
        bic     r1, r1, #12
        msr     control, r1
        isb
        b       faults
        .ltorg

@ Faults, each with its handler, then with HardFault only. The handler goes on at R8.
        .macro  faulty text:vararg
        adr.w   r8, 99f
        \text
        log     r8
        .balign 4
99:
        .endm
faults:
        put     0xe000ed14, 0x210
        ldr     r4, =0x60000000
        ldr     r5, =journal + 0xf01
        movs    r6, #0
        .balign 4
1:      faulty  .short 0xde01
        faulty  .short  0xf7f0, 0xa001
        faulty  sdiv    r0, r0, r6
        faulty  ldm     r5, {r0, r1}
        faulty  ldrd    r0, r1, [r5]
        faulty  ldrex   r0, [r5]
        faulty  ldr     r0, [r4]
        faulty  str     r0, [r4]
        adr     r3, 1b
        faulty  bx      r3
        faulty  mcr     p4, #0, r0, c0, c0, #0
        ldr     r0, =0xe000ed24
        ldr     r1, [r0]
        log     r1
        cbz     r1, 2f
        movs    r1, #0
        str     r1, [r0]
        dsb
        isb
        b.w     1b
2:      cpsid   i
        adr.w   r8, 3f
        svc     #3
        .balign 4
3:      cpsie   i

@ Sleeping: SysTick ends a WFI, with interrupts masked too; SEV ends a WFE.
        put     0xe000e014, 50000
        put     0xe000e018, 0
        cpsid   i
        put     0xe000e010, 7
        wfi
        log     r11
        cpsie   i
        isb
        put     0xe000e010, 0
        sev
        wfe
        log     r11

        ldr     r1, =open_block
        movs    r0, #1
        bkpt    #0xab
        ldr     r1, =write_block
        str     r0, [r1]
        ldr     r2, =journal
        subs    r2, r11, r2
        str     r2, [r1, #8]
        movs    r0, #5
        bkpt    #0xab
        movs    r0, #0x18
        ldr     r1, =0x20026
        bkpt    #0xab
        b       .

h_svc:  cmp     r9, #3
        bne     1f
        context
        mrs     r0, control
        bic     r0, r0, #1
        msr     control, r0
        isb
        bx      lr
1:      mrs     r0, ipsr
        log     r0
        log     lr
        mov     r0, sp
        log     r0
        mrs     r0, psp
        log     r0
        tst     lr, #4
        ite     eq
        mrseq   r0, msp
        mrsne   r0, psp
        ldr     r1, [r0, #24]
        log     r1
        ldrb    r1, [r1, #-2]
        log     r1
        ldr     r1, [r0, #28]
        log     r1
        mrs     r0, control
        log     r0
        bx      lr

@ Logs its number; interrupt 0 pends 2 (which preempts it), 1 pends PendSV. In R9: 1 uses no floating point, 2 does;
@ with 3 they log whose context is to be saved, and interrupt 0 makes one of its own before it pends 2.
h_irq:  mrs     r0, ipsr
        log     r0
        log     lr
        cmp     r9, #3
        beq     3f
        cmp     r9, #0
        bne     2f
        mov     r0, r0
        cmp     r0, #16
        bne     1f
        ldr     r1, =0xe000e200
        movs    r2, #4
        str     r2, [r1]
        dsb
        isb
        log     r0
        bx      lr
1:      cmp     r0, #17
        bne     1f
        ldr     r1, =0xe000ed04
        mov     r2, #0x10000000
        str     r2, [r1]
        dsb
        isb
        log     r0
1:      bx      lr
2:      ldr     r0, =0xe000ef34
        ldr     r1, [r0]
        and     r1, r1, #1
        log     r1
        ldr     r1, [r0, #4]
        log     r1
        mrs     r1, control
        log     r1
        mov     r1, sp
        log     r1
        cmp     r9, #2
        bne     1b
        vmov.f32 s0, #-1.0
        vmov.f32 s15, #-2.0
        ldr     r1, =0x03000010
        vmsr    fpscr, r1
        ldr     r1, [r0]
        and     r1, r1, #1
        log     r1
        mrs     r1, control
        log     r1
        ldr     r1, [sp, #32]
        log     r1
        bx      lr
3:      context
        mrs     r0, ipsr
        cmp     r0, #16
        bne     1f
        vmov.f32 s0, #-1.0
        put     0xe000e200, 0x4
        context
1:      bx      lr

h_systick:
        ldr     r0, =0xe000e010
        movs    r1, #0
        str     r1, [r0]
        ldr     r0, =0xe000ed04
        mov     r1, #0x02000000
        str     r1, [r0]
h_pendsv:
h_nmi:
        mrs     r0, ipsr
        log     r0
        log     lr
        bx      lr

h_fault:
        mrs     r0, ipsr
        log     r0
        ldr     r0, =0xe000ed28
        ldr     r1, [r0]
        log     r1
        str     r1, [r0]
        lsls    r1, r1, #16
        bpl     1f
        ldr     r1, [r0, #16]
        log     r1
1:      ldr     r1, [r0, #4]
        log     r1
        str     r1, [r0, #4]
        ldr     r1, [sp, #24]
        log     r1
        ldr     r1, [sp, #28]
        log     r1
        str     r8, [sp, #24]
        orr     r1, r1, #0x01000000
        str     r1, [sp, #28]
        bx      lr
        .ltorg

name:   .asciz  ":tt"
        .balign 4
open_block:
        .word   name, 4, 3

        .section .ram, "aw", %nobits
        .space  256
process_stack:
journal:
        .space  8192

        .section .ramdata, "aw"
write_block:
        .word   0, journal, 0
