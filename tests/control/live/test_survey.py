"""What the laser tells beside the encoder, on a carriage without physics."""

from __future__ import annotations

import math

import numpy as np
import pytest

from macromicro.control.live import survey
from macromicro.control.live.parameters import Edges
from macromicro.control.live.survey import NOTHING, Survey
from macromicro.types import Sample

from .bench import DT, PITCH

Q = Edges()
OFFSET = 0.0
PHASE = 0.31 * PITCH  # of the strip, in the frame of the carriage
SLOW = 140.0  # count/s


class Track:
    """A carriage at `x` [m] and a contraction [m], and what three sensors show of them."""

    def __init__(self, q: Edges = Q, seed: int = 0) -> None:
        self.q, self.v = q, Survey()
        self.rng = np.random.default_rng(seed)
        self.x = self.contraction = self.level = self.zero = self.lost = 0.0
        self.laser = self.encoder = True
        self.stood = 0.0
        self.apart = 0.0

    def tick(self, speed: float = 0.0, contraction: float | None = None) -> Survey:
        """A period at a speed [count/s], then a sample."""
        before = self.contraction
        self.contraction = before if contraction is None else contraction
        self.x += speed * PITCH * DT
        keep = math.exp(-DT / 3e-3)
        mean = 0.5 * (before + self.contraction)
        self.level = mean + (self.level - mean) * keep
        noise = self.rng.standard_normal(2)
        stage = self.x + self.contraction
        laser = stage - self.zero + 0.45e-6 * float(noise[0])
        fine = self.level + 0.6e-6 * float(noise[1])
        count = math.floor((self.x - PHASE) / PITCH + 0.5) - math.floor(self.lost)
        sample = Sample(
            0.0, float(count) if self.encoder else math.nan, fine,
            laser if self.laser else math.nan, 1.0, 0.0,
        )  # fmt: skip
        self.stood = self.stood + DT if speed == 0.0 else 0.0
        moving = survey.Moving(fine, speed, self.stood, OFFSET)
        self.v = survey.look(self.q, PITCH, self.v, sample, moving, DT)
        self.apart = max(self.apart, self.v.apart)
        return self.v

    def ride(self, counts: float, speed: float = SLOW) -> None:
        for _ in range(round(abs(counts) / speed / DT)):
            self.tick(math.copysign(speed, counts))

    def rest(self, seconds: float) -> None:
        for _ in range(round(seconds / DT)):
            self.tick()

    def reset(self, late: int = 0) -> None:
        """The machine's own reset; it takes effect `late` periods later than at once."""
        self.v = survey.reset_given(self.v)
        for _ in range(late):
            self.tick()
        self.zero = self.x + self.contraction
        self.tick()

    def error(self) -> float:
        """Of the position by laser [m]."""
        truth = self.x - PHASE + self.contraction
        return survey.whole(self.v, PITCH, OFFSET) - truth


@pytest.fixture
def known() -> Track:
    """After a slow ride there and back; at rest, in the midst of a count."""
    track = Track()
    track.ride(100.0)
    track.ride(-60.0)
    track.rest(0.2)
    return track


def test_a_slow_ride_places_the_edges(known: Track) -> None:
    assert known.v.phase is not None and known.v.phase.number > 120
    assert known.v.half < 12e-6
    assert abs(known.error()) < 3e-6
    assert known.apart == 0.0


def test_before_enough_edges_there_is_no_position_by_laser() -> None:
    track = Track()
    track.ride(8.0)
    assert track.v.half == math.inf
    track.ride(10.0)
    assert track.v.half < 0.5 * PITCH


@pytest.mark.parametrize("late", [0, 1, 4])
def test_resets_of_the_machine_cost_the_lasers_noise(known: Track, late: int) -> None:
    known.ride(400.0, 2000.0)
    known.rest(0.3)
    for _ in range(5):
        known.reset(late)
        known.rest(0.05)
    known.ride(-300.0, 2000.0)
    assert abs(known.error()) < 5e-6
    assert known.v.awaited == 0 and known.apart == 0.0


def test_a_reset_that_never_came_makes_it_begin_anew(known: Track) -> None:
    """Nobody can tell what the laser counts from now."""
    known.ride(100.0, 2000.0)
    known.rest(0.2)
    known.v = survey.reset_given(known.v)
    known.rest(0.15)
    assert abs(known.error()) < 3e-6
    known.rest(0.1)
    assert known.v.half == math.inf and known.apart == 0.0


@pytest.mark.parametrize("late", [15, 150])
def test_slow_resets_of_some_micrometres_are_no_lost_counts(known: Track, late: int) -> None:
    for k in range(3):
        for n in range(200):
            known.tick(contraction=1e-3 * (0.3 + 0.09 * (k + (n + 1) / 200.0)))
        known.rest(0.1)
        known.reset(late)
        known.rest(0.1)
    assert known.v.awaited == 0 and known.apart == 0.0
    assert abs(known.error()) < 6e-6


