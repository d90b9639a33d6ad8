"""Force-feedback instruments from Python: read a program, run it, get arrays.

>>> import whippen
>>> touch = whippen.load("grand-piano.whip").run(set={"k": 6000.0})
>>> touch["drive_n"].max(), touch.events[0]
"""

from ._whippen import ProgramError, __version__
from ._command import CommandError
from .program import Program, load, loads
from .trace import Trace

__all__ = ["CommandError", "Program", "ProgramError", "Trace", "__version__", "load", "loads"]
