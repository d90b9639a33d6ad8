"""Programs: read, run, prove, build, fit."""

import contextlib
import json
import os
import pathlib
import tempfile

from . import _command, _whippen
from .trace import Trace


def load(*files, instrument=None, device=None, tick_rate=None, set=None):
    """Reads the files of one program.

    `instrument` names one where there are several; `device` is a bundled device or the file of one; `tick_rate` is in
    hertz (`150e6 / 3400` is taken exactly); `set` gives values to parameters, in SI as numbers or with a unit as text.
    Raises `ProgramError` with what `whippen check` prints where the program is wrong, `OSError` where a file is not
    there, `ValueError` for other mistakes.
    """
    if not files:
        raise ValueError("name a file of a program")
    paths = [os.fspath(file) for file in files]
    sources = [(path, pathlib.Path(path).read_text(encoding="utf-8")) for path in paths]
    return Program(sources, instrument=instrument, device=device, tick_rate=tick_rate, set=set, paths=paths)


def loads(text, *, instrument=None, device=None, tick_rate=None, set=None):
    """Reads a program from a text; else as `load`."""
    return Program([("<text>", text)], instrument=instrument, device=device, tick_rate=tick_rate, set=set)


def _words(options):
    """Options of a command: `most_keys=True` is `--most-keys`, `board="rp2040"` is `--board rp2040`."""
    for name, value in options.items():
        option = "--" + name.replace("_", "-")
        if value is True:
            yield option
        elif isinstance(value, (list, tuple)):
            for one in value:
                yield from (option, os.fspath(one) if isinstance(one, os.PathLike) else str(one))
        elif value is not None and value is not False:
            yield from (option, os.fspath(value) if isinstance(value, os.PathLike) else str(value))


class Program:
    """A checked program, and the instrument of it that is meant. It can be pickled."""

    def __init__(self, sources, *, instrument=None, device=None, tick_rate=None, set=None, paths=None):
        self._given = {
            "instrument": instrument,
            "device": None if device is None else os.fspath(device),
            "tick_rate": tick_rate,
            "set": dict(set or {}),
        }
        self._sources = sources
        self._paths = paths
        self._program = _whippen.Program(sources, **self._given)

    def __reduce__(self):
        return (_again, (self._sources, self._given, self._paths))

    def __repr__(self):
        return f"<whippen.Program {', '.join(self.instruments)}>"

    @property
    def instruments(self):
        """The names of its instruments."""
        return self._program.instruments

    @property
    def text(self):
        """The text of its first file."""
        return self._sources[0][1]

    def run(self, motion=None, *, set=None, engine="jit", motion_rate_hz=None, seconds=None, columns=None):
        """Moves the instrument and keeps every tick, as a `Trace`.

        `motion` is the bundled gesture (`None`), the path of a table, an array of positions (m, or rad of what turns),
        or a dict of arrays by port; an array has a sample a tick, or `motion_rate_hz` of them a second. `engine` is
        `jit`, `interp`, `ideal` or `emulated`; `columns` are names of those to keep. Ctrl-C ends it.
        """
        import numpy

        def array(values):
            return numpy.ascontiguousarray(values, dtype=numpy.float64)

        if isinstance(motion, dict):
            motion = {name: array(values) for name, values in motion.items()}
        elif motion is not None and not isinstance(motion, (str, os.PathLike)):
            motion = array(motion)
        run = self._program.run(
            motion,
            set=set,
            engine=engine,
            motion_rate_hz=motion_rate_hz,
            seconds=seconds,
            columns=columns,
        )
        return Trace(run)

    @contextlib.contextmanager
    def _command_words(self):
        """The words by which the command finds this program and its settings."""
        with tempfile.TemporaryDirectory() as folder:
            paths = self._paths
            if paths is None:
                path = pathlib.Path(folder) / "program.whip"
                path.write_text(self._sources[0][1], encoding="utf-8")
                paths = [str(path)]
            given = self._given
            words = [*paths, *([given["instrument"]] if given["instrument"] else [])]
            words += _words({"device": given["device"], "tick_rate": given["tick_rate"]})
            for name, value in given["set"].items():
                text = ("on" if value else "off") if isinstance(value, bool) else value
                words += ["--set", f"{name}={text}"]
            yield words

    def _plain_set(self):
        """Numbers in SI can be given to the command only where their parameter has no unit."""
        numbers = [n for n, v in self._given["set"].items() if not isinstance(v, (str, bool))]
        if numbers:
            raise ValueError(f"give {', '.join(numbers)} with a unit, as text, where a command reads it")

    def budget(self, **options):
        """Proves that every tick is in time: what `whippen budget --json` prints, as a dict. Options are the
        command's: `board="rp2040"`, `keys=44`, `most_keys=True`. Files are read again."""
        self._plain_set()
        with self._command_words() as words:
            return json.loads(_command.output(["budget", *words, "--json", *_words(options)]))

    def build(self, out, **options):
        """Writes firmware as `whippen build -o OUT` does (`.elf`, `.uf2`, `.o`, `.c`, `.wasm`); what it prints."""
        self._plain_set()
        with self._command_words() as words:
            return _command.output(["build", *words, "-o", os.fspath(out), *_words(options)])

    def fit(self, **options):
        """Fits parameters as `whippen fit --json` does: `free="k,B_k"`, `data="rec.toml"`, `seed=1`; as a dict."""
        self._plain_set()
        with self._command_words() as words:
            return json.loads(_command.output(["fit", *words, "--json", *_words(options)]))


def _again(sources, given, paths):
    """A program from its pickle."""
    return Program(sources, paths=paths, **given)
