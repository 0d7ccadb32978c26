"""With which code results are made: the package's version and a digest of its files."""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path
from typing import NamedTuple

import macromicro
from macromicro.kernel import cache_folder
from macromicro.sampling import drawn_by

_DATA = (".csv", ".toml", ".json")  # the shipped calibration, programmes, sizes of units


class Code(NamedTuple):
    """With which code results are made.

    Attributes
    ----------
    version : str
        Of the package.
    sources : str
        Digest of the package's sources and data, 16 hexadecimal digits.
    sampler : str
        What draws the points, with its version: another one may draw others.
    """

    version: str
    sources: str
    sampler: str

    def __str__(self) -> str:
        return f"{self.version}, sources {self.sources}, {self.sampler}"


def code() -> Code:
    """Tell the code that this package's files hold now.

    Returns
    -------
    Code
        Version, digest and sampler.
    """
    package = Path(macromicro.__file__).parent
    digest = hashlib.sha256(cache_folder(joined=False).name.encode())  # of all Python sources
    for path in sorted(package.rglob("*")):
        name = path.relative_to(package)
        if path.suffix in _DATA and not any(part.startswith(".") for part in name.parts):
            digest.update(str(name).encode())
            digest.update(path.read_bytes())
    return Code(macromicro.__version__, digest.hexdigest()[:16], drawn_by())


@cache
def running() -> Code:
    """Tell the code of this process: what it has imported, later edits do not change.

    Returns
    -------
    Code
        Looked at once.
    """
    return code()
