// Times the Faust strings: nanoseconds of a tick of all four, the fastest of 40 rounds of 10 000 ticks.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <vector>

#ifndef FAUSTFLOAT
#define FAUSTFLOAT float
#endif

struct Meta { void declare(const char *, const char *) {} };
struct UI {
    void openVerticalBox(const char *) {}
    void closeBox() {}
};
struct dsp {};

<<includeIntrinsic>>
<<includeclass>>

int main()
{
    const int ROUNDS = 40, TICKS = 10000;
    auto strings = std::make_unique<mydsp>();
    strings->init(44100);
    std::vector<FAUSTFLOAT> in(TICKS), out(TICKS);
    in[0] = FAUSTFLOAT(1e-4);
    double fastest = 1e9, peak = 0;
    for (int round = 0; round < ROUNDS; round++) {
        FAUSTFLOAT *inputs[] = { in.data() }, *outputs[] = { out.data() };
        const auto start = std::chrono::steady_clock::now();
        strings->compute(TICKS, inputs, outputs);
        const std::chrono::duration<double, std::nano> spent = std::chrono::steady_clock::now() - start;
        fastest = std::min(fastest, spent.count() / TICKS);
        peak = 0;
        for (auto &u : out) peak = std::max(peak, std::fabs(double(u)));
        in[0] = 0;
    }
    std::printf("%.1f ns, at most %g m in the last round\n", fastest, peak);
}
