"""What computes results: the package's version and a digest of its files."""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path
from typing import NamedTuple

import macromicro
from macromicro.kernel import cache_folder
from macromicro.sampling import drawn_by

_DATA = (".csv", ".toml", ".json")  # the shipped calibration, programmes, sizes of units


class Provenance(NamedTuple):
    version: str  # of the package
    sources: str  # digest of the package's sources and data, 16 hexadecimal digits
    sampler: str  # what draws the points, with its version: another one may draw others

    def __str__(self) -> str:
        return f"{self.version}, sources {self.sources}, {self.sampler}"


def provenance() -> Provenance:
    """The code in this package's files now."""
    package = Path(macromicro.__file__).parent
    digest = hashlib.sha256(cache_folder(joined=False).name.encode())  # of all Python sources
    for path in sorted(package.rglob("*")):
        name = path.relative_to(package)
        if path.suffix in _DATA and not any(part.startswith(".") for part in name.parts):
            digest.update(str(name).encode())
            digest.update(path.read_bytes())
    return Provenance(macromicro.__version__, digest.hexdigest()[:16], drawn_by())


@cache
def running() -> Provenance:
    """The code that this process has imported."""
    return provenance()
