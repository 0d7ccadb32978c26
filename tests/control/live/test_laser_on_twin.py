"""The position by laser, and lost counts, on the twin. Truth only judges what is reported."""

from __future__ import annotations

import math

import numpy as np
import pytest

from macromicro.control.live import machine
from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted
from macromicro.control.live.parameters import Edges, Live
from macromicro.settings import Settings
from macromicro.types import SAFE, Sample

from .bench import PITCH, Bench


class Blurred(Bench):
    """Loses counts while it moves, and its laser can be switched off."""

    skipping = 0.0
    laser = True
    _last: float | None = None
    _lost = 0.0

    def show(self, sample: Sample) -> object:  # type: ignore[override]
        moved = 0.0 if self._last is None else sample.encoder - self._last
        self._last = sample.encoder
        self._lost += self.skipping * moved
        laser = sample.laser if self.laser else math.nan
        shown = sample._replace(encoder=sample.encoder - math.floor(self._lost), laser=laser)
        return super().show(shown)


def homed(seed: int = 5, **rest: object) -> Blurred:
    b = Blurred(-8e-3, seed=seed, **rest)
    b.tick()
    b.ask(m.Enable())
    b.ask(m.Home())
    assert b.wait(20.0).outcome == "done"
    return b


@pytest.fixture(scope="module")
def bench() -> Blurred:
    return homed()


def test_homing_places_the_edges(bench: Blurred) -> None:
    end = bench.ends[0]
    assert end.evidence["by"] == "laser" and end.uncertainty < 12e-6
    assert abs(end.position - bench.true_position()) < end.uncertainty


@pytest.mark.slow
def test_places_far_apart_are_known_to_a_few_micrometres(bench: Blurred) -> None:
    errors = []
    for target in (0.19, 0.0123, 0.1031):
        bench.ask(m.MoveTo(target))
        end = bench.wait(30.0)
        assert (end.outcome, end.evidence["by"]) == ("done", "laser")
        assert end.uncertainty < 15e-6
        errors.append(end.position - bench.true_position())
        assert abs(errors[-1]) < end.uncertainty
        assert abs(bench.true_position() - target) < 15e-6
    assert np.std(errors) < 5e-6


@pytest.mark.slow
def test_narrowed_micro_limits_hold_wherever_in_its_count_the_carriage_stands(
    bench: Blurred,
) -> None:
    own = bench.p.settings.limits
    high = 0.5e-3 + 6.0 * PITCH  # tolerance to either side, a count, the laser's half
    bench.ask(m.SetLimits(own._replace(micro_low=0.5e-3, micro_high=high)))
    for k in range(4):
        bench.ask(m.MoveTo(0.02 + 0.0031 * k))
        assert bench.wait(30.0).outcome == "done"
        assert 0.5e-3 <= bench.command.micro_reference <= high
    bench.ask(m.SetLimits())


def test_a_zero_far_from_home_leaves_the_coordinates(bench: Blurred) -> None:
    bench.ask(m.MoveMacro(2000))
    bench.wait(20.0)
    for _ in range(3):
        assert isinstance(bench.ask(m.Zero()), Accepted)
        bench.run(0.05)
    assert abs(bench.twin.read().laser) < 1e-3
    assert bench.s.survey.half < 15e-6
    assert abs(bench.s.seen.position - bench.true_position()) < bench.s.survey.half


@pytest.mark.slow
def test_without_a_laser_all_is_as_by_the_encoder(bench: Blurred) -> None:
    bench.laser = False
    bench.tick()
    bench.ask(m.MoveTo(0.05))
    end = bench.wait(30.0)
    assert (end.outcome, end.evidence["by"]) == ("done", "encoder")
    assert end.uncertainty == 0.5 * PITCH
    assert abs(bench.true_position() - 0.05) <= end.uncertainty + 5e-6
    bench.laser = True
    bench.run(0.1)
    bench.ask(m.Home())
    end = bench.wait(40.0)
    assert (end.outcome, end.evidence["by"], bench.s.fault) == ("done", "laser", None)
    assert end.uncertainty < 12e-6


