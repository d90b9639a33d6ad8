"""Plays a grand with many weights at once, with Dask.

    pip install whippen dask
    python examples/python/sweep_dask.py
"""

import pathlib

import dask

import whippen

INSTRUMENTS = pathlib.Path(__file__).parents[2] / "instruments"


def peak_n(program, weight):
    """The greatest force of the bundled gesture (N)."""
    return program.run(seconds=1.0, set={"weight": weight}, columns=["drive"])["drive_n"].max()


def sweep(weights):
    grand = whippen.load(INSTRUMENTS / "grand-piano.whip")
    peaks = [dask.delayed(peak_n)(grand, weight) for weight in weights]
    return dask.compute(*peaks, scheduler="processes", num_workers=2)


if __name__ == "__main__":
    weights = [-0.4, -0.2, 0.0, 0.2, 0.4]
    for weight, peak in zip(weights, sweep(weights)):
        print(f"weight {weight:+.1f} N: at most {peak:.3f} N")
