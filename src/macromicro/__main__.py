"""The command `macromicro`, also as `python -m macromicro`."""

from __future__ import annotations

import sys


def main() -> int:
    """Run the command line; Ctrl-C during imports ends it without a traceback, too."""
    try:
        from macromicro.cli import main as command

        return command()
    except KeyboardInterrupt:
        print("macromicro: interrupted", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main())
