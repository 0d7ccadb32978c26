"""The built firmware that the package carries is the one that the sources build."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess

import pytest

from macromicro.rig.board import prebuilt
from tests.firmware.built import elf


def _compiler() -> str:
    """Version of avr-gcc here; "" if there is none."""
    if shutil.which("avr-gcc") is None:
        return ""
    done = subprocess.run(["avr-gcc", "-dumpversion"], capture_output=True, text=True, check=True)
    return done.stdout.strip()


@pytest.mark.skipif(
    _compiler() != prebuilt.COMPILER and os.environ.get("MACROMICRO_AVR") != "required",
    reason=f"no avr-gcc {prebuilt.COMPILER} here: make avr on Debian",
)
def test_the_sources_build_it() -> None:
    assert _compiler() == prebuilt.COMPILER
    built = elf().with_suffix(".hex").read_bytes()
    digests = [hashlib.sha256(data).hexdigest() for data in (built, prebuilt.firmware())]
    assert digests[0] == digests[1], (
        "the firmware has changed: run `make hex` and commit both files"
    )
