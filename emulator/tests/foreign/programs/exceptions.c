/* Exceptions: their order, nesting, masks, escalation, faults with their causes, and what handlers see of the processor. Every
   event is a letter of a story that is printed at the end of each scene. */
#include "foreign.h"

#define ICSR REG(0xe000ed04)
#define VTOR REG(0xe000ed08)
#define AIRCR REG(0xe000ed0c)
#define CCR REG(0xe000ed14)
#define SHCSR REG(0xe000ed24)
#define CFSR REG(0xe000ed28)
#define HFSR REG(0xe000ed2c)
#define ISER REG(0xe000e100)
#define ICER REG(0xe000e180)
#define ISPR REG(0xe000e200)
#define ICPR REG(0xe000e280)
#define IABR REG(0xe000e300)
#define IPR(n) REG(0xe000e400 + 4 * (n))
#define SHPR2 REG(0xe000ed1c)
#define SHPR3 REG(0xe000ed20)
#define CPACR REG(0xe000ed88)

#define FULL (__ARM_ARCH >= 7 && __ARM_ARCH_ISA_THUMB == 2)

static char story[200];
static volatile unsigned length;

static void tell(char letter) { story[length++ % (sizeof story - 2)] = letter; }

static void end_of(const char *scene)
{
    story[length] = '\n';
    story[length + 1] = 0;
    put(scene);
    put(": ");
    put(story);
    length = 0;
}

static void settle(void) { __asm__ volatile("dsb\n isb" ::: "memory"); }
static void pend(unsigned bits) { ISPR = bits, settle(); }
static void mask(void) { __asm__ volatile("cpsid i" ::: "memory"); }
static void unmask(void) { __asm__ volatile("cpsie i\n isb" ::: "memory"); }

static uint32_t ipsr(void)
{
    uint32_t value;
    __asm__ volatile("mrs %0, ipsr" : "=r"(value));
    return value;
}

/* What interrupt n does besides telling: a script that a scene writes. */
static void (*volatile scripts[8])(void);

void irq_handler(void)
{
    const unsigned number = (ipsr() & 0x1ff) - 16;
    tell((char)('A' + number));
    if (scripts[number & 7])
        scripts[number & 7]();
    tell((char)('a' + number));
}

void nmi_handler(void) { tell('!'); }
void systick_handler(void) { tell('t'); }
void pendsv_handler(void) { tell('p'); }

/* Priorities of interrupts 0 to 3 and 4 to 7, one byte each. */
static void priorities(uint32_t low, uint32_t high) { IPR(0) = low, IPR(1) = high, settle(); }

static void no_scripts(void)
{
    for (int i = 0; i < 8; i++)
        scripts[i] = 0;
}

static void order(void)
{
    ISER = 0xff;
    priorities(0x40404040, 0x40404040);
    mask();
    pend(0x68);
    pend(0x03);
    unmask();
    end_of("equal");
    priorities(0x4080c000, 0x00c08040);
    mask();
    pend(0xff);
    unmask();
    end_of("sorted");
    mask();
    pend(0xff);
    ICPR = 0x5a;
    unmask();
    end_of("taken back");
    ICER = 0x0f;
    pend(0xff);
    end_of("half");
    ISER = 0x0f;
    settle();
    end_of("other half");
}

static void pend_1(void) { pend(2); }
static void pend_2(void) { pend(4); }
static void pend_0_2(void)
{
    scripts[2] = 0; /* else 2 and 1 would ask for each other for ever */
    pend(5);
}
static void pend_self(void)
{
    scripts[3] = 0;
    pend(8);
    tell('=');
}
static void pend_system(void)
{
    ICSR = 1u << 28 | 1u << 26;
    settle();
    tell('-');
    ICSR = 1u << 31;
    settle();
}

static void nesting(void)
{
    priorities(0xc0804000, 0xc0c0c0c0); /* 0 before 1 before 2 before 3 */
    scripts[3] = pend_2, scripts[2] = pend_1, scripts[1] = pend_0_2;
    pend(8);
    end_of("nested");
    no_scripts();
    scripts[3] = pend_self;
    pend(8);
    end_of("again");
    no_scripts();
    SHPR3 = 0x40c00000; /* SysTick above interrupt 2, PendSV below */
    scripts[2] = pend_system;
    pend(4);
    end_of("system");
    no_scripts();
}

