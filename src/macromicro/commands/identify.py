"""``macromicro identify KIND FILE ...``: the commands, their options, and what they write."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from macromicro.commands.group import Group
from macromicro.commands.signals import Signals

if TYPE_CHECKING:
    from macromicro.identify.kinds.loading import Picking
    from macromicro.identify.result import Result

app = typer.Typer(
    cls=Group,
    help="Identify a bench from recordings, CSV, MAT or MicroMag files.",
    no_args_is_help=True,
    rich_markup_mode=None,
)

Files = Annotated[list[str], typer.Argument(metavar="FILE", help="One file or several.")]
Columns = Annotated[
    list[str] | None,
    typer.Option(metavar="NAME=COLUMN", help="Which column is what, such as x=position_mm:mm."),
]
Out = Annotated[Path | None, typer.Option(help="Folder for figures, result.json, model.toml.")]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace results in that folder.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the result as JSON, nothing else.")]
# What identifications write; of an earlier one in the same folder nothing may stay.
NAMES = (
    "result.json",
    "model.toml",
    "free_run.png",
    "residuals.png",
    "thresholds.png",
    "speeds.png",
    "curves.png",
    "density.png",
    "gain.png",
    "calibration.png",
    "hall_calibration.csv",
    "table.h5",
    "table.csv",
)
NEEDED = 20_000_000


@app.command()
def drive(
    files: Files,
    columns: Columns = None,
    gain: Annotated[
        float | None, typer.Option(help="Force per unit of u, such as N/V.", show_default="1")
    ] = None,
    structure: Annotated[
        str, typer.Option(help="auto, viscous, coulomb, asymmetric, stribeck or full.")
    ] = "auto",
    limit: Annotated[float | None, typer.Option(help="The drive saturates at +-LIMIT.")] = None,
    delay: Annotated[
        int | None, typer.Option(help="Samples by which u acts late.", show_default="0")
    ] = None,
    out: Out = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Mass and friction of a motor-driven axis (columns t, u, x)."""

    def work(picking: Picking) -> Result:
        from macromicro.identify.kinds import drive as kind

        return kind.identify(picking, kind.Options(gain, structure, limit, delay))

    _identify(work, files, columns, out, overwrite, as_json)