def test_a_reset_at_zero_is_none(known: Track) -> None:
    known.reset()
    known.rest(0.05)
    half = known.v.half
    known.v = survey.reset_given(known.v)
    assert known.v.awaited == 0
    known.rest(0.5)
    assert known.v.half == pytest.approx(half, abs=1e-6) and abs(known.error()) < 4e-6


def test_a_laser_that_comes_back_with_another_zero_is_believed_anew(known: Track) -> None:
    known.laser = False
    assert known.tick() == NOTHING
    known.ride(30.0)
    known.laser, known.zero = True, known.x
    known.rest(0.1)
    known.ride(300.0, 2000.0)
    assert known.v.half == math.inf and known.apart == 0.0
    known.ride(100.0)
    # Home is 400 counts away, and the strip's pitch not yet known: so says the half width.
    assert abs(known.error()) < known.v.half < 0.5 * PITCH
    assert known.apart == 0.0


@pytest.mark.parametrize("speed", [0.0, 1500.0])
def test_a_reset_by_others_is_no_loss_of_counts(known: Track, speed: float) -> None:
    for _ in range(200):
        known.tick(speed)
    known.zero = known.x
    known.tick(speed)
    assert known.v.half == math.inf
    for _ in range(200):
        known.tick(speed)
    known.ride(100.0)
    assert known.apart == 0.0 and abs(known.error()) < 4e-6


def test_a_laser_that_stands_is_none(known: Track) -> None:
    sample = Sample(0.0, 0.0, 0.0, 0.01, 1.0, 0.0)
    v = NOTHING
    for k in range(100):
        hall = 1e-3 * (k % 2)
        v = survey.look(Q, PITCH, v, sample._replace(encoder=float(k), hall=hall),
                        survey.Moving(0.0, 1000.0, 0.0, 0.0), DT)  # fmt: skip
        assert v.apart == 0.0
    assert v.phase is None


def test_counts_that_are_lost_set_them_apart(known: Track) -> None:
    known.lost = 1.2  # one is lost: within what is let pass
    known.ride(200.0)
    assert known.apart == 0.0
    assert known.v.half == math.inf  # but the edges contradict one another
    known.lost = 3.2
    known.ride(10.0)
    assert known.v.gap == pytest.approx(3.0, abs=0.6)
    assert known.apart >= 0.05
    assert survey.again(known.v, PITCH) == NOTHING


def test_a_count_that_was_lost_unseen_is_taken_on_by_homing(known: Track) -> None:
    known.lost = 1.2
    known.v = survey.again(known.v, PITCH)
    known.ride(-150.0)
    known.rest(0.1)
    assert known.v.half < 12e-6 and known.apart == 0.0
    assert known.error() == pytest.approx(-PITCH, abs=4e-6)


def test_counts_lost_one_by_one_on_a_slow_ride_are_no_pitch(known: Track) -> None:
    for _ in range(round(60.0 / SLOW / DT)):
        known.lost += 0.1 * SLOW * DT
        known.tick(SLOW)
    assert known.apart >= 0.05


def test_at_speed_an_older_reading_of_the_laser_is_let_pass(known: Track) -> None:
    known.lost = 3.2
    known.ride(100.0, 2500.0)
    assert known.apart == 0.0
    known.rest(0.1)
    assert known.apart >= 0.05


def test_fast_crossings_and_missing_counts_tell_no_edge(known: Track) -> None:
    assert known.v.phase is not None
    number = known.v.phase.number
    known.ride(300.0, 900.0)
    known.encoder = False
    known.ride(30.0)
    known.encoder = True
    known.tick()
    assert known.v.phase is not None and known.v.phase.number <= number + 1
    assert abs(known.error()) < 3e-6


def test_a_wire_that_bounces_is_seen_through_the_hall_sensors_lag() -> None:
    track = Track(seed=2)
    for k in range(2000):
        track.tick(SLOW, 0.05e-3 + 0.05e-3 * math.sin(0.9 * k))
    assert track.v.phase is not None and track.v.phase.number > 200
    assert track.apart == 0.0
    track.rest(0.1)
    assert abs(track.error()) < 8e-6


def test_a_hall_sensor_that_stands_suspends_the_judgement(known: Track) -> None:
    sample = Sample(0.0, known.v.counts, 0.7, known.v.laser, 1.0, 0.0)
    for k in range(200):  # the micro-stage goes 2 mm, its sensor tells nothing
        known.v = survey.look(
            Q, PITCH, known.v, sample._replace(laser=sample.laser + 1e-5 * k),
            survey.Moving(0.0, 0.0, 1.0, 0.0), DT,
        )  # fmt: skip
    assert known.v.apart == 0.0


@pytest.mark.parametrize("reading", [math.inf, -math.inf, 1e300, math.nan])
def test_what_is_no_place_is_no_reading(known: Track, reading: float) -> None:
    sample = Sample(0.0, known.v.counts, 0.0, reading, 1.0, 0.0)
    v = survey.look(Q, PITCH, known.v, sample, survey.Moving(0.0, 0.0, 1.0, 0.0), DT)
    assert v == NOTHING


def test_it_can_be_left_out() -> None:
    track = Track(Edges(use=0))
    track.ride(50.0)
    assert track.v == NOTHING
