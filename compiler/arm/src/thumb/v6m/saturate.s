@ Sums that saturate. Operands in R0 and R1, the result in R0; R1 and the flags are not kept.
        .syntax unified
        .thumb
        .text

@ A sum, or the word nearest to it: where it overflowed, its sign is the other one.
        .type   add_sat, %function
add_sat:
        adds    r0, r0, r1
        bvc     1f
        asrs    r0, r0, #31
        movs    r1, #1
        lsls    r1, r1, #31
        eors    r0, r1
1:      bx      lr

@ A difference alike.
        .type   sub_sat, %function
sub_sat:
        subs    r0, r0, r1
        bvc     1f
        asrs    r0, r0, #31
        movs    r1, #1
        lsls    r1, r1, #31
        eors    r0, r1
1:      bx      lr
