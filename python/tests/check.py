"""What Python's users do with Whippen. Run by `python.rs` in the top of the repository, with a folder to write into; every
function is a check, and an exception is what fails."""

import concurrent.futures
import csv
import os
import pathlib
import pickle
import signal
import subprocess
import sys
import time

import numpy as np

import whippen

GRAND = "instruments/grand-piano.whip"
FOLDER = pathlib.Path(sys.argv[1])


def raises(kind, part, call):
    """That a call raises an error of a kind whose text has a part."""
    try:
        call()
    except kind as error:
        assert part in str(error), str(error)
    else:
        raise AssertionError(f"nothing was raised, and {part!r} was expected")


def a_run_is_that_of_the_command():
    trace = whippen.load(GRAND).run(seconds=1.5)
    out, events = FOLDER / "trace.csv", FOLDER / "events.csv"
    words = ["run", GRAND, "--seconds", "1.5", "--out", str(out), "--events", str(events)]
    subprocess.run([sys.executable, "-m", "whippen", *words], check=True, capture_output=True)
    with open(out) as file:
        titles = next(csv.reader(file))
    assert titles == ["t_s", *trace], titles
    # A table has the digits that mean something: half a step of fixed point at most is lost.
    table = np.genfromtxt(out, delimiter=",", skip_header=1, usecols=range(3))
    assert table.shape[0] == len(trace) == 66150
    assert np.abs(table[:, 1] - trace["drive_n"]).max() < 1e-3
    assert np.abs(table[:, 2] - trace["x_m"]).max() < 1e-6
    with open(events) as file:
        rows = list(csv.DictReader(file))
    assert [row["event"] for row in rows] == [event["event"] for event in trace.events] and rows


def engines_are_equal_and_columns_are_not_copied():
    program = whippen.load(GRAND)
    jit, interp = (program.run(seconds=1.0, engine=engine) for engine in ("jit", "interp"))
    assert all(np.array_equal(jit[title], interp[title]) for title in jit)
    column = jit["x_m"]
    assert column is jit["x_m"] and column.dtype == np.float64 and len(column) == len(jit)
    assert set(np.unique(jit["contact"])) <= set(range(len(jit.labels["contact"])))
    np.savez(FOLDER / "trace.npz", **jit)
    assert np.array_equal(np.load(FOLDER / "trace.npz")["force_n"], jit["force_n"])


def arrays_move_the_key():
    program = whippen.load(GRAND)
    stroke = 9e-3 * np.clip((np.arange(800) - 100) / 80, 0, 1)
    struck = program.run(stroke, motion_rate_hz=2000.0)
    assert len(struck.notes()) == 1, struck.events
    softer = program.run(stroke, motion_rate_hz=500.0)
    assert softer.notes()[0]["speed_m_per_s"] < struck.notes()[0]["speed_m_per_s"]
    heavy = program.run(stroke, motion_rate_hz=2000.0, set={"weight": "0.8N"})
    assert heavy["weight_n"][0] > struck["weight_n"][0] + 0.2
    assert np.array_equal(program.run(stroke, motion_rate_hz=2000.0, set={"weight": 0.8})["force_n"], heavy["force_n"])
    arm = whippen.load("tests/programs/two-axis-spring.whip")
    raises(ValueError, "dict of arrays", lambda: arm.run(stroke))
    ports = {name: stroke for name in ("x", "y")}
    assert len(arm.run(ports)) == 800
    raises(ValueError, "no array", lambda: arm.run({"x": stroke}))
    raises(ValueError, "no port `q`", lambda: arm.run({**ports, "q": stroke}))


def programs_go_to_other_processes():
    program = whippen.load(GRAND, set={"weight": 0.5})
    again = pickle.loads(pickle.dumps(program))
    assert np.array_equal(program.run(seconds=0.2)["force_n"], again.run(seconds=0.2)["force_n"])
    with concurrent.futures.ProcessPoolExecutor(2) as pool:
        peaks = list(pool.map(peak, [(program, weight) for weight in (0.3, 0.6, 0.9)]))
    assert peaks == sorted(peaks) and peaks[0] < peaks[2]
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        assert list(pool.map(peak, [(program, weight) for weight in (0.3, 0.6, 0.9)])) == peaks


