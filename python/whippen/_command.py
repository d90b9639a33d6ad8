"""The command in a process of its own: it prints, and answers to Ctrl-C, as on a command line."""

import subprocess
import sys


class CommandError(Exception):
    """The command did not do what it was asked to. `code` is its exit code: 1 the program is wrong or does not fit,
    2 what was asked for is wrong, 3 a defect in Whippen."""

    def __init__(self, code, message):
        super().__init__(message)
        self.code = code


def output(words):
    """What the command prints for these words."""
    ended = subprocess.run([sys.executable, "-m", "whippen", *words], capture_output=True, text=True)
    if ended.returncode:
        raise CommandError(ended.returncode, (ended.stderr or ended.stdout).strip())
    return ended.stdout
