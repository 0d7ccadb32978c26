"""``macromicro identify KIND FILE ...``: the commands, their options and their output."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from macromicro.commands.calibrate import OUT, Period, calibrate
from macromicro.commands.group import Group
from macromicro.commands.options import Json, Overwrite, folder_option
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

NEEDED = 20_000_000
CUT_SHORT = "interrupted: the search had not ended; values are the best so far, errors are theirs"


def _common(
    files: Annotated[list[str], typer.Argument(metavar="FILE", help="One file or several.")],
    columns: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=COLUMN", help="Meaning of a column, such as x=position_mm:mm."),
    ] = None,
    rate: Annotated[
        str | None, typer.Option(metavar="HZ", help="Rows per second, where no column holds times.")
    ] = None,
    join: Annotated[
        bool, typer.Option("--join", help="The files are one record, with a clock each.")
    ] = False,
    test: Annotated[
        list[str] | None,
        typer.Option(help="Validation data that is not fitted: one record or several."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for figures, result.json, model.toml.")
    ] = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> None:
    """The options of every kind; only kinds with times have a rate, some join files."""


def _kind(*, timed: bool = False, join: bool = False) -> Callable[[Callable[..., None]], None]:
    """Add the command of a kind of model.

    The decorated function declares the options of the kind alone, under the names that its search
    gives them, and says beforehand what takes long. The options of every kind stand around them.
    """

    def add(declared: Callable[..., None]) -> None:
        shared = dict(inspect.signature(_common, eval_str=True).parameters)
        own = inspect.signature(declared, eval_str=True).parameters
        if not timed:
            del shared["rate"]
        if not join:
            del shared["join"]
        last = [shared.pop(name) for name in ("test", "out", "overwrite", "as_json")]

        def command(**given: Any) -> None:
            options = {name: given.pop(name) for name in own}
            declared(**options)
            _identify(declared.__name__, options, given)

        command.__doc__ = declared.__doc__
        every = [*shared.values(), *own.values(), *last]
        command.__signature__ = inspect.Signature(every)  # type: ignore[attr-defined]
        app.command(declared.__name__)(command)

    return add


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def _whole(text: str) -> int | str:
    return int(text) if text.lstrip("+-").isdecimal() else text


@_kind(timed=True, join=True)
def drive(  # noqa: PLR0913, PLR0917 -- one parameter per option
    gain: Annotated[
        float | None, typer.Option(help="Force per unit of u, such as N/V.", show_default="1")
    ] = None,
    structure: Annotated[
        str, typer.Option(help="auto, viscous, coulomb, asymmetric, stribeck, full; lugre or gms.")
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
            parser=_whole,
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
) -> None:
    """Mass and friction of an axis (columns t, u, x, or v: a speed)."""


@_kind(timed=True)
def carriage(
    pitch: Annotated[
        str | None, typer.Option(help="Travel per count, such as 71.4um.", show_default="by y")
    ] = None,
) -> None:
    """Model for the law `terminal` (columns t, u, x; y, a laser).

    The record consists of strokes, with x in counts.
    """
    print("identifying the carriage: about a minute", file=sys.stderr)


@_kind(timed=True)
def actuator(
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
) -> None:
    """An actuator from heatings (columns t, u, x; y, c).

    With --table the result is for the law `inverse`.
    """
    about = "a minute or two" if table is None else "half a minute"
    print(f"identifying the actuator: about {about}", file=sys.stderr)


@_kind(timed=True, join=True)
def linear(
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
) -> None:
    """A discrete linear model (columns t, u and y, or x).

    A position x is differentiated."""


@_kind(timed=True)
def deadzone(
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
) -> None:
    """Lowest voltages with steady motion (columns t, u, x).

    They come from runs at constant voltages.
    """


@_kind()
def hysteresis(
    curves: Annotated[str, typer.Option(help="auto, ascending or descending.")] = "auto",
    shape: Annotated[
        str, typer.Option(help="Relay density: free, monotone or nonnegative.")
    ] = "monotone",
    smooth: Annotated[
        str,
        typer.Option(
            parser=_number, help="Smoothing length [grid steps]; auto: by cross-validation."
        ),
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
) -> None:
    """A Preisach table from first-order curves (columns u, f).

    The curves are separated by a column curve, or lie along time t. FILE may be a table.h5 or
    table.csv of this command: it predicts the files of --test.
    """


@_kind()
def stress() -> None:
    """Transformation temperatures by load (columns T, x, load).

    They come from cycles at several loads.
    """


@_kind(timed=True)
def thermal(
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
) -> None:
    """Gain and dynamics of heating (columns t, u, T or x).

    They come from steps. A column x needs --table.
    """


@_kind()
def hall(
    low: Annotated[float, typer.Option(help="First voltage of the table.")] = 0.0,
    high: Annotated[float, typer.Option(help="Last voltage of the table.")] = 5.0,
    points: Annotated[int, typer.Option(help="Number of voltages in the table.")] = 126,
    method: Annotated[str, typer.Option(help="mean or spline.")] = "mean",
) -> None:
    """A position sensor's table (columns v, x).

    It comes from slow sweeps in both directions.
    """


@_kind()
def plays(
    plays: Annotated[
        int, typer.Option(help="Number of play operators, including the one without a threshold.")
    ] = 16,
    rate: Annotated[
        bool, typer.Option("--rate", help="The loop depends on the rate (column t).")
    ] = False,
) -> None:
    """Play operators of a loop, such as a piezo's (columns u, f).

    The loop is measured over time and must not saturate.
    """


@app.command()
def calibration(
    readings: Annotated[
        Path, typer.Argument(metavar="FILE", help="Readings (CSV).", show_default=False)
    ],
    machine: Annotated[
        Path, typer.Option(metavar="FILE", help="Machine file.", show_default=False)
    ],
    period: Period = None,
    out: Annotated[Path | None, folder_option(OUT)] = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> None:
    """A stage's corrections (columns position, direction, error).

    They come from another instrument, with units in the headings, such as error_um. A temperature
    may follow. It writes the calibration.toml that `calibrate` writes, without a verification.
    """
    calibrate(
        machine,
        readings=readings,
        period=period,
        out=out,
        overwrite=overwrite,
        as_json=as_json,
    )


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


def _identify(kind: str, options: dict[str, Any], given: dict[str, Any]) -> None:
    """Read, identify, print, and write to `--out` if given: all of it or nothing."""
    from macromicro.errors import ProblemError
    from macromicro.identify.picking import picking
    from macromicro.identify.result import NAMES
    from macromicro.runs import folder
    from macromicro.runs.folder import held

    machine = options.pop("machine", None)
    options["tests"] = tuple(given["test"] or ())
    columns = _timed(given["columns"], given.get("rate"))
    what = picking(given["files"], columns)._replace(join=given.get("join", False))
    out, overwrite, as_json = given["out"], given["overwrite"], given["as_json"]
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
    from macromicro.identify.kinds import drive_report, fitted
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
            found.remarks = [r for r in found.remarks if r[0] not in drive_report.ABOUT]
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
