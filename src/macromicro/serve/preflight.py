"""Checks of the server's rig, files and address."""

from __future__ import annotations

import os
import shutil
import socket
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from macromicro.errors import InputError, MacromicroError
from macromicro.nominal import PERIOD
from macromicro.recording_format import needed_bytes
from macromicro.rig.opening import TWIN, named
from macromicro.serve import health, hosts, persist, storage
from macromicro.serve.health import FAIL, OK, WARN, Finding, unwritable
from macromicro.serve.hosts import FOLDER, HOST, SCPI_PORT, WEB_PORT
from macromicro.serve.settings import ServeSettings
from macromicro.serve.shared import COLUMNS

_LITTLE, _TOO_LITTLE = 1e9, 1e8


class Asked(NamedTuple):
    """What the server will use."""

    rigs: tuple[str, ...]
    state: Path
    host: str = HOST
    ports: Mapping[int, str] = {SCPI_PORT: "SCPI", WEB_PORT: "web page"}
    record: Path = FOLDER
    period: float = PERIOD


def findings(asked: Asked, settings: ServeSettings) -> Iterator[Finding]:
    """All checks in order of importance."""
    for name in asked.rigs:
        yield rig(name)
    yield health.python()
    yield from health.packages(health.constraints())
    yield from health.extras()
    yield health.compiler_cache()
    yield health.cores()
    yield health.realtime(settings.priority)
    yield from health.clock()
    yield health.shared_memory()
    yield state_file(asked.state)
    yield recording_folder(asked.record)
    yield from disk({"recordings": asked.record, "position": asked.state.parent}, asked.period)
    yield address(asked.host)
    for port, what in asked.ports.items():
        yield free_port(port, what, asked.host)
    yield health.browser()


def rig(name: str) -> Finding:
    """Whether the rig exists; its factory is imported, not called."""
    if name == TWIN:
        return Finding("rig", OK, "twin")
    try:
        named(name).check()
    except InputError as error:
        return Finding("rig", FAIL, error.found, error.accepted)
    except Exception as error:  # whatever the user's module does when it is imported
        return Finding("rig", FAIL, f"{name}: {type(error).__name__}: {error}", "fix the module")
    return Finding("rig", OK, f"{name}: found, not opened")


def state_file(path: Path) -> Finding:
    """Whether the position can be saved and no other server has the machine."""
    refusal = unwritable(path.parent)
    try:
        refusal = refusal or storage.kind(path)
    except OSError as error:
        refusal = error.strerror or str(error)
    if refusal:
        remedy = "a file that can be written, by --state or XDG_STATE_HOME; nothing moves otherwise"
        return Finding("position file", FAIL, f"{path}: {refusal}", remedy)
    if not path.with_name(f"{path.name}.lock").exists():
        return Finding("position file", OK, f"{path}: does not exist yet")
    lock = persist.Lock(path)
    try:
        lock.take()
    except (MacromicroError, OSError) as error:
        return Finding("position file", WARN, str(error), "none if intended")
    lock.drop()
    return Finding("position file", OK, f"{path}: no server uses it now")


def recording_folder(folder: Path) -> Finding:
    refusal = unwritable(folder)
    if refusal:
        remedy = "a folder that can be written to, by --record; nothing is recorded otherwise"
        return Finding("recording folder", FAIL, f"{folder}: {refusal}", remedy)
    return Finding("recording folder", OK, str(folder))


def disk(folders: Mapping[str, Path], period: float = PERIOD) -> Iterator[Finding]:
    second = (needed_bytes(COLUMNS, 10_000) - needed_bytes(COLUMNS, 0)) / 10_000 / period
    for what, place in folders.items():
        folder = place
        while not folder.exists() and folder != folder.parent:
            folder = folder.parent
        free = shutil.disk_usage(folder).free
        found = f"{folder}: {free / 1e9:.1f} GB free"
        if what == "recordings":
            found += f", {free / second / 3600.0:.0f} h of recording"
        state = OK if free >= _LITTLE else WARN if free >= _TOO_LITTLE else FAIL
        yield Finding(f"disk, {what}", state, found, "" if state == OK else "free disk space")


def address(host: str) -> Finding:
    try:
        _resolved(host, 0)
    except OSError as error:
        remedy = "an address of this computer, such as 127.0.0.1, or a name of it"
        return Finding("address", FAIL, f"{host}: {error.strerror}", remedy)
    if hosts.is_loopback(host):
        return Finding("address", OK, f"{host}: this computer only")
    token = os.environ.get("MACROMICRO_TOKEN", "").strip()
    if not token:
        remedy = "set a token in MACROMICRO_TOKEN"
        return Finding("address", FAIL, f"{host}: others can connect, no token", remedy)
    if len(token) < hosts.LEAST_TOKEN:
        found = f"{host}: others can connect, a token of {len(token)} characters"
        return Finding("address", FAIL, found, f"set one of {hosts.STRONG} in MACROMICRO_TOKEN")
    return Finding("address", OK, f"{host}: others can connect, with the token")


def _resolved(host: str, port: int) -> tuple[socket.AddressFamily, Any]:
    family, _, _, _, where = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    return family, where


def free_port(port: int, what: str, host: str = HOST) -> Finding:
    name = f"port {port}, {what}"
    try:
        family, where = _resolved(host, port)
        with socket.socket(family) as trial:
            trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            trial.bind(where)
            trial.listen(1)
    except OSError as error:
        text = f"taken or refused on {host} ({error.strerror})"
        return Finding(
            name, WARN, text, "choose another port, or end the program that listens there"
        )
    return Finding(name, OK, f"free on {host}")
