/* A small preemptive kernel: tasks on their own process stacks, switched by PendSV in the manner of the usual kernels, asked
   for by SysTick and by SVC, with the FPU's registers saved when a task has used them. Where a task is interrupted differs
   from one emulator to another; what it computes may not. */
#include "foreign.h"

#define TASKS 4
#define STACK_WORDS 160

struct task {
    uint32_t *top;
    volatile uint32_t result, done;
};

/* The last one is whoever waits for the others. */
static struct task tasks[TASKS + 1];
static uint32_t stacks[TASKS + 1][STACK_WORDS] __attribute__((aligned(8)));
struct task *volatile current;
static volatile uint32_t ticks, switches, calls;

#define ICSR REG(0xe000ed04)
#define SYST_CSR REG(0xe000e010)
#define PENDSVSET (1u << 28)

/* The next task in turn; called by PendSV. */
__attribute__((used)) static void choose(void)
{
    current = current == &tasks[TASKS] ? &tasks[0] : current + 1;
    switches++;
}

#if defined(__ARM_FP) && !defined(__SOFTFP__)
#define FP_SAVE "tst lr, #0x10\n it eq\n vstmdbeq r0!, {s16-s31}\n"
#define FP_LOAD "tst lr, #0x10\n it eq\n vldmiaeq r0!, {s16-s31}\n"
#else
#define FP_SAVE
#define FP_LOAD
#endif

__attribute__((naked)) void pendsv_handler(void)
{
#if __ARM_ARCH >= 7
    __asm__ volatile("mrs r0, psp\n" FP_SAVE
                     "stmdb r0!, {r4-r11, lr}\n"
                     "ldr r1, =current\n ldr r2, [r1]\n str r0, [r2]\n"
                     "cpsid i\n bl choose\n cpsie i\n"
                     "ldr r1, =current\n ldr r2, [r1]\n ldr r0, [r2]\n"
                     "ldmia r0!, {r4-r11, lr}\n" FP_LOAD
                     "msr psp, r0\n bx lr\n .ltorg");
#else
    __asm__ volatile("mrs r0, psp\n subs r0, #36\n"
                     "ldr r1, =current\n ldr r2, [r1]\n str r0, [r2]\n"
                     "stmia r0!, {r4-r7}\n mov r4, r8\n mov r5, r9\n mov r6, r10\n mov r7, r11\n"
                     "stmia r0!, {r4-r7}\n mov r3, lr\n str r3, [r0]\n"
                     "cpsid i\n bl choose\n cpsie i\n"
                     "ldr r1, =current\n ldr r2, [r1]\n ldr r0, [r2]\n"
                     "adds r0, #16\n ldmia r0!, {r4-r7}\n mov r8, r4\n mov r9, r5\n mov r10, r6\n mov r11, r7\n"
                     "ldr r3, [r0]\n adds r0, #4\n msr psp, r0\n subs r0, #36\n ldmia r0!, {r4-r7}\n bx r3\n .ltorg");
#endif
}

void systick_handler(void)
{
    ticks++;
    ICSR = PENDSVSET;
}

/* SVC 1 gives the processor up. */
__attribute__((used)) static void served(const uint32_t *frame)
{
    const uint8_t number = ((const uint8_t *)frame[6])[-2];
    calls += number;
    ICSR = PENDSVSET;
}

__attribute__((naked)) void svc_handler(void)
{
    __asm__ volatile("movs r0, #4\n mov r1, lr\n tst r0, r1\n beq 1f\n mrs r0, psp\n b 2f\n"
                     "1: mrs r0, msp\n"
                     "2: push {r4, lr}\n bl served\n pop {r4, pc}");
}

static void give_up(void) { __asm__ volatile("svc 1" ::: "memory"); }

static void finish(uint32_t result)
{
    current->result = result;
    current->done = 1;
    for (;;)
        give_up();
}

/* Four kinds of work: registers and multiplies, floats, memory, exclusive access. */

static void worker_words(void)
{
    uint32_t a = 1, b = 2, c = 3, d = 4, e = 5, f = 6, g = 7, h = 8;
    for (uint32_t i = 0; i < 3000; i++) {
        a += b * i, b ^= c >> 3, c += d << 2, d -= e, e += f ^ i, f = f * 5 + g, g ^= h + a, h += a ^ b;
        if (i % 500 == 0)
            give_up();
    }
    finish(a ^ b ^ c ^ d ^ e ^ f ^ g ^ h);
}

static void worker_floats(void)
{
    float x = 0.5f, y = 0.25f, z = 1.5f, sum = 0.0f;
    for (int i = 0; i < 400; i++) {
        x = x * 1.0009765625f + y * 0.125f;
        y = z / (x + 1.0f);
        z = y - x * 0.03125f + 1.75f;
        sum += x * y - z;
    }
    union {
        float value;
        uint32_t bits;
    } out = {sum};
    finish(out.bits);
}

static void worker_other_floats(void)
{
    float a[6] = {1, 2, 3, 4, 5, 6};
    for (int i = 0; i < 150; i++) {
        for (int j = 0; j < 6; j++)
            a[j] = a[j] * 0.875f + a[(j + 1) % 6] * 0.1875f - 0.0625f * (float)j;
        if (i == 70)
            give_up();
    }
    uint32_t crc = crc32(0, a, sizeof a);
    finish(crc);
}

static void worker_memory(void)
{
    uint8_t heap[96];
    uint32_t crc = 0;
    for (int round = 0; round < 6; round++) {
        for (unsigned i = 0; i < sizeof heap; i++)
            heap[i] = (uint8_t)(i * 7u + (unsigned)round);
        crc = crc32(crc, heap, sizeof heap);
    }
    finish(crc);
}

static void prepare(int index, void (*entry)(void))
{
    uint32_t *top = &stacks[index][STACK_WORDS];
    *--top = 1u << 24;                       /* xPSR: Thumb */
    *--top = (uint32_t)entry & ~1u;          /* return address */
    for (int i = 0; i < 6; i++)
        *--top = 0;                          /* LR, R12, R3..R0 */
    *--top = 0xfffffffd;                     /* EXC_RETURN: thread mode, process stack, basic frame */
    for (int i = 0; i < 8; i++)
        *--top = 0;                          /* R11..R4 */
    tasks[index].top = top;
}

/* The last task is this one: it moves to a process stack of its own and waits for the others. */
__attribute__((used)) static void wait_for_all(void)
{
    SYST_CSR = 7;
    give_up();
    for (;;) {
        uint32_t done = 0;
        for (int i = 0; i < TASKS; i++)
            done += tasks[i].done;
        if (done == TASKS)
            break;
    }
    __asm__ volatile("cpsid i");
    SYST_CSR = 0;
    for (int i = 0; i < TASKS; i++)
        say("task", tasks[i].result);
    say("preempted", ticks > 3 && switches > ticks);
    say("asked", calls > 8);
    leave(0);
}

int main(void)
{
    static void (*const workers[TASKS])(void) = {worker_words, worker_floats, worker_other_floats, worker_memory};
    for (int i = 0; i < TASKS; i++)
        prepare(i, workers[i]);
    current = &tasks[TASKS];
    REG(0xe000ed20) |= 0x00ff0000;           /* PendSV: the lowest priority */
    REG(0xe000e014) = 1999;                  /* SysTick: every 2000 cycles of the processor */
    REG(0xe000e018) = 0;
    __asm__ volatile("msr psp, %0\n movs r0, #2\n msr control, r0\n isb\n bl wait_for_all"
                     :: "r"(&stacks[TASKS][STACK_WORDS]) : "r0", "memory");
    return 1;
}
