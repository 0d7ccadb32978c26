"""First-order reversal curves in the MicroMag text format (vibrating-sample magnetometers).

A title, settings, blocks of ``field,moment`` lines separated by empty lines, a closing line. Series
15 writes settings as ``name = value``; series 16 in columns, with a table of the segments and a
heading above the data, which may have a third column. Blocks of several points are ascending
curves; blocks of one point are drift calibrations, as is every second block if the first one and
its alternates have one point, and as is a first point far above the rest of its block.
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
_ROW = re.compile(r"[-+.\d][-+.\deE,;\s]*")
_HEADING = re.compile(r"\W*(?:adjusted\s+)?field\b.*\bmoment", re.IGNORECASE)
_NUMBER_OF_POINTS = ("NData", "Number of data")
_SEGMENT = 5  # cells, at least, of a row of the table of segments: the last is where it ends
_ABOVE = 0.5  # of a block's range: a first point so far above the second is no point of its curve


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
    lines = _text(file).splitlines()
    if not lines[0].lstrip('" ').startswith("MicroMag"):
        raise InputError(f"{where}, line 1", printable(lines[0]), _WHAT)
    first = _first(lines)
    settings, ends = _header(lines[:first])
    blocks, closed = _blocks(lines, first, where)
    points = sum(map(len, blocks))
    if len(blocks) == 1:  # no empty lines
        starts = ends if ends and ends[-1] == points else _falls(blocks[0])
        blocks = [block for block in np.split(blocks[0], starts) if len(block)]
    blocks, single = _curves_and_calibrations(
        [part for block in blocks for part in _without_calibration(block)]
    )
    curves = [(block[:, 0].copy(), block[:, 1].copy()) for block in blocks]
    if len(curves) < 2:
        raise ProblemError(where, f"{len(curves)} of at least 2 curves found", f"Give {_WHAT}.")
    said = next((settings[n] for n in _NUMBER_OF_POINTS if n in settings), str(points))
    if not closed or said != str(points):
        found = "no closing line" if not closed else "a closing line"
        message = f"{where}: {points} points ({said} announced) and {found}; all of them are used"
        warnings.warn(message, CutFileWarning, stacklevel=2)
    calibration = np.concatenate(single) if single else np.empty((0, 2))
    if drift:
        curves = _without_drift(curves, calibration, where)
    return ForcFile(curves, calibration, settings)


def _text(file: Path) -> str:
    """The file's text in UTF-8, or in Latin-1 as the instrument writes it."""
    if not file.is_file() or not (data := file.read_bytes()).strip():
        return read_text(file, _WHAT)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _first(lines: list[str]) -> int:
    """Number of the first line of data: below its heading, else the first one of numbers."""
    heading = max((k for k, line in enumerate(lines) if _HEADING.match(line)), default=0)
    for number in range(heading + 1, len(lines)):
        text = lines[number].strip()
        if _ROW.fullmatch(text) and len(_cells(text)) >= 2:
            return number
    return len(lines)


def _cells(text: str) -> list[str]:
    return [cell for cell in re.split(r"[,;\s]+", text) if cell]


def _header(lines: list[str]) -> tuple[dict[str, str], list[int]]:
    """Settings by name, and the last columns of a table of segments: where each ends."""
    settings, ends = {"title": lines[0].strip()}, []
    for line in lines[1:]:
        text = line.strip()
        if _DATA.match(text):
            cells = _cells(text)
            if len(cells) >= _SEGMENT and cells[-1].isdigit():
                ends.append(int(cells[-1]))
            continue
        mark = r"\s*=\s*" if "=" in text else r"\s*:\s*" if ":" in text else r"\s{2,}|\t\s*"
        name, *value = re.split(mark, text, maxsplit=1)
        if value:
            settings[name.strip()] = value[0].strip()
    return settings, ends


def _blocks(lines: list[str], first: int, where: str) -> tuple[list[Array], bool]:
    """Blocks of (field, moment) rows, and whether the closing line was there."""
    blocks: list[list[tuple[float, float]]] = [[]]
    closed = False
    for number, line in enumerate(lines[first:], first + 1):
        text = line.strip()
        if closed := text.lstrip('"').startswith("MicroMag"):
            break
        if not text:
            blocks.append([])
            continue
        try:
            field, moment, *_ = _cells(text)
            blocks[-1].append((float(field), float(moment)))
        except ValueError:
            accepted = "field,moment as two numbers"
            raise InputError(f"{where}, line {number}", printable(text), accepted) from None
    return [np.array(block) for block in blocks if block], closed


def _falls(block: Array) -> list[int]:
    """Rows at which the field falls: a curve begins."""
    steps = np.diff(block[:, 0])
    usual = float(np.median(np.abs(steps))) if len(steps) else 0.0
    return (np.flatnonzero(steps < -3.0 * usual) + 1).tolist()


def _without_calibration(block: Array) -> list[Array]:
    """A curve's block, cut behind a calibration that no empty line separates from it."""
    field = block[:, 0]
    if len(field) > 2 and field[0] - field[1] > _ABOVE * float(np.ptp(field)):
        return [block[:1], block[1:]]
    return [block]


def _curves_and_calibrations(blocks: list[Array]) -> tuple[list[Array], list[Array]]:
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
