"""`python -m macromicro` is the command `macromicro`."""

import sys

from macromicro.cli import main

if __name__ == "__main__":
    sys.exit(main())
