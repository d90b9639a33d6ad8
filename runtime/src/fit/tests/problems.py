"""Solves the problems of `tests.rs` with scipy's `least_squares`: prints `scipy.txt`.

python3 problems.py > scipy.txt        (scipy 1.17.1)
"""
import numpy as np
from scipy.optimize import differential_evolution, least_squares
from scipy.stats import t as student

ROWS = 60


def noise():
    """White, -1 .. 1: the upper bits of a congruential generator."""
    word, out = 1, []
    for _ in range(ROWS):
        word = (word * 6364136223846793005 + 1442695040888963407) % 2**64
        out.append((word >> 33) / 2**30 - 1)
    return np.array(out)


TIMES = np.arange(ROWS) / 12


def decay(x):
    return x[0] * np.exp(-x[1] * TIMES) + x[2]


def sine(x):
    return x[0] * np.sin(x[1] * TIMES + x[2])


DECAY = decay([2.5, 1.3, 0.5]) + 0.1 * noise()
OUTLIERS = DECAY + np.where(np.arange(ROWS) % 11 == 5, 2.0, 0.0)
SINE = sine([1.4, 12.3, 0.4]) + 0.2 * noise()

WIDE = ([0, 0.1, -1], [5, 3, 1])
NARROW = ([0, 0.1, -1], [5, 3, 0.2])
WAVE = ([0.1, 1, -3], [3, 20, 3])

PROBLEMS = [
    ("decay", decay, DECAY, WIDE, "linear"),
    ("bound", decay, DECAY, NARROW, "linear"),
    ("outliers", decay, OUTLIERS, WIDE, "linear"),
    ("outliers", decay, OUTLIERS, WIDE, "soft_l1"),
    ("outliers", decay, OUTLIERS, WIDE, "huber"),
    ("outliers", decay, OUTLIERS, WIDE, "cauchy"),
    ("sine", sine, SINE, WAVE, "linear"),
]

print("# problem loss cost, parameters and half widths as parts of the way between the bounds")
for name, model, data, (low, high), loss in PROBLEMS:
    low, high = np.array(low, float), np.array(high, float)
    residuals = lambda u: model(low + u * (high - low)) - data
    start = np.full(3, 0.5)
    if name == "sine":
        cost = lambda u: 0.5 * np.sum(residuals(u) ** 2)
        start = differential_evolution(cost, [(0, 1)] * 3, seed=1, tol=1e-10).x
    found = least_squares(residuals, start, "3-point", (np.zeros(3), np.ones(3)), loss=loss,
                          f_scale=0.1, xtol=1e-14, ftol=1e-14, gtol=1e-14)
    widths = [0, 0, 0]
    if loss == "linear" and not found.active_mask.any():
        square = 2 * found.cost / (ROWS - 3)
        widths = student.ppf(0.975, ROWS - 3) * np.sqrt(square * np.diag(np.linalg.inv(found.jac.T @ found.jac)))
    print(name, loss, *(repr(float(x)) for x in [found.cost, *found.x, *widths]))
