// Times the Faust grand on words from a file, as `kernel_main.c` times the kernel: `PROGRAM words.bin`.
// Each key is an instance that computes STRETCH samples at a time; a keyboard would have to ask for one at a time.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <vector>

#ifndef FAUSTFLOAT
#define FAUSTFLOAT float
#endif

struct Meta { void declare(const char *, const char *) {} };
struct UI {
    void openVerticalBox(const char *) {}
    void closeBox() {}
    void addHorizontalSlider(const char *, FAUSTFLOAT *, FAUSTFLOAT, FAUSTFLOAT, FAUSTFLOAT, FAUSTFLOAT) {}
};
struct dsp {};

<<includeIntrinsic>>
<<includeclass>>

static const int ROUNDS = 20, STRETCH = 256;
// As in kernel_main.c: what happens before need not agree.
static const int SETTLED = 22016;

int main(int argc, char **argv)
{
    FILE *file = argc > 1 ? std::fopen(argv[1], "rb") : nullptr;
    if (!file) { std::fprintf(stderr, "wanted: a file of words\n"); return 2; }
    std::vector<uint16_t> words;
    for (uint16_t row[KEYS]; std::fread(row, sizeof row, 1, file) == 1;) words.insert(words.end(), row, row + KEYS);
    const size_t rows = words.size() / KEYS;
    std::vector<std::vector<FAUSTFLOAT>> in(KEYS);
    for (int key = 0; key < KEYS; key++)
        for (size_t row = 0; row < rows; row++) in[key].push_back(FAUSTFLOAT(words[row * KEYS + key]));
    const size_t stretches = (rows + STRETCH - 1) / STRETCH;
    std::vector<double> best(stretches, 1e9);
    std::vector<FAUSTFLOAT> force(STRETCH), strike(size_t(STRETCH) * KEYS);
    std::vector<mydsp> keys(KEYS);
    size_t strikes = 0;
    double fastest = 0, sum = 0;
    for (int round = 0; round < ROUNDS; round++) {
        for (auto &key : keys) key.init(44100);
        strikes = 0;
        fastest = sum = 0;
        for (size_t at = 0; at < stretches; at++) {
            const int count = int(std::min(rows - at * STRETCH, size_t(STRETCH)));
            const auto start = std::chrono::steady_clock::now();
            for (int key = 0; key < KEYS; key++) {
                FAUSTFLOAT *inputs[] = { &in[key][at * STRETCH] };
                FAUSTFLOAT *outputs[] = { force.data(), &strike[size_t(key) * STRETCH] };
                keys[key].compute(count, inputs, outputs);
            }
            const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
            best[at] = std::min(best[at], spent.count());
            for (int key = 0; key < KEYS; key++)
                for (int i = 0; i < count; i++) {
                    const double speed = strike[size_t(key) * STRETCH + i];
                    if (speed != 0 && at * STRETCH >= SETTLED) { strikes++; sum += speed; fastest = std::max(fastest, speed); }
                }
        }
    }
    double total = 0;
    for (double one : best) total += one;
    std::printf("%.3f ns per key tick, %zu strikes, mean speed %.4f m/s, fastest %.4f m/s\n",
                1e9 * total / double(rows * KEYS), strikes, strikes ? sum / double(strikes) : 0, fastest);
    return 0;
}
