"""``macromicro identify KIND FILE ...``: the commands, their options and their output."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from macromicro.commands.group import Group
from macromicro.commands.signals import Signals
from macromicro.commands.streams import warned

if TYPE_CHECKING:
    from macromicro.identify.picking import Picking

app = typer.Typer(
    cls=Group,
    help=(
        "Identify a model from measured data. It reads recordings, "
        "text, MAT, HDF5, Parquet and MicroMag files."
    ),
    no_args_is_help=True,
    rich_markup_mode=None,
)

Files = Annotated[list[str], typer.Argument(metavar="FILE", help="One file or several.")]
Columns = Annotated[
    list[str] | None,
    typer.Option(metavar="NAME=COLUMN", help="Meaning of a column, such as x=position_mm:mm."),
]
Rate = Annotated[
    str | None, typer.Option(metavar="HZ", help="Rows per second, where no column holds times.")
]
Join = Annotated[bool, typer.Option("--join", help="The files are one record, with a clock each.")]
Out = Annotated[Path | None, typer.Option(help="Folder for figures, result.json, model.toml.")]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace results in that folder.")]
Test = Annotated[
    list[str] | None,
    typer.Option(help="Validation data that is not fitted: one record or several."),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print only the result, as JSON.")]
NEEDED = 20_000_000
CUT_SHORT = "interrupted: the search had not ended; values are the best so far, errors are theirs"


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def _whole(text: str | None) -> int | str | None:
    return int(text) if text is not None and text.lstrip("+-").isdecimal() else text


@app.command()
def drive(  # noqa: PLR0913, PLR0917 -- one parameter per option
    files: Files,
    columns: Columns = None,
    rate: Rate = None,
    join: Join = False,
    gain: Annotated[
        float | None, typer.Option(help="Force per unit of u, such as N/V.", show_default="1")
    ] = None,
    structure: Annotated[
        str,
        typer.Option(help="auto, viscous, coulomb, asymmetric, stribeck, full; lugre or gms."),
    ] = "auto",
    along: Annotated[
        int | None,
        typer.Option(
            help="For lugre and gms: nodes of the friction along the travel.", show_default="auto"
        ),
    ] = None,
    limit: Annotated[float | None, typer.Option(help="The drive saturates at +-LIMIT.")] = None,
    delay: Annotated[
        str | None,
        typer.Option(
            metavar="<int>|fit",
            help="Delay of u in samples, or fit: identified with the parameters.",
            show_default="0",
        ),
    ] = None,
    spring: Annotated[bool, typer.Option("--spring", help="The load is on a spring.")] = False,
    dead_zone: Annotated[
        bool, typer.Option("--dead-zone", help="The drive has a dead zone at small u.")
    ] = False,
    eccentric: Annotated[
        bool, typer.Option("--eccentric", help="Gravity acts on a rotating load (x an angle).")
    ] = False,
    endless: Annotated[
        bool,
        typer.Option(
            "--endless", help="Continuous rotation: the model has no end stops (x an angle)."
        ),
    ] = False,
    free: Annotated[
        bool, typer.Option("--free", help="Free decay without a drive (columns t, x).")
    ] = False,
    machine: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help=(
                "Machine file of a data sheet: model.toml takes its limits and "
                "adds the identified values."
            ),
        ),
    ] = None,
    test: Test = None,
    out: Out = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Mass and friction of an axis (columns t, u, x, or v: a speed)."""
    options = {
        "gain": gain,
        "structure": structure,
        "along": along,
        "limit": limit,
        "delay": _whole(delay),
        "tests": tuple(test or ()),
        "spring": spring,
        "dead_zone": dead_zone,
        "eccentric": eccentric,
        "endless": endless,
        "free": free,
    }
    _identify(
        "drive", options, files, _timed(columns, rate), out, overwrite, as_json, machine, join
    )


