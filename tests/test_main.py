"""The command's first moments."""

from __future__ import annotations

import subprocess
import sys

EARLY = """
import sys

class Interrupted:
    def find_spec(self, name, path=None, target=None):
        if name == "macromicro.commands":
            raise KeyboardInterrupt

sys.meta_path.insert(0, Interrupted())
from macromicro.__main__ import main
sys.exit(main())
"""


def test_an_interrupt_while_it_is_imported_is_no_traceback() -> None:
    done = subprocess.run(
        [sys.executable, "-c", EARLY], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (130, "macromicro: interrupted\n")


def test_the_module_is_the_command() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "macromicro", "--version"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.startswith("macromicro ")
