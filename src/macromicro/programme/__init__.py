"""Motion programmes: which stage goes where, and for how long.

A TOML programme is sequenced: a move starts when the one before it is complete. A CSV
programme is scheduled: a zero-order hold of columns over time. Motion profiles in TOML
are scheduled, too; between moves each profile is sequenced. A machine of one stage follows
their polynomials, the two-stage machine a set point each control period.
"""

from __future__ import annotations

import difflib
from pathlib import Path

from macromicro.errors import ProblemError
from macromicro.programme._profiled import follow
from macromicro.programme._written import load_toml
from macromicro.programme.moves import (
    FEWEST,
    LONGEST,
    MACRO,
    MAX_HOLD,
    MAX_MOVES,
    MICRO,
    WHAT,
    Limits,
    Programme,
    Span,
    dense,
)
from macromicro.programme.scheduled import load_csv
from macromicro.schema.text import printable

__all__ = [
    "FEWEST",
    "LONGEST",
    "MACRO",
    "MAX_HOLD",
    "MAX_MOVES",
    "MICRO",
    "Limits",
    "Programme",
    "Span",
    "dense",
    "find",
    "follow",
    "load",
    "shipped",
]

FOLDER = Path(__file__).parents[1] / "programmes"


def shipped() -> dict[str, Path]:
    """The example programmes that come with the package.

    Returns
    -------
    dict[str, Path]
        File by name.

    Examples
    --------
    >>> from macromicro.programme import shipped
    >>> "thesis" in shipped()
    True
    """
    return {p.stem: p for p in sorted(FOLDER.iterdir()) if p.suffix in (".toml", ".csv")}


def find(name_or_path: str) -> Path:
    """The file of a programme, by the name of an example or by path.

    Parameters
    ----------
    name_or_path : str
        Name of an example, or a path.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ProblemError
        There is neither; names the nearest example.

    Examples
    --------
    >>> from macromicro.programme import find
    >>> find("thesis").name
    'thesis.toml'
    """
    examples = shipped()
    if name_or_path in examples:
        return examples[name_or_path]
    path = Path(name_or_path)
    try:
        found = bool(name_or_path) and path.exists()
    except (OSError, ValueError):  # too long, or a NUL in it
        found = False
    if found:
        return path
    near = difflib.get_close_matches(name_or_path, examples, 1)
    hint = f" (nearest: {near[0]})" if near else ""
    accepted = f"Give {WHAT} or the name of an example: {', '.join(examples)}{hint}."
    raise ProblemError("programme", f"{printable(name_or_path)}: no such file", accepted)


def load(path: Path, limits: Limits) -> Programme:
    """Read a programme.

    Parameters
    ----------
    path : Path
        .toml (sequenced, or profiles) or .csv (scheduled).
    limits : Limits
        Travel of the stages; targets outside are refused.

    Returns
    -------
    Programme
        Targets in counts and m.

    Raises
    ------
    InputError
        Names the file and the line (CSV, TOML syntax) or the move or profile, counted from 1,
        and its key (TOML).

    Examples
    --------
    >>> from macromicro.programme import Limits, find, load
    >>> limits = Limits(0.0, 40_000.0, 0.0, 4e-3, counts_per_metre=2e5)
    >>> programme = load(find("thesis"), limits)
    >>> programme.title, len(programme.target)
    ('Integrated test (Chapter 6)', 40)
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix == ".csv":
        return load_csv(path, limits)
    if suffix == ".toml" or path.is_dir():  # reading says that it is a directory
        return load_toml(path, limits)
    found = f"the suffix is {printable(suffix)}" if suffix else "there is no suffix"
    raise ProblemError(printable(path, 300), found, f"Expected: {WHAT}.")