/* Looks at the processor from inside. */
static volatile uint32_t seen[4];
static void look(void)
{
    uint32_t control, stack;
    __asm__ volatile("mrs %0, control\n mov %1, sp" : "=r"(control), "=r"(stack));
    seen[0] = ICSR & 0x1ff;
    seen[1] = IABR & 0xff;
    seen[2] = (control & 3) | (stack & 7) << 4;
    seen[3] = ICSR >> 11 & 1;
}
static void look_above(void)
{
    pend(1);
    seen[3] |= (ICSR >> 11 & 1) << 4;
}

static void inside(void)
{
    priorities(0x80808000, 0x80808080);
    scripts[0] = look, scripts[3] = look_above;
    pend(8);
    end_of("inside");
    say("vectactive", seen[0]);
    say("control", seen[2]);
#if FULL
    say("active", seen[1]);
    say("rettobase", seen[3]);
#endif
    no_scripts();
}

/* The stack is aligned to eight bytes on entry, and as it was on return, wherever it stood. */
static void alignment(void)
{
    uint32_t before, after, between;
    __asm__ volatile("mov %0, sp\n sub sp, #4\n str %4, [%3]\n dsb\n isb\n mov %2, sp\n add sp, #4\n mov %1, sp"
                     : "=&r"(before), "=&r"(after), "=&r"(between)
                     : "l"(&ISPR), "l"(1)
                     : "memory");
    say("stack", (before - after) << 8 | (before - between));
    end_of("odd stack");
}

static void sleeping(void)
{
    mask();
    pend(1);
    __asm__ volatile("wfi" ::: "memory");
    tell('w');
    unmask();
    end_of("wfi");
    __asm__ volatile("sev\n wfe" ::: "memory");
    tell('e');
    end_of("wfe");
}

/* SVC: its number and arguments, its result, and SVC from a handler. */

__attribute__((used)) static void served(uint32_t *frame)
{
    const uint8_t number = ((const uint8_t *)frame[6])[-2];
    tell((char)('0' + number));
    if (number == 3)
        frame[0] = frame[0] * frame[1] + frame[2];
}

__attribute__((naked)) void svc_handler(void)
{
    __asm__ volatile("mrs r0, msp\n push {r4, lr}\n bl served\n pop {r4, pc}");
}

static uint32_t ask(uint32_t a, uint32_t b, uint32_t c)
{
    register uint32_t r0 __asm__("r0") = a, r1 __asm__("r1") = b, r2 __asm__("r2") = c;
    __asm__ volatile("svc 3" : "+r"(r0) : "r"(r1), "r"(r2) : "memory");
    return r0;
}

static void svc_5(void) { __asm__ volatile("svc 5" ::: "memory"); }

static void calls(void)
{
    SHPR2 = 0x40000000;
    priorities(0x80808080, 0x80808080);
    say("svc", ask(6, 7, 100));
    scripts[4] = svc_5;
    pend(16);
    end_of("svc");
    no_scripts();
}

/* Faults: each is told with its causes, and the instruction that faulted is stepped over. */

static volatile uint32_t resume;

__attribute__((used)) static void faulted(uint32_t *frame)
{
    tell((char)('0' + ipsr()));
#if FULL
    uint32_t causes = CFSR, hard = HFSR;
    for (int bit = 0; bit < 26; bit++)
        if (causes >> bit & 1)
            tell((char)('a' + bit));
    if (hard >> 30 & 1)
        tell('^');
    CFSR = causes;
    HFSR = hard;
#endif
    frame[6] = resume;
    frame[7] = (frame[7] & ~0x0600fc00u) | 1u << 24;
}

