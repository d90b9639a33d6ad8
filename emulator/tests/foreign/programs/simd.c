/* The DSP extension, instruction by instruction, with random and extreme operands: results, the saturation flag, and the GE flags
   through SEL. */
#include "foreign.h"
#include <arm_acle.h>

static const uint32_t extreme[] = {0, 1, 0x7fff8000, 0x80007fff, 0x80008000, 0x7f80807f, 0xffffffff, 0x7fffffff, 0x80000000};
#define EXTREMES (sizeof extreme / sizeof *extreme)

static uint32_t operand(void)
{
    const uint32_t kind = random_word();
    return kind & 7 ? random_word() : extreme[kind / 8 % EXTREMES];
}

static uint32_t crc;
static void add(uint32_t value) { crc = crc32(crc, &value, sizeof value); }

static uint32_t flags(void)
{
    uint32_t value;
    __asm__ volatile("mrs %0, apsr\n msr apsr_nzcvq, %1" : "=r"(value) : "r"(0));
    return value & 0xf80f0000;
}

#define TWO(name, op)                                                                                                         \
    static uint32_t name(uint32_t a, uint32_t b, uint32_t c)                                                                  \
    {                                                                                                                         \
        uint32_t r;                                                                                                           \
        (void)c;                                                                                                              \
        __asm__ volatile(op " %0, %1, %2" : "=r"(r) : "r"(a), "r"(b) : "cc");                                                  \
        return r;                                                                                                             \
    }
#define SELECTING(name, op)                                                                                                   \
    static uint32_t name(uint32_t a, uint32_t b, uint32_t c)                                                                  \
    {                                                                                                                         \
        uint32_t r, s;                                                                                                        \
        __asm__ volatile(op " %0, %2, %3\n sel %1, %0, %4" : "=&r"(r), "=r"(s) : "r"(a), "r"(b), "r"(c) : "cc");               \
        return r ^ s * 3;                                                                                                     \
    }
#define THREE(name, op)                                                                                                       \
    static uint32_t name(uint32_t a, uint32_t b, uint32_t c)                                                                  \
    {                                                                                                                         \
        uint32_t r;                                                                                                           \
        __asm__ volatile(op " %0, %1, %2, %3" : "=r"(r) : "r"(a), "r"(b), "r"(c) : "cc");                                      \
        return r;                                                                                                             \
    }
#define LONG(name, op)                                                                                                        \
    static uint32_t name(uint32_t a, uint32_t b, uint32_t c)                                                                  \
    {                                                                                                                         \
        uint32_t low = c, high = ~a;                                                                                          \
        __asm__ volatile(op " %0, %1, %2, %3" : "+r"(low), "+r"(high) : "r"(a), "r"(b) : "cc");                                \
        return low ^ high * 5;                                                                                                \
    }
#define ONE(name, text)                                                                                                       \
    static uint32_t name(uint32_t a, uint32_t b, uint32_t c)                                                                  \
    {                                                                                                                         \
        uint32_t r = c;                                                                                                       \
        __asm__ volatile(text : "+r"(r) : "r"(a), "r"(b) : "cc");                                                             \
        return r;                                                                                                             \
    }

SELECTING(sadd8, "sadd8") SELECTING(usub8, "usub8") SELECTING(sadd16, "sadd16") SELECTING(usub16, "usub16")
SELECTING(uadd8, "uadd8") SELECTING(sasx, "sasx") SELECTING(usax, "usax") SELECTING(ssub16, "ssub16")
TWO(qadd, "qadd") TWO(qsub, "qsub") TWO(qdadd, "qdadd") TWO(qdsub, "qdsub") TWO(qadd8, "qadd8") TWO(qsub16, "qsub16")
TWO(uqadd16, "uqadd16") TWO(uqsub8, "uqsub8") TWO(shadd8, "shadd8") TWO(uhsub16, "uhsub16") TWO(qasx, "qasx") TWO(shsax, "shsax")
TWO(usad8, "usad8") TWO(smulbb, "smulbb") TWO(smultb, "smultb") TWO(smulwt, "smulwt") TWO(smuad, "smuad") TWO(smusdx, "smusdx")
TWO(smmul, "smmul") TWO(smmulr, "smmulr")
THREE(usada8, "usada8") THREE(smlad, "smlad") THREE(smladx, "smladx") THREE(smlsd, "smlsd") THREE(smlabt, "smlabt")
THREE(smlawb, "smlawb") THREE(smmla, "smmla") THREE(smmlsr, "smmlsr") THREE(mla, "mla") THREE(mls, "mls")
LONG(smlal, "smlal") LONG(umlal, "umlal") LONG(umaal, "umaal") LONG(smlalbb, "smlalbb") LONG(smlald, "smlald") LONG(smlsldx, "smlsldx")
LONG(smull, "smull") LONG(umull, "umull")
ONE(ssat, "ssat %0, #13, %1, asr #3") ONE(usat, "usat %0, #11, %2, lsl #2") ONE(ssat16, "ssat16 %0, #9, %1")
ONE(usat16, "usat16 %0, #7, %2") ONE(sxtab, "sxtab %0, %1, %2, ror #8") ONE(uxtab16, "uxtab16 %0, %1, %2, ror #16")
ONE(sxtb16, "sxtb16 %0, %1, ror #24") ONE(pkhbt, "pkhbt %0, %1, %2, lsl #7") ONE(pkhtb, "pkhtb %0, %1, %2, asr #9")
ONE(bfi, "bfi %0, %1, #5, #11") ONE(bfc, "bfc %0, #9, #14") ONE(sbfx, "sbfx %0, %1, #6, #17") ONE(ubfx, "ubfx %0, %2, #31, #1")
ONE(rbit, "rbit %0, %1") ONE(rev16, "rev16 %0, %2") ONE(revsh, "revsh %0, %1") ONE(clz, "clz %0, %2")
ONE(sdiv, "sdiv %0, %1, %2") ONE(udiv, "udiv %0, %1, %2") ONE(rrx, "adds %0, %1, %2\n rrxs %0, %0")
ONE(orn, "orns %0, %1, %2, ror #5") ONE(teq, "teq %1, %2, lsl #31\n it mi\n addmi %0, #99")

typedef uint32_t (*operation)(uint32_t, uint32_t, uint32_t);

static const operation operations[] = {
    sadd8, usub8, sadd16, usub16, uadd8, sasx, usax, ssub16, qadd, qsub, qdadd, qdsub, qadd8, qsub16, uqadd16, uqsub8,
    shadd8, uhsub16, qasx, shsax, usad8, smulbb, smultb, smulwt, smuad, smusdx, smmul, smmulr, usada8, smlad, smladx,
    smlsd, smlabt, smlawb, smmla, smmlsr, mla, mls, smlal, umlal, umaal, smlalbb, smlald, smlsldx, smull, umull, ssat,
    usat, ssat16, usat16, sxtab, uxtab16, sxtb16, pkhbt, pkhtb, bfi, bfc, sbfx, ubfx, rbit, rev16, revsh, clz, sdiv,
    udiv, rrx, orn, teq,
};

int main(void)
{
    char name[] = "operation ..";
    for (unsigned i = 0; i < sizeof operations / sizeof *operations; i++) {
        crc = 0;
        for (int round = 0; round < 60; round++) {
            const uint32_t a = operand(), b = operand(), c = operand();
            flags();
            const uint32_t result = operations[i](a, b, c);
            add(flags() & 0x080f0000);
            add(result);
        }
        name[10] = (char)('0' + i / 10), name[11] = (char)('0' + i % 10);
        say(name, crc);
    }
    return 0;
}
