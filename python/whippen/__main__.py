"""The command `whippen`: `python -m whippen`."""

import sys

from ._whippen import command


def main():
    """Runs the command line of this process."""
    sys.exit(command(["whippen", *sys.argv[1:]]))


if __name__ == "__main__":
    main()
