"""The built firmware for an Arduino Uno or Nano; `make hex` renews it."""

from __future__ import annotations

import hashlib
from importlib.resources import files
from pathlib import Path

from macromicro.errors import MacromicroError

FILE = "uno.hex"
COMPILER = "5.4.0"  # version of avr-gcc that built it


def firmware() -> bytes:
    folder = files(__package__)
    data = folder.joinpath(FILE).read_bytes()
    recorded = folder.joinpath(f"{FILE}.sha256").read_text("utf-8").split()[0]
    if hashlib.sha256(data).hexdigest() != recorded:
        raise MacromicroError(f"{FILE} of this package is damaged: install macromicro again")
    return data


def write(out: Path) -> str:
    """Write the file and its FILE.sha256."""
    data = firmware()
    digest = hashlib.sha256(data).hexdigest()
    out.write_bytes(data)
    out.with_name(f"{out.name}.sha256").write_text(f"{digest}  {out.name}\n", "utf-8")
    return digest