def test_left_out_the_laser_decides_nothing() -> None:
    b = homed(live=Live(edges=Edges(use=0)))
    assert b.ends[0].evidence["by"] == "encoder" and b.ends[0].uncertainty == 0.5 * PITCH
    b.skipping = 0.1
    b.ask(m.MoveMacro(300))
    assert b.wait(20.0).outcome == "done"


def test_lost_counts_are_a_fault_and_homing_finds_the_place_again() -> None:
    b = homed()
    b.ask(m.MoveMacro(1500))
    b.run(0.1)
    b.skipping = 0.1
    began = b.s.time
    end = b.wait(2.0)
    assert end.outcome == "fault" and b.s.time - began < 0.3
    assert (b.mode, b.given, b.s.frame.trusted) == ("fault", SAFE, False)
    assert b.s.fault is not None and b.s.fault.words == machine.DISAGREE
    facts = b.s.fault.evidence
    by_laser, by_encoder = facts["by_laser_counts"], facts["by_encoder_counts"]
    assert by_laser - by_encoder > facts["allowed_counts"]
    # Within the belt's and the Hall sensor's share of it.
    assert by_laser == pytest.approx(by_encoder + math.floor(b._lost), abs=1.5)
    b.skipping = 0.0
    b.run(0.5)
    assert isinstance(b.ask(m.ClearFault(True)), Accepted)
    b.ask(m.Enable())
    b.ask(m.Home())
    end = b.wait(40.0)
    assert (end.outcome, end.evidence["by"]) == ("done", "laser")


def test_a_trusted_start_without_homing_is_watched_too() -> None:
    b = Blurred(0.05, coordinate=700.0, trusted=True)
    b.tick()
    b.ask(m.Enable())
    b.run(0.1)
    assert b.s.survey.half == math.inf  # no edge has been crossed
    b.skipping = 0.1
    b.ask(m.MoveMacro(900))
    assert b.wait(5.0).outcome == "fault"
    assert b.s.fault is not None and b.s.fault.words == machine.DISAGREE


def test_homing_with_an_encoder_that_skips_is_a_fault() -> None:
    b = Blurred(0.02, seed=7)
    b.tick()
    b.ask(m.Enable())
    b.skipping = 0.1
    b.ask(m.Home())
    assert b.wait(20.0).outcome == "fault"
    assert b.s.fault is not None and b.s.fault.words == machine.DISAGREE


def other_sensor() -> Blurred:
    """Homed by the table of the default Hall sensor, on a bench that has another one."""
    default = Settings()
    hall = default.sensors.hall._replace(gain=3.0)
    return homed(settings=default._replace(sensors=default.sensors._replace(hall=hall)))


def test_a_move_is_done_only_where_the_laser_says_so_too() -> None:
    """By the Hall sensor alone the distance would be too short by a part of the contraction.
    (Where coordinate 0 is, no laser tells: the edges were placed by that Hall sensor.)"""
    b = other_sensor()
    places = []
    for target in (0.042123, 0.0437):
        b.ask(m.MoveTo(target))
        end = b.wait(30.0)
        assert (end.outcome, end.evidence["by"]) == ("done", "laser")
        assert abs(end.evidence["error_by_laser_mm"]) <= 1e3 * b.p.settings.fine.band
        places.append(b.true_position())
    assert places[1] - places[0] == pytest.approx(0.0437 - 0.042123, abs=15e-6)


def test_witnesses_that_do_not_agree_in_time_are_both_named() -> None:
    b = other_sensor()
    fine = b.p.settings.fine._replace(patience=0.75)
    b.p = b.p._replace(settings=b.p.settings._replace(fine=fine))
    b.ask(m.MoveTo(0.042123))
    end = b.wait(30.0)
    assert end.outcome == "stalled"
    assert "Hall sensor is" in end.evidence["reason"] and "laser" in end.evidence["reason"]
