"""Checks of the computer for the live machine, and of its server's rig, files and address."""

from __future__ import annotations

import importlib.util
import os
import platform
import shutil
import socket
import sys
import tempfile
import threading
import time
import webbrowser
from collections.abc import Iterator, Mapping, Sequence
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple

import macromicro
from macromicro import portable
from macromicro.errors import InputError, MacromicroError
from macromicro.extras import remedy
from macromicro.kernel import cache_folder
from macromicro.nominal import PERIOD
from macromicro.recording_format import needed_bytes
from macromicro.rig.opening import TWIN, named
from macromicro.serve import hosts, persist, storage
from macromicro.serve.hosts import FOLDER, HOST, SCPI_PORT, WEB_PORT
from macromicro.serve.settings import ServeSettings
from macromicro.serve.shared import COLUMNS, Shared
from macromicro.serve.warming import is_compiled

OK, WARN, FAIL = "ok", "warn", "fail"
NEEDED: tuple[str, ...] = ("numpy", "numba", "scipy", "h5py", "typer")
NEEDED += ("rich", "jinja2", "websockets")
EXTRAS = {  # distribution: what for, and the extra of this package that brings it
    "matplotlib": ("figures", "figures"),
    "xarray": ("recordings as xarray datasets", "xarray"),
    "h5netcdf": ("xarray datasets in netCDF files", "xarray"),
    "pandas": ("recordings as pandas tables", "pandas"),
    "distributed": ("sweeps on a dask cluster", "cluster"),
    "pyarrow": ("sweeps and Parquet files", "sweep"),
}
_OLDEST = (3, 11)
_CLOCKS = ("tsc", "kvm-clock", "arch_sys_counter", "hyperv_clocksource_tsc_page", "xen")
_SYS = Path("/sys/devices/system")


class Finding(NamedTuple):
    """One result: subject, OK, WARN or FAIL, finding, remedy."""

    what: str
    state: str
    found: str
    remedy: str = ""


def shared_memory() -> Finding:
    try:
        Shared.create().close()
    except (OSError, ValueError) as error:
        remedy = "make room in memory (ulimit -f, ulimit -v)"
        return Finding("shared memory", FAIL, str(error), remedy)
    return Finding("shared memory", OK, "given")


def python() -> Finding:
    found = f"{platform.python_version()} ({sys.executable})"
    if sys.version_info >= _OLDEST:
        return Finding("Python", OK, found)
    return Finding("Python", FAIL, found, "install Python 3.11 or newer")


def constraints() -> dict[str, str]:
    """Tested versions by package; none in an installed package."""
    path = Path(macromicro.__file__).parents[2] / "constraints.txt"
    try:
        lines = path.read_text("utf-8").splitlines()
    except (OSError, UnicodeDecodeError):
        return {}
    pairs = [line.split("==") for line in lines if line.count("==") == 1]
    return {name.strip().lower(): version.strip() for name, version in pairs}


def packages(tested: Mapping[str, str]) -> Iterator[Finding]:
    """Whether the required packages have the tested versions."""
    for name in NEEDED:
        yield _package(name, tested.get(name), FAIL, f"pip install {name}")


def extras() -> Iterator[Finding]:
    for name, (purpose, extra) in EXTRAS.items():
        if importlib.util.find_spec(name) is not None:
            yield Finding(f"package {name}", OK, f"{_version(name)}: {purpose}")
        else:
            wanted = f"only if needed, {remedy(extra)}"
            yield Finding(f"package {name}", OK, f"not installed: no {purpose}", wanted)


def _package(name: str, tested: str | None, missing: str, remedy: str) -> Finding:
    what = f"package {name}"
    if importlib.util.find_spec(name) is None:
        return Finding(what, missing, "not installed", remedy)
    version = _version(name)
    if tested is not None and version != tested:
        text = f"{version}, tested with {tested}"
        return Finding(what, WARN, text, f"pip install {name}=={tested}, if something fails")
    return Finding(what, OK, version)


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "unknown version"


