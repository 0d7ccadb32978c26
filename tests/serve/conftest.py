"""A station on the logged rig, and what a test needs to look behind it."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from macromicro.serve import persist
from macromicro.serve.settings import LiveSettings
from macromicro.serve.station import Station

# The loop process finds the rig and the machine by name, on the path that it is handed.
sys.path.insert(0, str(Path(__file__).parent))
import serve_parts
from serve_parts import Running


@pytest.fixture
def log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """What the rig was last told; see `serve_parts`."""
    path = tmp_path / "outputs"
    monkeypatch.setenv(serve_parts.LOG, str(path))
    return serve_parts.log(path, fresh=True)


@pytest.fixture
def station(log: Any, tmp_path: Path) -> Iterator[Callable[..., Station]]:
    """Makes stations with some of the settings in [serve]; stops them in the end."""
    made = []

    def make(name: str = "position.json", **serve: Any) -> Station:
        made.append(_logged(tmp_path / name, **serve))
        return made[-1]

    yield make
    for each in made:
        each.stop()


def _logged(state: Path, **serve: Any) -> Station:
    settings = LiveSettings()
    # Machines that run tests are busy: nothing stops for lateness unless a test says so.
    serve = {"miss_share": 1.0, "parent_timeout": 5.0, "loop_timeout": 5.0, **serve}
    settings = settings._replace(serve=settings.serve._replace(**serve))
    return Station(
        "serve_parts:logged", settings=settings, state=state, machine="serve_parts:driver"
    )


@pytest.fixture(scope="module")
def _running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    folder = tmp_path_factory.mktemp("running")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(serve_parts.LOG, str(folder / "outputs"))
        told = serve_parts.log(folder / "outputs", fresh=True)
        with _logged(folder / "position.json") as made:
            yield Running(made, folder / "position.json", told)


@pytest.fixture
def running(_running: Running) -> Running:
    """At rest, as its file says, without control by anybody and without clients."""
    made = _running.station
    for client in made.snapshot().clients:
        made.disconnect(client)
    made.emergency()
    serve_parts.until(lambda: (made.snapshot().motion, made.snapshot().holder) == (0, ""))

    def kept() -> bool:
        found = persist.load(_running.state)
        return isinstance(found, persist.Kept) and not found.moving

    serve_parts.until(kept)
    return _running


@pytest.fixture
def scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., Any]]:
    """Makes stations on the faulty twin, started and homed, with some settings in [serve]."""
    from fault_parts import Scene

    import faulty

    monkeypatch.setenv(faulty.BOARD, str(tmp_path / "board"))
    made: list[Scene] = []

    def make(**serve: Any) -> Scene:
        made.append(Scene(tmp_path, **serve))
        made[-1].start()
        return made[-1]

    yield make
    for each in made:
        each.station.stop()
