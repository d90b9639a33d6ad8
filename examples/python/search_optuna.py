"""Looks for the weight with which a grand's key feels as asked for, with Optuna.

    pip install whippen optuna
    python examples/python/search_optuna.py
"""

import pathlib

import numpy
import optuna

import whippen

INSTRUMENTS = pathlib.Path(__file__).parents[2] / "instruments"
WANTED_N = 0.70  # the most that the key pushes back in a slow stroke to 4 mm, before its let-off


def search(trials=30):
    grand = whippen.load(INSTRUMENTS / "grand-piano.whip")
    slow_m = 0.004 * numpy.linspace(0, 1, 22050)

    def off_n(trial):
        weight = trial.suggest_float("weight", -0.4, 0.4)
        force_n = grand.run(slow_m, set={"weight": weight}, columns=["drive"])["drive_n"]
        return abs(force_n.max() - WANTED_N)

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=1))
    study.optimize(off_n, n_trials=trials)
    return study


if __name__ == "__main__":
    study = search()
    print(f"weight {study.best_params['weight']:.3f} N, {1e3 * study.best_value:.1f} mN off")
