"""``macromicro serve``: the machine live, for programs (SCPI) and people (a page)."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from typing import Annotated

import typer

from macromicro.commands.signals import Signals

TOKEN = "MACROMICRO_TOKEN"
SCPI_PORT, WEB_PORT = 5025, 8080
FOLDER = Path("results/serve")
MAX_SEED = 2**63 - 1


def serve(
    rig: Annotated[
        str, typer.Option(metavar="NAME", help="The twin, or MODULE:FACTORY of your own rig.")
    ] = "twin",
    config: Annotated[
        Path | None,
        typer.Option(
            help="TOML file with units; also the tables [live] and [serve].", show_default=False
        ),
    ] = None,
    host: Annotated[str, typer.Option(help="Address to listen at.")] = "127.0.0.1",
    scpi: Annotated[int, typer.Option(metavar="PORT", help="SCPI; -1 for none.")] = SCPI_PORT,
    web: Annotated[int, typer.Option(metavar="PORT", help="The page; -1 for none.")] = WEB_PORT,
    record: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Record from the start, into this folder.",
            show_default=f"when a client asks, into {FOLDER}",
        ),
    ] = None,
    state: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Where position and trust are kept between runs.",
            show_default="one for each rig, in your state folder",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(metavar="N", help="Seed of the twin's noise.")] = 0,
) -> None:
    """Run the control loop at 1000 Hz against the clock, and serve it until Ctrl-C.

    A token in the environment variable MACROMICRO_TOKEN is asked of whoever gives orders; it
    is needed where others than this computer can connect. Nothing moves at the start.
    """
    from macromicro.errors import InputError
    from macromicro.serve import settings

    if not 0 <= seed <= MAX_SEED:
        raise InputError("--seed", seed, f"a whole number from 0 to {MAX_SEED}")
    for name, port in (("--scpi", scpi), ("--web", web)):
        if not -1 <= port <= 65535:
            raise InputError(name, port, "a port from 1 to 65535, 0 for any free one, -1 for none")
    if scpi == web == -1:
        raise InputError("--scpi -1 --web -1", "nobody could give orders", "a port for one of them")
    token = _token(host)
    chosen = settings.load(config) if config is not None else settings.LiveSettings()
    with Signals() as signals:
        signals.later()
        _serve(rig, chosen, (host, scpi, web), (token, record, state, seed), signals)


def _token(host: str) -> str | None:
    """The token of the environment; InputError where one is needed and there is none."""
    from macromicro.errors import InputError
    from macromicro.serve.hosts import is_loopback

    token = os.environ.get(TOKEN, "").strip() or None
    if token is None and not is_loopback(host):
        raise InputError(
            f"--host {host}", "others can connect", f"a token in {TOKEN}, or 127.0.0.1"
        )
    return token


def _serve(
    rig: str,
    chosen: object,
    where: tuple[str, int, int],
    how: tuple[str | None, Path | None, Path | None, int],
    signals: Signals,
) -> None:
    from contextlib import ExitStack

    from macromicro.serve.settings import LiveSettings
    from macromicro.serve.station import Station

    assert isinstance(chosen, LiveSettings)
    host, scpi, web = where
    token, record, state, seed = how
    folder = record or FOLDER
    print(f"starting {rig}; the first time it compiles, about 15 s", file=sys.stderr)
    with ExitStack() as stack:
        station = Station(rig, seed=seed, settings=chosen, state=state)
        stack.enter_context(station)
        print(f"loop: 1000 Hz; {station.realtime}")
        if scpi >= 0:
            from macromicro.serve.scpi.server import Server

            server = Server(station, host, scpi, token=token, folder=folder)
            stack.enter_context(server)
            print(f"SCPI: {server.address[0]} port {server.address[1]}")
        page = None
        if web >= 0:
            from macromicro.serve.web.server import WebServer

            page = WebServer(station, host, web, token, folder=folder)
            stack.enter_context(page)
            print(f"page: {page.url}")
        if record is not None:
            record.mkdir(parents=True, exist_ok=True)
            name = record / time.strftime("live-%Y%m%d-%H%M%S.h5")
            station.record(name)
            print(f"recording: {name}")
        print("Ctrl-C ends it", flush=True)
        while not signals.received:
            time.sleep(0.1)
            if page is not None and page.failure is not None:
                raise page.failure
        print("stopping: the machine decelerates, outputs go safe", file=sys.stderr)
    raise typer.Exit(signals.status)
