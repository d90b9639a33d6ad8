// The strings of `strings.kernel` in floating point: the same scheme, the same coefficients.
// Prints the nanoseconds of a tick of all four for each type, the fastest of 40 rounds; -O3 -march=native.
#include <chrono>
#include <cstdio>
#include <vector>

template <typename T> struct String {
    int n;
    T k0, k1, k2, k3;
    std::vector<T> u, v, w; // with two ends each

    String(int n, double k0, double k1, double k2, double k3)
        : n(n), k0(k0 / 2147483648.0), k1(k1 / 2147483648.0), k2(k2 / 4294967296.0), k3(k3 / 4294967296.0),
          u(n + 2), v(n + 2), w(n + 2)
    {
        for (int l = 1; l <= n; l++) u[l] = 1e-4 * (5 * l <= n ? 5.0 * l / n : 1.25 * (n + 1 - l) / (n + 1));
    }

    void tick(std::vector<T> &next)
    {
        T *__restrict pu = u.data(), *__restrict pv = v.data(), *__restrict pw = w.data(), *__restrict pn = next.data();
        for (int l = 1; l <= n; l++) pw[l] = pu[l + 1] - 2 * pu[l] + pu[l - 1];
        for (int l = 1; l <= n; l++)
            pn[l] = pv[l] + k0 * pw[l] + k1 * (pw[l - 1] + pw[l + 1]) + k2 * (pv[l - 1] + pv[l + 1]) + k3 * pv[l];
        for (int l = 1; l <= n; l++) { pv[l] = pn[l]; pu[l] += pn[l]; }
    }
};

template <typename T> void time(const char *name)
{
    String<T> strings[] = {
        {31, 1985264354, -9799047, 9738934, -19672647},
        {44, 1880351461, -74404371, 19259122, -38713024},
        {61, 1723542979, -129689033, 36559045, -73312870},
        {80, 1511870758, -199333302, 62399556, -124993893},
    };
    std::vector<T> next(82);
    double best = 1e9;
    for (int round = 0; round < 40; round++) {
        auto start = std::chrono::steady_clock::now();
        for (int tick = 0; tick < 10000; tick++)
            for (auto &string : strings) string.tick(next);
        std::chrono::duration<double, std::nano> spent = std::chrono::steady_clock::now() - start;
        best = spent.count() / 10000 < best ? spent.count() / 10000 : best;
    }
    std::printf("%s %.1f ns, u %g\n", name, best, (double)strings[3].u[20]);
}

int main()
{
    time<float>("f32");
    time<double>("f64");
}
