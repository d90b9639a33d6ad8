@ A board without a sound output: samples leave nowhere.
        .syntax unified
        .thumb
        .section .text.frame, "ax"
        .if     SOUND
        .global board_sound
        .type   board_sound, %function
board_sound:
        bx      lr
        .endif
