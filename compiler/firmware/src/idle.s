@ What the cores do between ticks. Nothing here is in a hurry: a tick interrupts it anywhere.
        .syntax unified
        .thumb
        .section .text.firmware.idle, "ax"
        .global idle0
        .type   idle0, %function

@ Core 0: parameters, by mailbox or MIDI (or the monitor), and food for the watchdog as long as all cores get their ticks. An only core also sends
@ events.
idle0:  movs    r6, #0
        movs    r7, #0
1:      wfe
        bl      mailbox_step
        cmp     r0, #0
        bne     2f
        .if     MONITOR
        bl      monitor_step
        .else
        bl      midi_in_step            @ one of both a round: so much the other core's memory is visited
        .endif
2:
        .if     CORES == 1
        .if     MONITOR
        bl      monitor_events
        .else
        bl      midi_step
        .endif
        .endif
        ldr     r0, =core0
        ldr     r0, [r0, #C_TICK]
        .if     CORES > 1
        ldr     r1, =core1
        ldr     r1, [r1, #C_TICK]
        .endif
        cmp     r0, r6
        beq     1b
        .if     CORES > 1
        cmp     r1, r7
        beq     1b
        mov     r7, r1
        .endif
        mov     r6, r0
        bl      board_feed
        b       1b

        .if     CORES > 1
@ Core 1: events of both cores to the serial port (or to the monitor). It fetches from its own group of banks, as its tick does.
        .section .text.core1.firmware.idle, "ax"
        .global idle1
        .type   idle1, %function
idle1:
1:
        .if     MONITOR
        bl      monitor_events
        .else
        bl      midi_step
        .endif
        wfe
        b       1b
        .endif
