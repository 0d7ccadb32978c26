"""``macromicro serve``: the machine live, for programs (SCPI) and people (a page)."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Sequence
from contextlib import ExitStack, closing, suppress
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import typer

from macromicro.commands.group import check_ports, tell
from macromicro.commands.signals import Signals
from macromicro.serve.hosts import FOLDER, HOST, SCPI_PORT, WEB_PORT

if TYPE_CHECKING:
    from macromicro.serve.listening import Listener
    from macromicro.serve.station import Station

TOKEN = "MACROMICRO_TOKEN"
SWITCH_S = 0.001  # after which a thread that computes lets the others on: stops do not wait
_EARLY = "interrupted; stopping once it has started (again: at once)"


class _Doors(NamedTuple):
    """Host, ports (-1: closed), host names of the page, token, EPICS prefix."""

    host: str
    scpi: int
    web: int
    gcs: int
    names: tuple[str, ...]
    token: str | None
    epics: str | None


def serve(  # noqa: PLR0913, PLR0917 - a parameter for each option
    rig: str = "twin",
    port: str | None = None,
    loop: str | None = None,
    calibration: Path | None = None,
    config: Path | None = None,
    law: str | None = None,
    host: str = HOST,
    scpi: int = SCPI_PORT,
    web: int = WEB_PORT,
    gcs: int = -1,
    name: list[str] | None = None,
    epics: str | None = None,
    record: Path | None = None,
    state: Path | None = None,
    log: Path | None = None,
    seed: int = 0,
) -> None:
    """Run the control loop in real time and serve it.

    Nothing moves at the start. Ctrl-C, SIGTERM and closing the terminal (SIGHUP) make the machine
    safe, then end it. If the environment variable MACROMICRO_TOKEN is set, clients need this token
    for commands. It is required where other computers can connect.
    """
    from macromicro.control.settings import Control
    from macromicro.rig.board.named import board_name
    from macromicro.rig.opening import TWIN
    from macromicro.serve import hosts, persist, storage
    from macromicro.serve.log import Log
    from macromicro.serve.settings import allow_missed_periods, load

    sys.setswitchinterval(SWITCH_S)

    rig = board_name(rig, port, loop, calibration)
    chosen = load(config, law)
    if rig == TWIN:
        chosen = chosen._replace(serve=allow_missed_periods(chosen.serve))
    _check(chosen.rigs(rig), {"--scpi": scpi, "--web": web, "--gcs": gcs}, seed, epics)
    doors = _Doors(host, scpi, web, gcs, hosts.names(host, name or ()), _token(host), epics)
    tell(chosen)
    if state is not None:
        storage.check_state(state)
    else:
        storage.check_state(
            persist.default_path(chosen.place(rig)), "state folder (--state, XDG_STATE_HOME):"
        )
    if record is not None:
        rows = round(chosen.serve.recorder_capacity / chosen.period)
        storage.make_folder(record, rows, columns=chosen.telemetry.columns)
    with Log(log), Signals() as signals:
        signals.later(_EARLY)
        from macromicro.serve import warming
        from macromicro.serve.station import Station

        known = isinstance(chosen.controller, Control) and warming.is_compiled()
        once = "" if known else "; the first time it compiles, about 5 s"
        station, stack = Station(rig, seed=seed, settings=chosen, state=state), ExitStack()
        with stack:
            servers = _Servers(station, doors, record or FOLDER, stack)
            page = servers.open_page()  # at once: it says that the machine starts
            where = f", {page}" if page else ""
            print(f"starting {rig}{where}{once}", file=sys.stderr)
            with station, closing(stack):
                signals.later()
                if not signals.received:
                    print(f"loop: {1.0 / chosen.period:.6g} Hz; {station.realtime}")
                    servers.open_others()
                    if page:
                        print(f"page: {page}")
                    _serve(station, servers, record, signals)
                with suppress(OSError):  # the terminal may be gone
                    print(
                        "stopping: the machine decelerates, then all outputs are switched off",
                        file=sys.stderr,
                    )
    raise typer.Exit(signals.status)


def _check(rigs: Sequence[str], ports: dict[str, int], seed: int, epics: str | None) -> None:
    from macromicro.errors import ProblemError
    from macromicro.rig.opening import TWIN, named
    from macromicro.schema import keys

    for rig in rigs:
        if rig != TWIN:
            named(rig)
    keys.seed(seed, "--seed")
    check_ports(ports)
    if epics is not None:
        from macromicro.serve.epics.server import check_prefix

        check_prefix(epics)
    elif set(ports.values()) == {-1}:
        raise ProblemError(
            "--scpi -1 --web -1", "no port is left for commands", "Open one of the two."
        )


def _token(host: str) -> str | None:
    """The token of the environment; refuses to go on where one is needed and missing."""
    from macromicro.errors import InputError, ProblemError
    from macromicro.serve.hosts import is_loopback, require_token

    token = os.environ.get(TOKEN, "").strip() or None
    if token is None and not is_loopback(host):
        raise ProblemError(
            f"--host {host}",
            "other computers can connect, but no token is set",
            f"Set one in {TOKEN}, or use 127.0.0.1.",
        )
    try:
        require_token(host, token)
    except InputError as error:
        raise error.at(TOKEN) from None
    return token


def _serve(station: Station, servers: _Servers, record: Path | None, signals: Signals) -> None:
    """Accept clients until a signal, and print what the user must know."""
    if record is not None:
        path = record / time.strftime("live-%Y%m%d-%H%M%S.h5")
        station.record(path)
        print(f"recording: {path}")
    print("Ctrl-C ends it", flush=True)
    while not signals.received:
        time.sleep(0.1)
        for server in servers.opened:
            if server.failure is not None:
                raise server.failure


class _Servers:
    """The servers of a station; those opened before one that fails are closed again."""

    def __init__(self, station: Station, doors: _Doors, folder: Path, stack: ExitStack) -> None:
        from macromicro.serve.hosts import Token

        self._station, self._doors, self._folder, self._stack = station, doors, folder, stack
        self._token = Token(doors.token)
        self.opened: list[Listener] = []

    def _open(self, server: Listener) -> tuple[str, int]:
        from macromicro.serve import hosts

        self.opened.append(self._stack.enter_context(server))
        bound, port = server.address
        return hosts.reachable_address(self._doors.host, bound), port

    def open_page(self) -> str:
        """Its address, or "" without a page."""
        doors = self._doors
        if doors.web < 0:
            return ""
        from macromicro.serve import hosts
        from macromicro.serve.web.server import WebServer

        where, names = (doors.host, doors.web), doors.names
        page = WebServer(self._station, *where, self._token, folder=self._folder, names=names)
        return hosts.url(*self._open(page))

    def open_others(self) -> None:
        station, doors, token = self._station, self._doors, self._token
        if doors.scpi >= 0:
            from macromicro.serve.scpi.server import Server

            scpi = Server(station, doors.host, doors.scpi, token=token, folder=self._folder)
            host, port = self._open(scpi)
            print(f"SCPI: {host} port {port}")
        if doors.gcs >= 0:
            from macromicro.serve.gcs.server import GcsServer

            host, port = self._open(GcsServer(station, doors.host, doors.gcs, token=token))
            print(f"GCS: {host} port {port}")
        if doors.epics is not None:
            from macromicro.serve.epics.server import EpicsServer

            records = EpicsServer(station, doors.epics, token)
            self._open(records)
            print(f"EPICS: {records.prefix} at {records.address[0]} port {records.address[1]}")
