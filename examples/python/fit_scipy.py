"""Finds the stiffness and the preload of a key from a force that was measured, with scipy.

    pip install whippen scipy
    python examples/python/fit_scipy.py
"""

import pathlib

import numpy
from scipy.optimize import least_squares

import whippen

INSTRUMENTS = pathlib.Path(__file__).parents[2] / "instruments"
TRUE = {"k": 90.0, "preload": 0.8}  # N/m and N


def fit():
    key = whippen.load(INSTRUMENTS / "hammond.whip")
    stroke_m = 0.008 * numpy.sin(numpy.linspace(0, numpy.pi, 4410)) ** 2

    def force_n(k, preload):
        trace = key.run(stroke_m, set={"k": k, "preload": preload}, engine="ideal", columns=["force"])
        return trace["force_n"]

    noise_n = numpy.random.default_rng(1).normal(0.0, 0.02, stroke_m.size)
    measured_n = force_n(**TRUE) + noise_n
    found = least_squares(
        lambda x: force_n(*x) - measured_n,
        x0=[60.0, 0.3],
        bounds=([50.0, 0.1], [150.0, 1.0]),
        x_scale=[100.0, 1.0],
        diff_step=1e-4,
    )
    return dict(zip(TRUE, found.x))


if __name__ == "__main__":
    found = fit()
    print(f"k {found['k']:.2f} N/m, preload {found['preload']:.3f} N")