def compiler_cache() -> Finding:
    what, folder = "compiler's cache", cache_folder()
    remedy = "make it writable, or name another folder in MACROMICRO_CACHE"
    refusal = unwritable(folder)
    if refusal:
        return Finding(what, FAIL, f"{folder}: {refusal}", remedy)
    if not is_compiled():
        others = sum(1 for _ in folder.rglob("*.nbi"))
        found = f"{others} kernels, none of the live bench" if others else "empty"
        remedy = "the first `macromicro serve` compiles once, for about 10 s"
        return Finding(what, WARN, f"{folder}: {found}", remedy)
    return Finding(what, OK, f"{folder}: warm")


def unwritable(folder: Path) -> str:
    """Why a folder, which may not exist yet, cannot be written to, or ""."""
    place = folder
    while not place.exists() and place != place.parent:
        place = place.parent
    if not place.is_dir():
        return f"{place} is not a folder"
    try:  # permissions alone tell of no file system that takes no files
        tempfile.TemporaryFile(dir=place).close()
    except OSError as error:
        return f"{place} may not be written to ({error.strerror})"
    return ""


def cores() -> Finding:
    count = portable.cores()
    if count < 2:
        remedy = "expect missed periods: the loop shares its core"
        return Finding("processor", WARN, f"{count} core", remedy)
    return Finding("processor", OK, f"{count} cores")


def realtime(priority: int) -> Finding:
    """Whether the loop may have real-time priority, tried in a thread."""
    refused: list[str] = []

    def attempt() -> None:
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
        except (OSError, AttributeError) as error:
            refused.append(getattr(error, "strerror", None) or str(error))

    thread = threading.Thread(target=attempt)
    thread.start()
    thread.join()
    what = "real-time priority"
    if refused:
        return Finding(
            what,
            WARN,
            f"not permitted ({refused[0]})",
            f"add the line `{_user()} - rtprio {priority}` to /etc/security/limits.conf and log in "
            "again; without it other programs delay the loop",
        )
    return Finding(what, OK, f"SCHED_FIFO {priority} permitted")


def _user() -> str:
    return os.environ.get("USER") or "USER"


def clock(system: Path = _SYS) -> Iterator[Finding]:
    """Whether the clock is fine enough and the processor's speed fixed."""
    info = time.get_clock_info("monotonic")
    source = _text(system / "clocksource/clocksource0/current_clocksource")
    found = f"{source or 'unknown'}, resolution {info.resolution * 1e9:.3g} ns"
    remedy = ""
    if info.resolution > 1e-6 or (source and source not in _CLOCKS):
        remedy = "a slow clock costs time every period; choose tsc if available"
    yield Finding("clock", WARN if remedy else OK, found, remedy)
    governor = _text(system / "cpu/cpu0/cpufreq/scaling_governor")
    if governor in ("powersave", "conservative", "ondemand"):
        remedy = "cpupower frequency-set -g performance"
        yield Finding("processor speed", WARN, f"governor {governor}", remedy)


def _text(path: Path) -> str:
    try:
        return path.read_text("ascii").strip()
    except (OSError, UnicodeDecodeError):
        return ""


def browser() -> Finding:
    screen = os.environ.get("WAYLAND_DISPLAY") or os.environ.get("DISPLAY")
    try:
        found = getattr(webbrowser.get(), "name", "a browser")
    except webbrowser.Error:
        found = ""
    if screen and found:
        return Finding("browser", OK, f"{found}, display {screen}")
    missing = "no display" if found else "no browser" if screen else "no display, no browser"
    return Finding("browser", WARN, missing, "open the page from another computer, by ssh -L")


def worst(all_findings: Sequence[Finding]) -> str:
    states = {each.state for each in all_findings}
    return FAIL if FAIL in states else WARN if WARN in states else OK


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
    yield python()
    yield from packages(constraints())
    yield from extras()
    yield compiler_cache()
    yield cores()
    yield realtime(settings.priority)
    yield from clock()
    yield shared_memory()
    yield state_file(asked.state)
    yield recording_folder(asked.record)
    yield from disk({"recordings": asked.record, "position": asked.state.parent}, asked.period)
    yield address(asked.host)
    for port, what in asked.ports.items():
        yield free_port(port, what, asked.host)
    yield browser()


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
        _resolve(host, 0)
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


def _resolve(host: str, port: int) -> tuple[socket.AddressFamily, Any]:
    family, _, _, _, where = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    return family, where


def free_port(port: int, what: str, host: str = HOST) -> Finding:
    name = f"port {port}, {what}"
    try:
        family, where = _resolve(host, port)
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
