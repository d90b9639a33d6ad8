"""Plays a grand with many weights on all machines of a cluster, or on this one, with Ray.

    pip install whippen ray
    python examples/python/sweep_ray.py
"""

import pathlib

import ray

import whippen

INSTRUMENTS = pathlib.Path(__file__).parents[2] / "instruments"


@ray.remote
def peak_n(program, weight):
    """The greatest force of the bundled gesture (N)."""
    return program.run(seconds=1.0, set={"weight": weight}, columns=["drive"])["drive_n"].max()


def sweep(weights):
    grand = ray.put(whippen.load(INSTRUMENTS / "grand-piano.whip"))
    return ray.get([peak_n.remote(grand, weight) for weight in weights])


if __name__ == "__main__":
    ray.init(num_cpus=2, include_dashboard=False)
    weights = [-0.4, -0.2, 0.0, 0.2, 0.4]
    for weight, peak in zip(weights, sweep(weights)):
        print(f"weight {weight:+.1f} N: at most {peak:.3f} N")
