@ What the cores do between ticks. Nothing here is in a hurry: a tick interrupts it anywhere.
        .syntax unified
        .thumb
        .section .text.firmware.idle, "ax"
        .global idle0
        .type   idle0, %function

@ Core 0: parameters, and food for the watchdog as long as both cores get their ticks.
idle0:  movs    r6, #0
        movs    r7, #0
1:      wfe
        bl      mailbox_step
        ldr     r0, =core0
        ldr     r1, =core1
        ldr     r0, [r0, #C_TICK]
        ldr     r1, [r1, #C_TICK]
        cmp     r0, r6
        beq     1b
        cmp     r1, r7
        beq     1b
        mov     r6, r0
        mov     r7, r1
        bl      board_feed
        b       1b

@ Core 1: events of both cores to the serial port. It fetches from its own group of banks, as its tick does.
        .section .text.core1.firmware.idle, "ax"
        .global idle1
        .type   idle1, %function
idle1:  bl      midi_step
        wfe
        b       idle1