@app.command()
def linear(
    files: Files,
    columns: Columns = None,
    method: Annotated[
        str, typer.Option(help="output_error, mls, sriv, gls or least_squares.")
    ] = "output_error",
    order: Annotated[str, typer.Option(help="Numbers of a, of b, and the delay.")] = "1,1,1",
    start: Annotated[str, typer.Option(help="Records start at rest, or free.")] = "rest",
    width: Annotated[float, typer.Option(help="Dead zone, taken off the size of u.")] = 0.0,
    out: Out = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """A discrete linear model (columns t, u and y; or a position x, differentiated)."""

    def work(picking: Picking) -> Result:
        from macromicro.identify.kinds import linear as kind

        return kind.identify(picking, kind.Options(method, order, start, width))

    _identify(work, files, columns, out, overwrite, as_json)


@app.command()
def deadzone(
    files: Files,
    columns: Columns = None,
    travel: Annotated[
        tuple[float, float] | None, typer.Option(help="Range of x over which motion counts.")
    ] = None,
    pause: Annotated[float, typer.Option(help="Longer without motion is a stop [s].")] = 0.05,
    gain: Annotated[
        float | None, typer.Option(help="Static gain [x/s/V]: gives a0 and delta of (4.5) too.")
    ] = None,
    width: Annotated[
        float | None, typer.Option(help="Dead zone for that [V].", show_default="the one found")
    ] = None,
    out: Out = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Lowest voltages with steady motion, from runs at constant ones (columns t, u, x)."""

    def work(picking: Picking) -> Result:
        from macromicro.identify.kinds import deadzone as kind

        return kind.identify(picking, kind.Options(travel, pause, gain, width))

    _identify(work, files, columns, out, overwrite, as_json)


@app.command()
def hysteresis(
    files: Files,
    columns: Columns = None,
    curves: Annotated[str, typer.Option(help="auto, ascending or descending.")] = "auto",
    shape: Annotated[
        str, typer.Option(help="Relay density: free, monotone or nonnegative.")
    ] = "monotone",
    smooth: Annotated[float, typer.Option(help="Noise is shorter than this [grid steps].")] = 1.0,
    test: Annotated[list[str] | None, typer.Option(help="A recording to predict.")] = None,
    out: Out = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """A Preisach table from first-order curves (columns u, f, and curve; or over time t)."""

    def work(picking: Picking) -> Result:
        from macromicro.identify.kinds import hysteresis as kind

        return kind.identify(picking, kind.Options(curves, shape, smooth, tuple(test or ())))

    _identify(work, files, columns, out, overwrite, as_json)


@app.command()
def thermal(
    files: Files,
    columns: Columns = None,
    table: Annotated[
        Path | None, typer.Option(help="table.h5 of `identify hysteresis`: positions tell heat.")
    ] = None,
    ambient: Annotated[
        float | None, typer.Option(help="Room [degC].", show_default="first value, or 25")
    ] = None,
    step: Annotated[
        float | None, typer.Option(help="Voltage of the step for the dynamics [V].")
    ] = None,
    out: Out = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Gain and dynamics of heating, from steps (columns t, u, T; or x with --table)."""

    def work(picking: Picking) -> Result:
        from macromicro.identify.kinds import thermal as kind

        return kind.identify(picking, kind.Options(table, ambient, step))

    _identify(work, files, columns, out, overwrite, as_json)


@app.command()
def hall(
    files: Files,
    columns: Columns = None,
    low: Annotated[float, typer.Option(help="First voltage of the table.")] = 0.0,
    high: Annotated[float, typer.Option(help="Last voltage of the table.")] = 5.0,
    points: Annotated[int, typer.Option(help="Voltages in it.")] = 126,
    out: Out = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """A position sensor's table, from slow sweeps both ways (columns v, x)."""

    def work(picking: Picking) -> Result:
        from macromicro.identify.kinds import hall as kind

        return kind.identify(picking, kind.Options(low, high, points))

    _identify(work, files, columns, out, overwrite, as_json)


def _identify(
    work: Callable[[Picking], Result],
    files: list[str],
    columns: list[str] | None,
    out: Path | None,
    overwrite: bool,
    as_json: bool,
) -> None:
    """Read, identify, print, and write to `out` if there is one: all of it or nothing."""
    from macromicro.identify.kinds.loading import picking
    from macromicro.runs import folder
    from macromicro.runs.folder import held

    what = picking(files, columns or [])
    if out is None:
        _work(work, what, None, as_json)
        return
    folder.check(out, NEEDED, overwrite=overwrite, names=NAMES)
    with held(out, overwrite=overwrite, names=NAMES):
        _work(work, what, out, as_json)


def _work(
    work: Callable[[Picking], Result], what: Picking, out: Path | None, as_json: bool
) -> None:
    from macromicro.runs import folder

    # Nothing is open while it computes: a signal then ends the process, compiler and all.
    with Signals():
        found, said = _quietly(lambda: work(what), what.files)
    for text in said:
        print(f"macromicro: {text}", file=sys.stderr)
    found.files, found.warnings = tuple(map(str, what.files)), tuple(said)
    if out is not None:
        with folder.staged(out, NAMES) as place:
            found.save(place)
    if as_json:
        print(found.to_json(), end="")
        return
    show(found)
    if out is not None:
        print(f"results: {out}")


def _quietly(work: Callable[[], Result], files: list[Path]) -> tuple[Result, list[str]]:
    """The result and the warnings as text, each once. What no procedure foresaw in the data
    becomes an `InputError` as well."""
    import numpy as np

    from macromicro.errors import InputError
    from macromicro.schema.text import printable

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            found = work()
        except InputError:
            for text in _texts(caught):
                print(f"macromicro: {text}", file=sys.stderr)
            raise
        except (ArithmeticError, ValueError, np.linalg.LinAlgError) as error:
            where = printable(files[0], 300)
            accepted = "data of the kind that docs/identify.md describes"
            raise InputError(where, f"cannot be fitted: {error}", accepted) from error
    return found, _texts(caught)


def _texts(caught: list[Any]) -> list[str]:
    """Name and message of each warning, once, those of the numbers' library left out."""
    kinds = [w for w in caught if issubclass(w.category, UserWarning)]
    return list(dict.fromkeys(f"{w.category.__name__}: {w.message}" for w in kinds))


def show(result: Result) -> None:
    """The table and the remarks, on stdout."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from macromicro.identify.result import rounded

    console = Console(highlight=False)
    if not console.is_terminal:
        console = Console(highlight=False, width=120)
    console.print(Text(result.title), soft_wrap=True)
    table = Table(box=None, padding=(0, 2, 0, 0), pad_edge=False)
    for heading, side in (("", "left"), ("value", "right"), ("+-", "right"), ("unit", "left")):
        table.add_column(heading, justify="right" if side == "right" else "left")
    noted = any(line.note for line in result.lines)
    if noted:
        table.add_column("")
    for line in result.lines:
        cells = [line.name, *rounded(line.value, line.error), line.unit]
        table.add_row(*(Text(c) for c in [*cells, line.note][: 5 if noted else 4]))
    console.print(table)
    for name, text in result.remarks:
        console.print(Text(f"{name}: {text}"), soft_wrap=True)
