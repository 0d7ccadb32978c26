"""The position that is told, under every fault of the faulty twin: within its half width, or
told as not known. The bench's truth is the judge."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest

import faulty
from faulty import FAULTS, NONE, possible
from faulty.bench import Faulty
from macromicro.control import calibration
from macromicro.control.live import messages as m
from macromicro.kernel import compiled
from macromicro.plant import bench
from macromicro.rig import guard
from macromicro.rig.guarded import Guarded
from macromicro.serve import live
from macromicro.serve.link import Outbox, pair
from macromicro.serve.live import Live
from macromicro.serve.persist import Restored
from macromicro.serve.requests import Order
from macromicro.serve.settings import LiveSettings, ServeSettings
from macromicro.serve.shared import INDEX, Shared
from macromicro.serve.ticking import Loop

DT = 1e-3
HERE = sorted(
    name
    for name in (NONE, *possible(Faulty))
    if not (FAULTS[name].raises or FAULTS[name].hangs or FAULTS[name].stall)
)


class Scene:
    """The loop, guard and live machine on the faulty twin, as fast as it goes, without a
    process: what is told in each period, beside the truth [mm], half width [mm], trusted."""

    def __init__(self, seed: int = 0) -> None:
        settings = LiveSettings()
        plant = bench.prepare(settings.bench, settings.sensors)
        self.cells = faulty.board()
        self.pitch = settings.live.pitch
        self.rig = Faulty(
            plant,
            seed,
            measure=compiled(bench.measure),
            advance=compiled(bench.advance),
            cells=self.cells,
        )
        table = calibration.default_calibration()
        self.machine: Live = live.make(settings, table)
        self.shared = Shared.create(100)
        self.ours, theirs = pair()
        self.ours.setblocking(False)
        serve = ServeSettings(miss_share=1.0, parent_timeout=1e9)
        guarded = Guarded(self.rig, guard.prepare(settings.guard, table), DT)
        self.loop = Loop(guarded, self.machine, self.shared, Outbox(theirs), serve, DT, False)
        self.machine.begin(guarded.read(), Restored(True, 0.0, "test"))
        self.told: list[tuple[float, float, float]] = []
        self.tick(2)

    def tick(self, periods: int) -> None:
        for _ in range(periods):
            real = self.rig.truth()
            # Coordinate n names the middle of count n. The platform rocks with the belt, as the
            # laser sees it.
            true = real.carriage - 0.5 * self.pitch + real.belt + real.micro
            assert self.loop._tick(self.loop._rig.read()) == ""
            row = self.shared.last()
            assert row is not None
            off = row[INDEX["position"]] - true * 1e3
            self.told.append((off, row[INDEX["uncertainty"]] * 1e-3, row[INDEX["trusted"]]))
            self.rig.clock.wait(DT)
        self.loop._outbox._waiting.clear()
        while True:
            try:
                self.ours.recv(1_000_000)
            except BlockingIOError:
                break

    def until(self, what: Callable[[], bool], most: int) -> None:
        """As many periods as it takes, and no more than that."""
        end = len(self.told) + most
        while not what():
            assert len(self.told) < end
            self.tick(50)

    def rests(self, most: int) -> None:
        self.until(lambda: self.machine.view().motion == 0, most)

    def ask(self, request: Any) -> None:
        self.loop._handle(Order(0, request, 1, 2**63 - 1))

    def accepted(self, request: Any) -> None:
        assert self.machine.refusal(request) is None
        self.ask(request)

    def close(self) -> None:
        self.ours.close()
        self.shared.close()


class Situation(NamedTuple):
    """Requests, each with the seconds after it; what is asked for 0.2 s behind the fault's onset;
    the seconds that are looked at from the onset on."""

    before: tuple[m.Request, ...]
    seconds: float
    behind: m.Request | None = None
    looked: float = 4.0


def told(name: str, here: Situation) -> Any:
    """Told minus true, half width and trust from the fault's onset on."""
    scene = Scene()
    try:
        scene.accepted(m.Enable())
        for request in here.before:
            scene.accepted(request)
            scene.tick(round(here.seconds / DT))
        start = len(scene.told)
        faulty.inject(scene.cells, name)
        scene.tick(200)
        if here.behind is not None:
            scene.ask(here.behind)
        scene.tick(round(here.looked / DT) - 200)
        return np.array(scene.told[start:]).T
    finally:
        scene.close()