def peak(job):
    program, weight = job
    return float(program.run(seconds=0.3, set={"weight": weight})["weight_n"].max())


def mistakes_have_the_text_of_the_diagnostic():
    wrong = "instrument i {\n    sense x: length in 0 mm .. 1 mm\n    force f = x\n}\n"
    raises(whippen.ProgramError, "WH0302", lambda: whippen.loads(wrong))
    raises(whippen.ProgramError, "no parameter `nope`", lambda: whippen.load(GRAND).run(set={"nope": 1.0}))
    raises(FileNotFoundError, "nowhere.whip", lambda: whippen.load("nowhere.whip"))
    raises(ValueError, "engines are", lambda: whippen.load(GRAND).run(engine="nope"))
    raises(ValueError, "finite", lambda: whippen.load(GRAND).run([0.0, float("nan")]))
    raises(ValueError, "no column `nope`", lambda: whippen.load(GRAND).run(columns=["nope"]))
    raises(ValueError, "no device", lambda: whippen.load(GRAND, device="nope").run())
    raises(KeyError, "no column", lambda: whippen.load(GRAND).run(seconds=0.1)["nope"])
    raises(whippen.CommandError, "board", lambda: whippen.load(GRAND).budget(board="nope"))
    raises(ValueError, "as text", lambda: whippen.load(GRAND, set={"weight": 0.5}).budget())


def proofs_and_firmware():
    program = whippen.load("instruments/hammond.whip", set={"k": "90N/m"})
    assert program.budget(keys=4)["board"] == "rp2350"
    image = FOLDER / "hammond.uf2"
    program.build(image, keys=4)
    assert image.read_bytes()[:4] == b"UF2\n"
    text = whippen.loads(pathlib.Path("instruments/virtual-spring.whip").read_text())
    assert text.budget(keys=2, board="rp2040")["board"] == "rp2040"


def a_trace_draws_itself():
    svg = whippen.load(GRAND).run(seconds=0.5)._repr_svg_()
    assert svg.startswith("<svg") and "repetition" in svg
    chosen = whippen.load(GRAND).run(seconds=0.5, columns=["x", "contact"])
    assert sorted(chosen)[:2] == ["contact", "contact_n"] and chosen.svg().startswith("<svg")


def ctrl_c_ends_a_run():
    text = f"import whippen\nprint('begun', flush=True)\nwhippen.load({GRAND!r}).run(seconds=3600, columns=['drive'])"
    child = subprocess.Popen([sys.executable, "-c", text], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "begun\n"
    time.sleep(1)
    child.send_signal(signal.SIGINT)
    _, errors = child.communicate(timeout=60)
    assert child.returncode != 0 and "KeyboardInterrupt" in errors, errors


def the_command_is_the_command():
    def run(*words):
        return subprocess.run([sys.executable, "-m", "whippen", *words], capture_output=True, text=True)

    assert run("--version").stdout == f"whippen {whippen.__version__}\n"
    assert run("nope").returncode == 2 and run("check", "nowhere.whip").returncode == 2
    assert run("check", GRAND).returncode == 0


if __name__ == "__main__":
    checks = [
        a_run_is_that_of_the_command,
        engines_are_equal_and_columns_are_not_copied,
        arrays_move_the_key,
        programs_go_to_other_processes,
        mistakes_have_the_text_of_the_diagnostic,
        proofs_and_firmware,
        a_trace_draws_itself,
        ctrl_c_ends_a_run,
        the_command_is_the_command,
    ]
    os.environ.pop("NO_COLOR", None)
    for check in checks:
        check()
        print(check.__name__, "ok")
