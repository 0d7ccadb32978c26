"""One home for the Hall sensor's table: whoever opens a twin with another sensor gets its own."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import pytest

from macromicro import hall_table, simulate
from macromicro.control import calibration
from macromicro.errors import InputError
from macromicro.nominal import PERIOD
from macromicro.rig.session import Session
from macromicro.runs.programmed import on_twin
from macromicro.runs.sequence import micro_steps
from macromicro.serve import loop_process
from macromicro.serve._launching import LIVE, Spec
from macromicro.serve.settings import LiveSettings
from macromicro.settings import Settings


def other(settings: Any) -> Any:
    hall = settings.sensors.hall._replace(gain=3.0)
    return settings._replace(sensors=settings.sensors._replace(hall=hall))


def test_the_default_bench_has_the_shipped_table() -> None:
    assert not hall_table.is_needed(Settings())
    found, shipped = hall_table.of_bench(Settings()), calibration.default_calibration()
    assert (found.low, found.step) == (shipped.low, shipped.step)
    assert np.array_equal(found.position, shipped.position)


def test_simulator_and_server_take_the_table_of_their_bench() -> None:
    own = hall_table.of_bench(other(Settings()))
    volts = np.linspace(1.0, 2.5, 7)
    place, shipped = calibration.position, calibration.default_calibration()
    assert max(abs(place(own, v) - place(shipped, v)) for v in volts) > 0.03e-3
    rolled = simulate.prepare(other(Settings()), micro_steps([1e-3]))
    assert np.array_equal(rolled.watchdog.calibration.position, own.position)
    spec = Spec("twin", 0, other(LiveSettings()), "nothing kept", LIVE, os.getpid())
    opened = loop_process.open_machine(spec)
    guarded: Any = opened.guarded(Session(opened.rig, PERIOD))
    live: Any = opened.machine
    assert np.array_equal(live._p.calibration.position, own.position)
    assert np.array_equal(guarded._limits.calibration.position, own.position)


def test_a_programme_on_another_sensor_reaches_its_targets() -> None:
    run = on_twin(micro_steps([1.5e-3], 3.0), other(Settings()))
    assert abs(np.mean(run["laser"][-500:]) - 1500.0) < 10.0  # um


def test_a_rig_without_a_table_is_not_served(monkeypatch: pytest.MonkeyPatch) -> None:
    import faulty.bench

    real = faulty.bench.Faulty.__init__

    def bare(self: Any, *given: Any, **more: Any) -> None:
        real(self, *given, **more)
        self.calibration = None

    monkeypatch.setattr(faulty.bench.Faulty, "__init__", bare)
    spec = Spec("faulty.bench:twin", 0, LiveSettings(), "", LIVE, os.getpid())
    with pytest.raises(InputError, match="identify hall"):
        loop_process.open_machine(spec)


def test_a_written_table_is_read() -> None:
    made = calibration.parse("# of mine\nhall_V,position_mm\n1.0,0.0\n1.5,2.0\n2.0,4.0\n")
    assert (made.low, made.step, list(made.position)) == (1.0, 0.5, [0.0, 2e-3, 4e-3])
    for text in ("", "hall_V,position_mm\n1.0,0.0\n", "1.0\n", "2,1\n1,0\n"):
        with pytest.raises(InputError, match="lines hall_V"):
            calibration.parse(text)
