"""``macromicro identify KIND FILE ...``: the commands, their options and their output."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args, get_type_hints

import typer

from macromicro.commands.calibrate import calibrate
from macromicro.commands.group import Group
from macromicro.commands.options import command, with_words
from macromicro.commands.signals import Signals
from macromicro.commands.streams import printing_warnings, say
from macromicro.identify import options

if TYPE_CHECKING:
    from macromicro.identify.picking import Picking

app = typer.Typer(
    name="identify",
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
_BEFORE = ("files", "columns", "rate", "join")  # of the options of every kind, those before its own


def _common(
    files: list[str],
    columns: list[str] | None = None,
    rate: str | None = None,
    join: bool = False,
    machine: Path | None = None,
    test: list[str] | None = None,
    out: Path | None = None,
    overwrite: bool = False,
    as_json: bool = False,
) -> None:
    """The options of every kind, except that only some have `rate`, `join` and `machine`."""


def _kind(*some: str) -> Callable[[Callable[..., None]], None]:
    """Add the command of a kind of model, with `some` of the options that not all kinds have.

    The decorated function says beforehand what takes long, from options of the kind that it names.
    The options of the kind stand between those of every kind.
    """

    def add(declared: Callable[..., None]) -> None:
        name = declared.__name__
        own, told = _options(name), inspect.signature(declared).parameters
        others = {"rate", "join", "machine"} - set(some)
        shared = [par for par in with_words(_common, "identify").values() if par.name not in others]
        before = [par for par in shared if par.name in _BEFORE]

        def command(**given: Any) -> None:
            options = {each: given.pop(each) for each in own}
            declared(**{each: options[each] for each in told})
            _identify(name, options, given)

        command.__doc__ = declared.__doc__
        every = [*before, *own.values(), *shared[len(before) :]]
        command.__signature__ = inspect.Signature(every)  # type: ignore[attr-defined]
        app.command(name)(command)

    return add


def _options(kind: str) -> dict[str, inspect.Parameter]:
    """The options of a kind of model as the command line takes them."""
    fields = getattr(options, kind.capitalize())
    found = {}
    for name, hint in get_type_hints(fields, include_extras=True).items():
        if name == "tests":  # beside those of every kind
            continue
        of, said = get_args(hint)
        words = (f"--{name.replace('_', '-')}",) if of is bool else ()
        default = fields._field_defaults[name]
        option = typer.Option(
            *words,
            help=said.help,
            show_default=said.default or True,
            metavar=said.metavar,
            parser=said.parse,
        )
        typed = Annotated[str | None if said.parse else of, option]  # type: ignore[valid-type]
        par = inspect.Parameter.POSITIONAL_OR_KEYWORD
        found[name] = inspect.Parameter(name, par, default=default, annotation=typed)
    return found


@_kind("rate", "join", "machine")
def drive() -> None:
    """Mass and friction of an axis (columns t, u, x, or v: a speed)."""


@_kind("rate")
def carriage() -> None:
    """Model for the law `terminal` (columns t, u, x; y, a laser).

    The record consists of strokes, with x in counts.
    """
    print("identifying the carriage: about a minute", file=sys.stderr)


@_kind("rate")
def actuator(table: Path | None = None) -> None:
    """An actuator from heatings (columns t, u, x; y, c).

    With --table the result is for the law `inverse`.
    """
    about = "a minute or two" if table is None else "half a minute"
    print(f"identifying the actuator: about {about}", file=sys.stderr)


@_kind("rate", "join")
def linear() -> None:
    """A discrete linear model (columns t, u and y, or x).

    A position x is differentiated."""


@_kind("rate")
def deadzone() -> None:
    """Lowest voltages with steady motion (columns t, u, x).

    They come from runs at constant voltages.
    """


@_kind()
def hysteresis() -> None:
    """A Preisach table from first-order curves (columns u, f).

    The curves are separated by a column curve, or lie along time t. FILE may be a table.h5 or
    table.csv of this command: it predicts the files of --test.
    """


@_kind()
def stress() -> None:
    """Transformation temperatures by load (columns T, x, load).

    They come from cycles at several loads.
    """


@_kind("rate")
def thermal() -> None:
    """Gain and dynamics of heating (columns t, u, T or x).

    They come from steps. A column x needs --table.
    """


@_kind()
def hall() -> None:
    """A position sensor's table (columns v, x).

    It comes from slow sweeps in both directions.
    """


@_kind()
def plays() -> None:
    """Play operators of a loop, such as a piezo's (columns u, f).

    The loop is measured over time and must not saturate.
    """


@command(app)
def calibration(
    readings: Path,
    machine: Path,
    period: list[str] | None = None,
    out: Path | None = None,
    overwrite: bool = False,
    as_json: bool = False,
) -> None:
    """A stage's corrections (columns position, direction, error).

    They come from another instrument, with units in the headings, such as error_um. A temperature
    may follow. It writes the calibration.toml that `calibrate` writes, without a verification.
    """
    calibrate(
        machine, readings=readings, period=period, out=out, overwrite=overwrite, as_json=as_json
    )


def _with_rate(columns: list[str] | None, rate: str | None) -> list[str]:
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
    from macromicro.runs.folder import locked

    options["tests"] = tuple(given["test"] or ())
    columns = _with_rate(given["columns"], given.get("rate"))
    what = picking(given["files"], columns)._replace(join=given.get("join", False))
    out, overwrite, as_json = given["out"], given["overwrite"], given["as_json"]
    if out is None:
        if overwrite:
            raise ProblemError("--overwrite", "only with --out")
        _work(kind, options, what, None, as_json, given.get("machine"))
        return
    folder.check(out, NEEDED, overwrite=overwrite, names=NAMES)
    with locked(out, overwrite=overwrite, names=NAMES):
        _work(kind, options, what, out, as_json, given.get("machine"))


def _work(
    kind: str,
    options: dict[str, Any],
    what: Picking,
    out: Path | None,
    as_json: bool,
    machine: Path | None,
) -> None:
    from macromicro.identify.kinds import drive_report, fit
    from macromicro.identify.result import NAMES
    from macromicro.identify.search import until
    from macromicro.machines import identified
    from macromicro.runs import folder

    with Signals() as signals:
        known = None if machine is None else identified.sheet(machine)
        signals.later("ending with the best fit so far; Ctrl-C again ends without a result")
        with until(lambda: signals.received), printing_warnings() as said:
            found = fit(kind, what, **options)
        found.warnings = tuple(said)
        if signals.received:
            found.warnings += (CUT_SHORT,)
        if known is not None:
            found.toml = identified.merge(found, known)
            words = f"identified mass and friction, all else from {known.file}"
            found.remarks = [r for r in found.remarks if r[0] not in drive_report.ABOUT]
            found.remarks.append(("model.toml", words))
    if out is not None:
        with folder.staging(out, NAMES) as place:
            found.save(place)
    if as_json:
        print(found.to_json(), end="")
    else:
        found.show()
        if out is not None:
            print(f"results: {out}")
    if signals.received:
        say(CUT_SHORT)
        raise typer.Exit(signals.status)
    if not found.holds:
        raise typer.Exit(1)
