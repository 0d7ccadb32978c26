"""First-order reversal curves in the MicroMag text format (vibrating-sample magnetometers).

A title, ``name = value`` settings, blocks of ``field,moment`` lines separated by empty lines, a
closing line. Blocks of several points are ascending curves; blocks of one point are drift
calibrations, as is every second block if the first one and its alternates have one point.
"""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.hysteresis.curves import CurveWarning
from macromicro.schema.text import printable, read_text

_WHAT = "first-order reversal curves in the MicroMag text format"
_DATA = re.compile(r"[-+.\d]")


class CutFileWarning(CurveWarning):
    """The file ends early, or holds another number of points than it says."""


class ForcFile(NamedTuple):
    """What the file holds, in its own units (`settings["Units of measure"]`: cgs or SI)."""

    #: ascending (field, moment) pairs for ``FodTable.from_curves(..., kind="ascending")``
    curves: list[tuple[Array, Array]]
    calibration: Array  #: field and moment before each curve; k may be 0
    settings: dict[str, str]  #: the header's names and values as text


def read_forc(path: str | Path, *, drift: bool = False) -> ForcFile:
    r"""Read a MicroMag file of first-order reversal curves.

    Warns when the closing line is missing or the number of points is not the header's.

    Parameters
    ----------
    path : str | Path
        The file.
    drift : bool, optional
        Multiply each curve so that the calibration moment before it equals the mean of all.

    Returns
    -------
    ForcFile
        Curves, calibration points and settings, in the file's units.

    Raises
    ------
    InputError
        Names file and line: a file of another kind, a line that is not two numbers, fewer than two
        curves, or drift without one calibration per curve.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from macromicro.hysteresis.forc import read_forc
    >>> with TemporaryDirectory() as folder:
    ...     text = "MicroMag\nNData = 4\n0,1\n1,3\n\n-1,-1\n1,3\nMicroMag Data File ends\n"
    ...     written = Path(folder, "made.txt").write_text(text)
    ...     [u.tolist() for u, f in read_forc(Path(folder, "made.txt")).curves]
    [[0.0, 1.0], [-1.0, 1.0]]
    """
    file = Path(path)
    where = printable(file, 300)
    lines = read_text(file, _WHAT).splitlines()
    if not lines[0].startswith("MicroMag"):
        raise InputError(f"{where}, line 1", printable(lines[0]), _WHAT)
    settings, first = _header(lines)
    blocks, closed = _blocks(lines, first, where)
    blocks, single = _parted(blocks)
    curves = [(block[:, 0].copy(), block[:, 1].copy()) for block in blocks]
    if len(curves) < 2:
        raise ProblemError(where, f"{len(curves)} of at least 2 curves found", f"Give {_WHAT}.")
    points = sum(len(block) for block in (*blocks, *single))
    said = settings.get("NData", str(points))
    if not closed or said != str(points):
        found = "no closing line" if not closed else "a closing line"
        message = f"{where}: {points} points ({said} announced) and {found}; all of them are used"
        warnings.warn(message, CutFileWarning, stacklevel=2)
    calibration = np.concatenate(single) if single else np.empty((0, 2))
    if drift:
        curves = _without_drift(curves, calibration, where)
    return ForcFile(curves, calibration, settings)


def _header(lines: list[str]) -> tuple[dict[str, str], int]:
    """Settings by name, and the number of the first line of data."""
    settings = {"title": lines[0].strip()}
    for number, line in enumerate(lines[1:], 1):
        text = line.strip()
        if _DATA.match(text) and "," in text and "/" not in text:
            return settings, number
        name, mark, value = text.partition("=" if "=" in text else ":")
        if mark and not _DATA.match(text):
            settings[name.strip()] = value.strip()
    return settings, len(lines)


def _blocks(lines: list[str], first: int, where: str) -> tuple[list[Array], bool]:
    """Blocks of (field, moment) rows, and whether the closing line was there."""
    blocks: list[list[tuple[float, float]]] = [[]]
    for number, line in enumerate(lines[first:], first + 1):
        text = line.strip()
        if text.startswith("MicroMag"):
            return [np.array(block) for block in blocks if block], True
        if not text:
            if blocks[-1]:
                blocks.append([])
            continue
        cells = text.split(",")
        try:
            blocks[-1].append((float(cells[0]), float(cells[1])))
        except (ValueError, IndexError):
            accepted = "field,moment as two numbers"
            raise InputError(f"{where}, line {number}", printable(text), accepted) from None
    return [np.array(block) for block in blocks if block], False


def _parted(blocks: list[Array]) -> tuple[list[Array], list[Array]]:
    """Curves and calibrations: one before each curve, or all blocks of one point."""
    before, after = blocks[::2], blocks[1::2]
    if after and all(len(block) == 1 for block in before):  # a cut file may end with one
        return after, before
    short = [block for block in blocks if len(block) == 1]
    return [block for block in blocks if len(block) > 1], short


def _without_drift(
    curves: list[tuple[Array, Array]], calibration: Array, where: str
) -> list[tuple[Array, Array]]:
    """Curves scaled by the calibrations before them."""
    if len(calibration) != len(curves):
        found = f"calibrations and curves number {len(calibration)} and {len(curves)}"
        raise ProblemError(f"{where}, drift", found, "Put one calibration before each curve.")
    if np.any(calibration[:, 1] == 0.0):
        zero = int(np.argmin(np.abs(calibration[:, 1]))) + 1
        found = f"the moment is 0 at calibration {zero}"
        raise ProblemError(f"{where}, drift", found, "Repeat or repair this calibration.")
    gains = float(np.mean(calibration[:, 1])) / calibration[:, 1]
    return [(u, f * gain) for (u, f), gain in zip(curves, gains, strict=True)]
