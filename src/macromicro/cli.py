"""The command line. Heavy imports stand inside the commands, so help is instant."""

from __future__ import annotations

import signal
from functools import cache
from typing import Annotated, Any

import typer

from macromicro import __version__, threads
from macromicro.commands import config, export, identify, streams
from macromicro.commands.calibrate import calibrate
from macromicro.commands.collect import collect
from macromicro.commands.commission import commission
from macromicro.commands.compare import compare
from macromicro.commands.doctor import doctor
from macromicro.commands.examples import examples
from macromicro.commands.learn import learn
from macromicro.commands.limits import limits
from macromicro.commands.look import look
from macromicro.commands.options import command
from macromicro.commands.plot import plot
from macromicro.commands.reproduce import reproduce
from macromicro.commands.response import response
from macromicro.commands.robust import robust
from macromicro.commands.run import programmes, run
from macromicro.commands.serve import serve
from macromicro.commands.signals import INTERRUPTED
from macromicro.commands.streams import say
from macromicro.commands.sweep import sweep
from macromicro.commands.tune import tune
from macromicro.errors import MacromicroError

app = typer.Typer(
    name="macromicro", no_args_is_help=True, pretty_exceptions_enable=False, rich_markup_mode=None
)


def main() -> int:
    """Run the command line and return its exit status; every error is one message."""
    streams.prepare()
    threads.one_for_blas()
    try:
        command_line()(prog_name="macromicro")
    except MacromicroError as error:
        say(str(error))
        return error.exit_status
    except OSError as error:
        say(_with_file(error))
        return 1
    except KeyboardInterrupt:
        say("interrupted")
        return INTERRUPTED + signal.SIGINT
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else int(end.code is not None)
    return 0


@cache
def command_line() -> Any:
    """All commands with their options, which take a moment to put together."""
    return typer.main.get_command(app)


def _with_file(error: OSError) -> str:
    """The operating system's message and the file that it is about."""
    reason = error.strerror or str(error)
    return f"{error.filename}: {reason}" if error.filename is not None else reason


def _version(asked: bool) -> None:
    if asked:
        print(f"macromicro {__version__}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Design, simulate, identify, tune and run positioners: axes, piezos, wires, two stages."""


for each in (
    run,
    programmes,
    calibrate,
    collect,
    commission,
    compare,
    doctor,
    examples,
    learn,
    limits,
    look,
    plot,
    reproduce,
    response,
    robust,
    serve,
    sweep,
    tune,
):
    command(app)(each)
for group in (config, identify, export):
    app.add_typer(group.app)
