"""The command `whippen`: `python -m whippen`."""

import sys

from ._whippen import command


def main():
    """Runs the command line of this process. What an interrupt does the command has done when Python tells of it."""
    try:
        sys.exit(command(["whippen", *sys.argv[1:]]))
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    main()
