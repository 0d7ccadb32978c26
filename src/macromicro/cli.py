"""The command line. Heavy imports stand inside the commands, so help is instant."""

from __future__ import annotations

import signal
import sys
from functools import cache
from pathlib import Path
from typing import Annotated, Any

import typer

from macromicro import __version__, threads
from macromicro.commands import export, identify, machine_run, performing, streams
from macromicro.commands.calibrate import calibrate
from macromicro.commands.collect import collect
from macromicro.commands.commission import commission
from macromicro.commands.compare import compare
from macromicro.commands.doctor import doctor
from macromicro.commands.examples import examples
from macromicro.commands.group import whole
from macromicro.commands.learn import learn
from macromicro.commands.limits import limits
from macromicro.commands.look import look
from macromicro.commands.options import (
    PNG,
    Calibration,
    Config,
    Fan,
    Figures,
    Json,
    Law,
    Loop,
    Overwrite,
    Port,
    Rig,
    Seed,
    Yes,
    folder_option,
)
from macromicro.commands.plot import plot
from macromicro.commands.reproduce import reproduce
from macromicro.commands.response import response
from macromicro.commands.robust import robust
from macromicro.commands.serve import serve
from macromicro.commands.signals import INTERRUPTED, Signals
from macromicro.commands.sweep import sweep
from macromicro.commands.tune import tune
from macromicro.errors import InputError, MacromicroError, ProblemError

app = typer.Typer(
    name="macromicro",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
config_app = typer.Typer(
    help="Settings of bench, sensors, controller and guard.", no_args_is_help=True
)
app.add_typer(config_app, name="config")
app.add_typer(identify.app, name="identify")
app.add_typer(export.app, name="export")


def main() -> int:
    """Run the command line and return its exit status; every error is one message."""
    streams.prepare()
    threads.one_for_blas()
    try:
        command_line()(prog_name="macromicro")
    except MacromicroError as error:
        _say(str(error))
        return error.exit_status
    except OSError as error:
        _say(_named(error))
        return 1
    except KeyboardInterrupt:
        _say("interrupted")
        return INTERRUPTED + signal.SIGINT
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else int(end.code is not None)
    return 0


@cache
def command_line() -> Any:
    """All commands with their options, which take a moment to put together."""
    return typer.main.get_command(app)


def _say(text: str) -> None:
    print(f"macromicro: {text}", file=sys.stderr)


def _named(error: OSError) -> str:
    """The operating system's message and the file that it is about."""
    reason = error.strerror or str(error)
    return f"{error.filename}: {reason}" if error.filename is not None else reason


def _version(asked: bool) -> None:
    if asked:
        print(f"macromicro {__version__}")
        raise typer.Exit


def _examples() -> list[tuple[str, str]]:
    """Example programmes, for completion in a shell."""
    from macromicro import programme

    return [(name, "example programme") for name in programme.shipped()]


@app.callback()
def options(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_version, is_eager=True, help="Print the version."),
    ] = False,
) -> None:
    """Design, simulate, identify, tune and run positioners: axes, piezos, wires, two stages."""


@app.command()
def run(  # noqa: PLR0913, PLR0917 - a parameter for each option
    programme: Annotated[
        str | None,
        typer.Argument(
            help="A programme (.toml or .csv), or the name of an example.",
            show_default="thesis",
            autocompletion=_examples,
        ),
    ] = None,
    out: Annotated[Path | None, folder_option("results/<programme>")] = None,
    config: Config = None,
    cycles: Annotated[
        int, typer.Option(parser=whole, metavar="N", help="Number of repetitions of the programme.")
    ] = 1,
    fan: Fan = False,
    seed: Seed = 0,
    rig: Rig = "twin",
    port: Port = None,
    loop: Loop = None,
    calibration: Calibration = None,
    law: Law = None,
    yes: Yes = False,
    figures: Figures = PNG,
    as_json: Json = False,
    overwrite: Overwrite = False,
) -> None:
    """Run a motion programme on the simulated machine or on a rig.

    --config names the machine. Without a programme the thesis' integrated test (Chapter 6) runs.
    On replay:FILE nothing moves: controller and guard read the sensors of that recording, to its
    end. On your own rig the command prints what will move and asks first. A settings file with
    machine = "axis" is for one motor-driven axis, machine = "xy" for two with
    coordinated motion (docs/machines.md).
    """
    from macromicro.drawing.files import formats
    from macromicro.rig.board.named import joined
    from macromicro.runs.job import Request

    with Signals() as signals:
        try:
            kinds = formats(figures)
            rig = joined(rig, port, loop, calibration)
            request = Request(programme, out, config, cycles, fan, seed, overwrite, rig, kinds, law)
            performing.perform(request, as_json, yes, signals)
        except KeyboardInterrupt:
            _say("interrupted")
            raise typer.Exit(signals.status) from None


@config_app.command("show")
def config_show(
    key: Annotated[
        str | None, typer.Argument(help="One set or parameter, such as bench.friction.")
    ] = None,
    machine: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="Defaults of this machine, such as axis.", show_default="two_stage"
        ),
    ] = None,
    law: Law = None,
    axis: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="One axis of the machine xy, x or y, as a file of the machine axis.",
            show_default=False,
        ),
    ] = None,
    config: Config = None,
) -> None:
    """Print settings as TOML with units, meaning and source.

    Without a file they are the defaults. With --law MODULE:LAW the gains of that law are included
    as `controller.own`. The tables of the live machine are printed by their names, `live` and
    `serve`.
    """
    if axis is not None:
        for name, value in (("KEY", key), ("--machine", machine), ("--law", law)):
            if value is not None:
                raise ProblemError(name, "not allowed with --axis, which prints a whole axis of xy")
        machine_run.show_axis(config, axis)
        return
    if machine is None and key is not None and key.partition(".")[0] in ("live", "serve"):
        from macromicro.serve.settings import load

        print(load(config, law).tables(key), end="")
        return
    machine_run.show(machine, key, law, config)


@app.command()
def programmes(
    name: Annotated[
        str | None, typer.Argument(help="Print this example.", autocompletion=_examples)
    ] = None,
) -> None:
    """List the example programmes, or print one."""
    from macromicro import programme
    from macromicro.schema.text import printable

    examples = programme.shipped()
    if name is None:
        for each, path in examples.items():
            first = path.read_text(encoding="utf-8").partition("\n")[0]
            print(f"{each:14}{first.lstrip('# ')}")
        return
    if name not in examples:
        raise InputError("programme", printable(name), f"one of {', '.join(examples)}")
    print(examples[name].read_text(encoding="utf-8"), end="")


app.command()(calibrate)
app.command()(collect)
app.command()(commission)
app.command()(compare)
app.command()(doctor)
app.command()(examples)
app.command()(learn)
app.command()(limits)
app.command()(look)
app.command()(plot)
app.command()(reproduce)
app.command()(response)
app.command()(robust)
app.command()(serve)
app.command()(sweep)
app.command()(tune)