SITUATIONS = {
    "at rest": Situation((), 0.0),
    "holding": Situation((m.MoveMicro(1.5e-3),), 1.5, looked=2.0),  # it rests after 1.2 s
    "on a micro move": Situation((m.MoveMicro(1.5e-3),), 0.3, m.MoveMicro(2.5e-3)),
    "on a macro move": Situation((m.MoveMacro(1500),), 0.15),
    "then moved": Situation((m.MoveMicro(1e-3),), 2.0, m.MoveTo(0.03)),
}


def _quick(name: str, situation: str) -> bool:
    """A fault of what moves, on the way; of whatever else, while it is held."""
    moved = name.startswith(("encoder", "carriage", "motor", "clock", "laser"))
    if name == NONE:
        return situation in ("holding", "on a macro move")
    return situation == ("on a macro move" if moved else "holding")


@pytest.mark.parametrize(
    ("name", "situation"),
    [
        pytest.param(name, situation, marks=() if _quick(name, situation) else pytest.mark.slow)
        for situation in SITUATIONS
        for name in HERE
    ],
)
def test_a_half_width_is_honest_under_every_fault(name: str, situation: str) -> None:
    off, half, trusted = told(name, SITUATIONS[situation])
    known = trusted > 0.5
    assert np.array_equal(known, np.isfinite(half))
    # A reading that dithers is itself a count off, and nothing else is wrong with it.
    slack = 1e3 * LiveSettings().live.pitch if FAULTS[name].dither else 0.0
    wrong = known & (np.abs(off) > half + slack)
    share = np.count_nonzero(wrong) / len(off)
    assert share <= 0.01, f"{share:.1%} wrong, by {np.abs(off[wrong]).max():.3f} mm at most"
    assert name != NONE or known.all()  # it is not honest by knowing nothing


def test_a_hall_sensor_on_its_rail_costs_trust_at_once_and_gives_it_back() -> None:
    scene = Scene()
    scene.accepted(m.Enable())
    scene.accepted(m.MoveMicro(1.5e-3))
    scene.tick(2000)
    faulty.inject(scene.cells, "hall-range")
    scene.tick(300)
    trusted = np.array(scene.told)[:, 2]
    assert trusted[:2000].all() and not trusted[2010:].any()
    faulty.inject(scene.cells, NONE)
    scene.tick(200)
    assert np.array(scene.told)[-1, 2] == 1.0  # the carriage's count was never in doubt
    scene.close()


@pytest.mark.parametrize(
    "name", ["hall-silent", pytest.param("hall-stuck", marks=pytest.mark.slow)]
)
def test_the_remedy_that_is_told_works_the_first_time(name: str) -> None:
    """FAUL:CLE;:ENAB;HOME behind a fault of the Hall sensor at rest."""
    scene = Scene()
    scene.accepted(m.Enable())
    scene.accepted(m.MoveMicro(1e-3))
    scene.rests(3000)
    faulty.inject(scene.cells, name)
    scene.until(lambda: scene.machine.view().mode == m.FAULT, 1500)
    faulty.inject(scene.cells, NONE)
    scene.tick(300)
    for request in (m.ClearFault(), m.Enable(), m.Home()):
        scene.ask(request)
    scene.tick(2)
    assert scene.machine.view().motion
    scene.rests(8000)
    assert (scene.machine.view().mode, scene.machine.view().trusted) == (m.READY, 1.0)
    scene.accepted(m.MoveMacro(300))
    scene.tick(2)
    assert scene.machine.view().motion
    scene.rests(2500)
    assert scene.machine.view().mode == m.READY
    scene.close()
