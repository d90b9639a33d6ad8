"""Runs an example of `examples/python` and judges what it finds: examples.py NAME."""

import importlib
import pathlib
import sys

FOLDER = pathlib.Path("examples/python")
WEIGHTS_N = [-0.4, 0.0, 0.4]


def example(name):
    # Processes that an example begins find it by its name.
    sys.path.insert(0, str(FOLDER.resolve()))
    return importlib.import_module(name)


def rises_with_the_weight(peaks_n):
    # The weight is added to every force, to a step of the drive's 1/1024 N.
    assert all(abs(b - a - 0.4) < 2e-3 for a, b in zip(peaks_n, peaks_n[1:])), peaks_n


def scipy():
    fit = example("fit_scipy")
    found = fit.fit()
    assert abs(found["k"] - fit.TRUE["k"]) < 1.0 and abs(found["preload"] - fit.TRUE["preload"]) < 5e-3, found


def optuna():
    study = example("search_optuna").search()
    assert study.best_value < 0.02, study.best_value


def dask():
    rises_with_the_weight(example("sweep_dask").sweep(WEIGHTS_N))


def ray():
    sweep = example("sweep_ray")
    sweep.ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
    rises_with_the_weight(sweep.sweep(WEIGHTS_N))


if __name__ == "__main__":
    {"scipy": scipy, "optuna": optuna, "dask": dask, "ray": ray}[sys.argv[1]]()
    print("ok")