#define FAULT __attribute__((naked))
#define FAULT_BODY __asm__ volatile("mrs r0, msp\n push {r4, lr}\n bl faulted\n pop {r4, pc}")
FAULT void hard_fault_handler(void) { FAULT_BODY; }
FAULT void mem_manage_handler(void) { FAULT_BODY; }
FAULT void bus_fault_handler(void) { FAULT_BODY; }
FAULT void usage_fault_handler(void) { FAULT_BODY; }

/* Runs text that faults, and goes on behind it; R4 points to bytes. */
static uint8_t bytes[16] __attribute__((aligned(8)));
#define ATTEMPT(text)                                                                                                        \
    __asm__ volatile("ldr r5, =1f\n str r5, [%0]\n mov r4, %1\n" text "\n 1: nop\n b 2f\n .ltorg\n .balign 4\n 2:"            \
                     :: "l"(&resume), "r"(bytes)                                                                             \
                     : "r2", "r3", "r4", "r5", "cc", "memory")

static void undefined_inside(void) { ATTEMPT("udf #7"); }

static void faults(const char *scene)
{
    ATTEMPT("udf #1");
    ATTEMPT("movs r3, #1\n adds r4, #1\n ldr r2, [r4]"); /* not aligned: a fault on ARMv6-M or when trapped */
    tell(' ');
#if FULL
    ATTEMPT("adds r4, #2\n ldm r4, {r2, r3}");
    ATTEMPT("movs r3, #0\n udiv r2, r4, r3");
    ATTEMPT("adds r4, #2\n ldrd r2, r3, [r4]");
#endif
    ATTEMPT("mov r3, r4\n bx r3"); /* no Thumb bit */
    scripts[4] = undefined_inside;
    pend(16);
    no_scripts();
    end_of(scene);
}

#if FULL
static void thresholds(void)
{
    priorities(0xc0804000, 0xc0c0c0c0);
    const uint32_t level = 0x80;
    __asm__ volatile("msr basepri, %0\n isb" :: "r"(level));
    pend(0x0f);
    tell('|');
    __asm__ volatile("msr basepri_max, %0\n isb" :: "r"(0xc0));
    tell('|');
    __asm__ volatile("msr basepri, %0\n isb" :: "r"(0xc0));
    tell('|');
    __asm__ volatile("msr basepri, %0\n isb" :: "r"(0));
    end_of("basepri");
    __asm__ volatile("cpsid f" ::: "memory");
    pend(1);
    tell('|');
    __asm__ volatile("cpsie f\n isb" ::: "memory");
    end_of("faultmask");
    AIRCR = 0x05fa0000 | 6 << 8; /* one bit of preemption, the rest only sorts */
    priorities(0x00406000, 0xc0c0c0c0);
    scripts[1] = pend_0_2;
    pend(2);
    end_of("grouped");
    no_scripts();
    AIRCR = 0x05fa0000;
}
#endif

#if __ARM_ARCH >= 7 || defined(__ARM_ARCH_6M__)
/* Another table of vectors, in RAM. */
static void (*table[48])(void) __attribute__((aligned(256)));
static void other_handler(void) { tell('*'); }

static void moved(void)
{
    void (*const *old)(void) = (void (*const *)(void))VTOR;
    for (int i = 0; i < 48; i++)
        table[i] = old[i];
    table[16 + 5] = other_handler;
#if FULL
    VTOR = (uint32_t)table;
    settle();
    pend(1 << 5 | 1 << 6);
    VTOR = (uint32_t)old;
    settle();
#endif
    pend(1 << 5);
    end_of("vectors");
}
#endif

int main(void)
{
    order();
    nesting();
    inside();
    alignment();
    sleeping();
    calls();
    faults("hard");
    moved();
#if FULL
    thresholds();
    SHCSR = 7 << 16;
    faults("faults");
    CCR |= 3 << 3; /* trap division by zero and what is not aligned */
    settle();
    faults("trapped");
    CCR &= ~(3u << 3);
#if defined(__ARM_FP) && !defined(__SOFTFP__)
    CPACR = 0;
    settle();
    ATTEMPT("vmov.f32 s0, #1.0");
    CPACR = 0xf << 20;
    settle();
    end_of("no coprocessor");
#endif
#endif
    return 0;
}
