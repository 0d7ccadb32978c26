"""Result of an identification: lines with uncertainties, figures, a model file."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from io import StringIO
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import macromicro
from macromicro.drawing import files as drawings
from macromicro.drawing.console import WIDE, terminal
from macromicro.identify.clusters import NORMAL, is_normal
from macromicro.schema.text import plain, write_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.console import Console

RESULT, MODEL = "result.json", "model.toml"
FIGURES = (
    *("free_run", "residuals", "thresholds", "speeds", "curves", "density", "gain", "calibration"),
    *("friction", "last", "heat", "branches", "along"),
)
TABLES = ("hall_calibration.csv", "table.h5", "table.csv", "stress_map.csv")
# All that an identification of any kind may write: of an earlier one in a folder nothing may stay.
NAMES = (RESULT, MODEL, *drawings.names(FIGURES), *TABLES)
_PLAIN, _DIGITS = (-5, 7), 10  # powers of ten that are written out; the most digits of others
_NUMBERS, _WORDS = ("value", "+-", "95 % +-"), ("unit", "note")  # columns of the table
_ALWAYS = ("value", "+-", "unit")


class Line(NamedTuple):
    """One quantity of a result.

    Examples
    --------
    >>> from macromicro.identify.result import Line
    >>> round(Line("mass", 1.2, error=0.02, unit="kg").half, 3)  # kg
    0.039
    """

    name: str  #: name of the quantity
    value: float  #: in `unit`
    error: float = math.nan  #: standard error, NaN for none
    unit: str = ""  #: as text; "" for none
    note: str = ""  #: meaning
    #: coverage factor: half of the 95 % interval, in standard errors (`coverage`)
    factor: float = NORMAL[1]
    extra: float = math.nan  #: another measure of accuracy, in `unit`; NaN for none
    extra_name: str = ""  #: column of `extra`, such as "misfit" or "step"

    @property
    def half(self) -> float:
        """Half of the 95 % interval, in `unit`."""
        return self.factor * self.error


@dataclass
class Result:
    """What one identification found.

    Examples
    --------
    >>> from macromicro.identify import Result
    >>> from macromicro.identify.result import Line
    >>> lines = [Line("mass", 1.2, 0.02, "kg"), Line("delay", 1.0, unit="samples")]
    >>> Result("drive", "Axis", None, lines, [], "", draw=dict).uncertainty
    {'mass': 0.02}
    """

    kind: str  #: one of `KINDS`
    title: str  #: title in words
    #: the fitted object: an `Axis`, a `LinearFit`, a `DeadZone`, a `FodTable`, heating and cooling,
    #: a `Calibration`
    model: Any
    lines: list[Line]  #: quantities with standard errors
    remarks: list[tuple[str, str]]  #: fit and whatever else fits no line, as (name, text)
    toml: str  #: text of `to_toml`
    draw: Callable[[], dict[str, Figure]]  #: called by `plot`
    data: dict[str, Any] = field(default_factory=dict)  #: more for result.json
    #: what `save` writes more: file name to a function that takes the path
    extra: dict[str, Callable[[Path], None]] = field(default_factory=dict)
    files: tuple[str, ...] = ()  #: names of those read
    warnings: tuple[str, ...] = ()  #: about the data

    @property
    def uncertainty(self) -> dict[str, float]:
        """Standard errors by quantity, in its unit; those that have one."""
        return {line.name: line.error for line in self.lines if math.isfinite(line.error)}

    @property
    def holds(self) -> bool:
        """Whether the model is nearer to the record than a constant is."""
        return not float(self.data.get("fit_percent", 100.0)) < 0.0

    def to_toml(self) -> str:
        """The text of model.toml.

        Returns
        -------
        str
            Settings for a run where the bench has such, else notes.
        """
        return self.toml

    def to_json(self) -> str:
        """Everything but the pictures; NaN and infinity as null.

        Returns
        -------
        str
            The text of result.json.
        """
        content = {
            "kind": self.kind,
            "title": self.title,
            "files": self.files,
            "values": [line._asdict() for line in self.lines],
            "remarks": dict(self.remarks),
            "data": self.data,
            "warnings": self.warnings,
            "version": macromicro.__version__,
        }
        return json.dumps(plain(content), indent=2, allow_nan=False) + "\n"

    def plot(self) -> dict[str, Figure]:
        """The figures: measured against model, residuals, and what the kind has more.

        Returns
        -------
        dict[str, Figure]
            By name.
        """
        return self.draw()

    def save(
        self, folder: str | PathLike[str], figures: str | Sequence[str] = drawings.DEFAULT
    ) -> None:
        """Write model.toml, result.json, the figures and the kind's tables into a folder.

        Parameters
        ----------
        folder : str | PathLike[str]
            Made if it is not there; files of these names are replaced.
        figures : str | Sequence[str], optional
            Formats of the figures: "png", "svg", "pdf", or several; "none" draws none.

        Raises
        ------
        InputError
            A format is none of these.
        OSError
            The disk refuses.
        """
        kinds = drawings.formats(figures, "figures")
        place = Path(folder)
        place.mkdir(parents=True, exist_ok=True)
        write_text(place / RESULT, self.to_json())
        write_text(place / MODEL, self.to_toml())
        for name, figure in self.plot().items() if kinds else ():
            assert name in FIGURES, name
            drawings.save(figure, place, name, kinds)
        for name, write in self.extra.items():
            assert name in TABLES, name
            write(place / name)

    def show(self, console: Console | None = None) -> None:
        """Print the table and the remarks.

        Parameters
        ----------
        console : Console | None, optional
            A console of rich; None for stdout.
        """
        from rich.table import Table
        from rich.text import Text

        if console is None:
            console = terminal()
        console.print(Text(self.title), soft_wrap=True)
        table = Table(box=None, padding=(0, 2, 0, 0), pad_edge=False)
        rows = [_cells(line) for line in self.lines]
        extras = dict.fromkeys(line.extra_name for line in self.lines if line.extra_name)
        names = [*_NUMBERS, *extras, *_WORDS]
        kept = [n for n in names if n in _ALWAYS or any(n in row for row in rows)]
        table.add_column("")
        for name in kept:
            right = name not in _WORDS
            table.add_column("" if name == "note" else name, justify="right" if right else "left")
        for line, cells in zip(self.lines, rows, strict=True):
            table.add_row(Text(line.name), *(Text(cells.get(n, "")) for n in kept))
        console.print(table)
        for name, text in self.remarks:
            console.print(Text(f"{name}: {text}"), soft_wrap=True)

    def __str__(self) -> str:
        from rich.console import Console

        text = StringIO()
        # In Jupyter rich would show it there, and leave the text empty.
        plain = Console(
            file=text, highlight=False, width=WIDE, force_terminal=False, force_jupyter=False
        )
        self.show(plain)
        return "\n".join(line.rstrip() for line in text.getvalue().splitlines())


def _cells(line: Line) -> dict[str, str]:
    """A line of the table by column; half of the 95 % interval if it is not twice the error."""
    value, error = rounded(line.value, line.error)
    cells = {"value": value, "+-": error, "unit": line.unit, "note": line.note}
    if error and not is_normal(line.factor):
        cells["95 % +-"] = rounded(line.value, line.half)[1]
    if math.isfinite(line.extra):
        cells["value"], cells[line.extra_name] = rounded(line.value, line.extra)
    return {name: text for name, text in cells.items() if text}


def rounded(value: float, error: float = math.nan) -> tuple[str, str]:
    """Value and error as text: the error to two digits, the value to the same place.

    An error above its value leaves the value one digit.

    Parameters
    ----------
    value : float
        Any number.
    error : float, optional
        Its standard error, NaN where there is none.

    Returns
    -------
    value : str
        "-" for NaN.
    error : str
        "" where there is none.

    Examples
    --------
    >>> from macromicro.identify.result import rounded
    >>> rounded(14.02863, 0.0312)
    ('14.029', '0.031')
    >>> rounded(14.02863)
    ('14.029', '')
    """
    if not math.isfinite(value):
        return ("-" if math.isnan(value) else str(value)), ""
    if not math.isfinite(error):
        return f"{value:.5g}", ""
    if error <= 0.0:
        return f"{value:.6g}", "0"
    said = f"{error:.1e}"  # two digits; 0.0996 becomes 0.10
    own = int(said.split("e")[1])
    top = math.floor(math.log10(abs(value))) if value != 0.0 else own
    place = min(own - 1, top)
    exact = top >= -2 and -place <= _DIGITS  # 3.99999935 +- 5.9e-07
    if max(own, top) < _PLAIN[1] and (own >= _PLAIN[0] or exact):
        small = f"{float(said):.{max(1 - own, 0)}f}" if own >= _PLAIN[0] else f"{float(said):.2g}"
        return f"{round(value, -place):.{max(-place, 0)}f}", small
    return f"{value:.{min(top - place, _DIGITS)}e}", f"{float(said):.2g}"