@app.command()
def carriage(
    files: Files,
    columns: Columns = None,
    rate: Rate = None,
    pitch: Annotated[
        str | None, typer.Option(help="Travel per count, such as 71.4um.", show_default="by y")
    ] = None,
    test: Test = None,
    out: Out = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Model for the law `terminal` (columns t, u, x; y, a laser).

    The record consists of strokes, with x in counts.
    """
    print("identifying the carriage: about a minute", file=sys.stderr)
    options = {"pitch": pitch, "tests": tuple(test or ())}
    _identify("carriage", options, files, _timed(columns, rate), out, overwrite, as_json)


@app.command()
def actuator(  # noqa: PLR0913, PLR0917 -- one parameter per option
    files: Files,
    columns: Columns = None,
    rate: Rate = None,
    table: Annotated[
        Path | None, typer.Option(metavar="FILE", help="table.h5 of `identify hysteresis`.")
    ] = None,
    ambient: Annotated[
        float | None, typer.Option(help="Room temperature [degC].", show_default="25")
    ] = None,
    austenite: Annotated[
        float | None,
        typer.Option(
            help="Without --table: temperature of half contraction [degC].", show_default="80"
        ),
    ] = None,
    test: Test = None,
    out: Out = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """An actuator from heatings (columns t, u, x; y, c).

    With --table the result is for the law `inverse`.
    """
    about = "a minute or two" if table is None else "half a minute"
    print(f"identifying the actuator: about {about}", file=sys.stderr)
    options = {
        "table": table,
        "ambient": ambient,
        "austenite": austenite,
        "tests": tuple(test or ()),
    }
    _identify("actuator", options, files, _timed(columns, rate), out, overwrite, as_json)


@app.command()
def linear(  # noqa: PLR0913, PLR0917 -- one parameter per option
    files: Files,
    columns: Columns = None,
    rate: Rate = None,
    join: Join = False,
    method: Annotated[
        str, typer.Option(help="output_error, box_jenkins, mls, sriv, gls or least_squares.")
    ] = "output_error",
    order: Annotated[str, typer.Option(help="Orders of a and b, and the delay.")] = "1,1,1",
    start: Annotated[str, typer.Option(help="Records start at rest, or free.")] = "rest",
    width: Annotated[
        float, typer.Option(help="Dead zone, subtracted from the magnitude of u.")
    ] = 0.0,
    offset: Annotated[
        float | None,
        typer.Option(help="Constant of the output, in its unit.", show_default="found"),
    ] = None,
    test: Test = None,
    out: Out = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """A discrete linear model (columns t, u and y, or x).

    A position x is differentiated."""
    options = {
        "method": method,
        "order": order,
        "start": start,
        "width": width,
        "offset": offset,
        "tests": tuple(test or ()),
    }
    _identify("linear", options, files, _timed(columns, rate), out, overwrite, as_json, join=join)


@app.command()
def deadzone(  # noqa: PLR0913, PLR0917 -- one parameter per option
    files: Files,
    columns: Columns = None,
    rate: Rate = None,
    travel: Annotated[
        tuple[float, float] | None, typer.Option(help="Range of x over which motion counts.")
    ] = None,
    pause: Annotated[float, typer.Option(help="A longer standstill counts as a stop [s].")] = 0.05,
    gain: Annotated[
        float | None, typer.Option(help="Static gain [x/s/V], for a0 and delta of (4.5).")
    ] = None,
    width: Annotated[
        float | None, typer.Option(help="Dead zone for these [V].", show_default="the one found")
    ] = None,
    test: Test = None,
    out: Out = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Lowest voltages with steady motion (columns t, u, x).

    They come from runs at constant voltages.
    """
    options = {
        "travel": travel,
        "pause": pause,
        "gain": gain,
        "width": width,
        "tests": tuple(test or ()),
    }
    _identify("deadzone", options, files, _timed(columns, rate), out, overwrite, as_json)


@app.command()
def hysteresis(  # noqa: PLR0913, PLR0917 -- one parameter per option
    files: Files,
    columns: Columns = None,
    curves: Annotated[str, typer.Option(help="auto, ascending or descending.")] = "auto",
    shape: Annotated[
        str, typer.Option(help="Relay density: free, monotone or nonnegative.")
    ] = "monotone",
    smooth: Annotated[
        str, typer.Option(help="Smoothing length [grid steps]; auto: by cross-validation.")
    ] = "1",
    between: Annotated[
        str,
        typer.Option(
            help=(
                "Interpolation between curves: along the input, or along the "
                "output for steep branches; auto: by cross-validation."
            )
        ),
    ] = "input",
    drift: Annotated[
        bool,
        typer.Option("--drift", help="Scale each curve of a MicroMag file by its calibration."),
    ] = False,
    test: Test = None,
    out: Out = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """A Preisach table from first-order curves (columns u, f).

    The curves are separated by a column curve, or lie along time t. FILE may be a table.h5 or
    table.csv of this command: it predicts the files of --test.
    """
    options = {
        "curves": curves,
        "shape": shape,
        "smooth": _number(smooth),
        "between": between,
        "tests": tuple(test or ()),
        "drift": drift,
    }
    _identify("hysteresis", options, files, columns, out, overwrite, as_json)


@app.command()
def stress(
    files: Files,
    columns: Columns = None,
    test: Test = None,
    out: Out = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Transformation temperatures by load (columns T, x, load).

    They come from cycles at several loads.
    """
    _identify("stress", {"tests": tuple(test or ())}, files, columns, out, overwrite, as_json)


@app.command()
def thermal(  # noqa: PLR0913, PLR0917 -- one parameter per option
    files: Files,
    columns: Columns = None,
    rate: Rate = None,
    table: Annotated[
        Path | None,
        typer.Option(help=("table.h5 of `identify hysteresis`, to infer heat from positions.")),
    ] = None,
    ambient: Annotated[
        float | None,
        typer.Option(help="Room temperature [degC].", show_default="first value, or 25"),
    ] = None,
    step: Annotated[
        float | None, typer.Option(help="Voltage of the step for the dynamics [V].")
    ] = None,
    test: Test = None,
    out: Out = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Gain and dynamics of heating (columns t, u, T or x).

    They come from steps. A column x needs --table.
    """
    options = {"table": table, "ambient": ambient, "step": step, "tests": tuple(test or ())}
    _identify("thermal", options, files, _timed(columns, rate), out, overwrite, as_json)


@app.command()
def hall(  # noqa: PLR0913, PLR0917 -- one parameter per option
    files: Files,
    columns: Columns = None,
    low: Annotated[float, typer.Option(help="First voltage of the table.")] = 0.0,
    high: Annotated[float, typer.Option(help="Last voltage of the table.")] = 5.0,
    points: Annotated[int, typer.Option(help="Number of voltages in the table.")] = 126,
    method: Annotated[str, typer.Option(help="mean or spline.")] = "mean",
    test: Test = None,
    out: Out = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """A position sensor's table (columns v, x).

    It comes from slow sweeps in both directions.
    """
    table = {"low": low, "high": high, "points": points, "method": method}
    options = table | {"tests": tuple(test or ())}
    _identify("hall", options, files, columns, out, overwrite, as_json)


@app.command()
def plays(
    files: Files,
    columns: Columns = None,
    count: Annotated[
        int,
        typer.Option(
            "--plays", help=("Number of play operators, including the one without a threshold.")
        ),
    ] = 16,
    rate: Annotated[
        bool, typer.Option("--rate", help="The loop depends on the rate (column t).")
    ] = False,
    test: Test = None,
    out: Out = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Play operators of a loop, such as a piezo's (columns u, f).

    The loop is measured over time and must not saturate.
    """
    options = {"plays": count, "tests": tuple(test or ()), "rate": rate}
    _identify("plays", options, files, columns, out, overwrite, as_json)


def _timed(columns: list[str] | None, rate: str | None) -> list[str]:
    """The columns, with a rate in place of that of times."""
    if rate is None:
        return columns or []
    from macromicro.errors import InputError
    from macromicro.identify.picking import hertz
    from macromicro.schema.text import printable

    text = f"{rate} Hz" if rate.replace(".", "").isdecimal() else rate
    if not hertz(text):
        raise InputError("--rate", printable(rate), "rows per second, such as 200 or 1kHz")
    return [*(columns or []), f"t={text}"]


def _identify(
    kind: str,
    options: dict[str, Any],
    files: list[str],
    columns: list[str] | None,
    out: Path | None,
    overwrite: bool,
    as_json: bool,
    machine: Path | None = None,
    join: bool = False,
) -> None:
    """Read, identify, print, and write to `out` if given: all of it or nothing."""
    from macromicro.errors import ProblemError
    from macromicro.identify.picking import picking
    from macromicro.identify.result import NAMES
    from macromicro.runs import folder
    from macromicro.runs.folder import held

    what = picking(files, columns or [])._replace(join=join)
    if out is None:
        if overwrite:
            raise ProblemError("--overwrite", "only with --out")
        _work(kind, options, what, None, as_json, machine)
        return
    folder.check(out, NEEDED, overwrite=overwrite, names=NAMES)
    with held(out, overwrite=overwrite, names=NAMES):
        _work(kind, options, what, out, as_json, machine)


def _work(
    kind: str,
    options: dict[str, Any],
    what: Picking,
    out: Path | None,
    as_json: bool,
    machine: Path | None,
) -> None:
    from macromicro.identify.kinds import drive_file, fitted
    from macromicro.identify.result import NAMES
    from macromicro.identify.search import until
    from macromicro.machines import identified
    from macromicro.runs import folder

    with Signals() as signals:
        known = None if machine is None else identified.sheet(machine)
        signals.later("ending with the best fit so far; Ctrl-C again ends without a result")
        with until(lambda: signals.received), warned() as said:
            found = fitted(kind, what, **options)
        found.warnings = tuple(said)
        if signals.received:
            found.warnings += (CUT_SHORT,)
        if known is not None:
            found.toml = identified.merged(found, known)
            words = f"identified mass and friction, all else from {known.file}"
            found.remarks = [r for r in found.remarks if r[0] not in drive_file.ABOUT]
            found.remarks.append(("model.toml", words))
    if out is not None:
        with folder.staged(out, NAMES) as place:
            found.save(place)
    if as_json:
        print(found.to_json(), end="")
    else:
        found.show()
        if out is not None:
            print(f"results: {out}")
    if signals.received:
        print(f"macromicro: {CUT_SHORT}", file=sys.stderr)
        raise typer.Exit(signals.status)
    if not found.holds:
        raise typer.Exit(1)
