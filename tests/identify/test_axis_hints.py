"""Warnings of a drive's record: "What goes wrong" of docs/identify.md."""

from __future__ import annotations

import math
import re
import warnings

import numpy as np
import pytest
from tests.identify.late_records import AXIS, DT, record, rows, steps

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify import _axis_hints, drive
from macromicro.identify._axis_hints import delay, gravity_share
from macromicro.identify.axis_fit import FIT, Driven, rows_of, runs_of
from macromicro.identify.axis_inverse import Rows
from macromicro.identify.notices import DataWarning
from macromicro.models.mass import Axis, late, simulate

BALANCED = Axis(mass=0.01, viscous=0.08, coulomb=0.05, offset=0.01)
HUNG = BALANCED._replace(sine=0.06, cosine=-0.08)


def said_of(made: list[Rows], gain: float = 1.0) -> list[str]:
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        _axis_hints.warn_of_hints(made, gain)
    return [str(w.message) for w in seen if w.category is DataWarning]


@pytest.mark.parametrize("samples", [0, 1, 3, 7, 12, 17, 58, 700])
def test_the_delay_of_the_force_is_found(samples: int) -> None:
    u = steps(1)
    assert abs(_axis_hints.delay(rows(u, late(u, samples))) - samples) <= samples // 200


def test_a_shifted_force_keeps_its_ends() -> None:
    force = np.arange(5.0)
    np.testing.assert_array_equal(_axis_hints.shift(force, 2), [0.0, 0.0, 0.0, 1.0, 2.0])
    np.testing.assert_array_equal(_axis_hints.shift(force, -2), [2.0, 3.0, 4.0, 4.0, 4.0])
    np.testing.assert_array_equal(_axis_hints.shift(force, 0), force)
    np.testing.assert_array_equal(_axis_hints.shift(force, -9), np.full(5, 4.0))


def test_drive_says_it_unless_the_delay_is_to_be_found() -> None:
    u = steps(8)
    t, said, x = record(u, late(u, 15.4))
    with pytest.warns(DataWarning, match="later than u"):
        wrong = drive(t, said, x, structure="coulomb")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = drive(t, said, x, structure="coulomb", delay=FIT)
    at = found.refined.names.index("lag")
    assert found.delay + found.axis.lag / DT == pytest.approx(15.4, abs=0.3)
    assert at == 4 and 0.0 < found.surest.std[at] < 2e-4
    for estimate in (found.refined, found.inverse):  # the latter by the delay found, too
        missed = np.array([estimate.axis.mass - 4.0, estimate.axis.coulomb - 12.0])
        own = [estimate.names.index(n) for n in ("mass", "coulomb")]
        np.testing.assert_array_less(np.abs(missed), 4.0 * estimate.std[own])
    assert abs(wrong.inverse.axis.mass - 4.0) + abs(wrong.axis.mass - 4.0) > 0.1


def test_under_noise_of_the_position_alone_the_free_run_tells_it() -> None:
    u = steps(11)
    random = np.random.default_rng(0)
    x = simulate(AXIS, late(u, 7.3), DT) + 1e-6 * random.standard_normal(len(u))
    found = drive(np.arange(len(u)) * DT, u, x, structure="coulomb", delay=FIT)
    assert found.delay + found.axis.lag / DT == pytest.approx(7.3, abs=1e-3)
    assert found.refined.std[-1] < 1e-6
    assert found.axis.mass == pytest.approx(4.0, abs=1e-4)


@pytest.mark.parametrize("delay", [-1, 1001, "all", 0.5])
def test_what_is_no_delay_is_refused(delay: object) -> None:
    u = steps(10, 2000)
    with pytest.raises(InputError, match=r"delay: .* from 0 to 1000, or \"fit\""):
        drive(*record(u, u), delay=delay)  # type: ignore[arg-type]


def test_a_force_that_acts_before_it_is_said_to() -> None:
    u = steps(2)
    made = rows(late(u, 5), u)
    assert delay(made) == 0 and delay(made, -12) == -5
    (text,) = said_of(made)
    assert re.match(r"the force acts 5 ms \(5 samples\) earlier than u: .*two clocks", text)


def test_at_the_end_of_what_is_tried_there_is_no_shift() -> None:
    u = steps(2)
    assert not any("earlier" in text for text in said_of(rows(late(u, 12), u)))
    assert any("earlier" in text for text in said_of(rows(late(u, 11), u)))


def test_a_delay_is_told_with_what_it_explains_and_a_remedy() -> None:
    u = steps(3)
    (text,) = said_of(rows(u, late(u, 20)))
    found = re.match(r"the force acts 20 ms \(20 samples\) later .* by (\d+) % on held-out", text)
    assert found is not None and 50 < int(found[1]) < 100 and "--delay fit" in text


def test_where_only_the_shifted_force_drives_it_that_is_said() -> None:
    """The force has turned before it acts: mass and friction would be below 0."""
    u = steps(4)
    (text,) = said_of(rows(u, late(u, 700)))
    assert "700 samples) later" in text and "alone gives a positive mass and friction" in text


@pytest.mark.parametrize(("most", "gain"), [(30.0, 1.0), (43.0, -4.0)])
def test_a_force_that_does_not_grow_is_told_with_its_limit(most: float, gain: float) -> None:
    u = steps(5)
    made = rows(u, np.clip(u, -most, most))
    assert _axis_hints.limit(made) == pytest.approx(most, rel=0.05)
    (text,) = said_of(made, gain)
    found = re.match(r"the force seems to saturate at u = ([\d.]+): this lowers", text)
    assert found is not None and float(found[1]) == pytest.approx(most / abs(gain), rel=0.05)
    assert "--limit" in text


def test_a_limited_force_is_cut_on_both_sides() -> None:
    u = steps(6)
    (cut,) = _axis_hints.limit_force(rows(u, u), 20.0)
    np.testing.assert_array_equal(cut.force, np.clip(u, -20.0, 20.0))


def test_errors_of_a_smaller_force_count_as_parts_of_it() -> None:
    u = steps(6)
    made = rows(u, u)
    assert _axis_hints.lowered_by(made, _axis_hints.limit_force(made, 0.5), "coulomb") is None


@pytest.mark.parametrize("seed", [7, 10])
def test_a_late_and_limited_force_is_both(seed: int) -> None:
    """Of one record the delay alone explains nothing that counts: the limit hides it."""
    u = steps(seed)
    both = sorted(said_of(rows(u, np.clip(late(u, 9), -30.0, 30.0))))
    assert len(both) == 2
    assert "9 samples) later" in both[0] and "seems to saturate" in both[1]


@pytest.mark.parametrize("seed", range(3))
def test_of_a_drive_that_does_as_it_is_told_nothing_is_said(seed: int) -> None:
    u = steps(seed + 20)
    assert said_of(rows(u, u, seed)) == []


def test_a_known_delay_is_no_news() -> None:
    u = steps(9)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        drive(*record(u, late(u, 15)), structure="coulomb", delay=15)


def turning(axis: Axis, seed: int = 1, n: int = 8000) -> tuple[Array, Array, Array]:
    """Torques of both signs for 0.1 to 0.5 s, a disturbing one, and the angle."""
    random = np.random.default_rng(seed)
    parts: list[np.ndarray] = []
    while sum(map(len, parts)) < n:
        parts.append(np.full(int(random.integers(100, 500)), random.uniform(-1.0, 1.0)))
    u = np.concatenate(parts)[:n]
    x = simulate(axis, u + 0.1 * random.standard_normal(n), DT, random.uniform(-math.pi, math.pi))
    return np.arange(n) * DT, u, np.asarray(x)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_it_shows_in_blocks_held_out_where_it_is(seed: int) -> None:
    for axis, shows in ((HUNG, True), (BALANCED, False)):
        rows = rows_of(runs_of(*turning(axis, seed)), Driven())
        assert (gravity_share(rows, "coulomb") is not None) is shows


def test_what_it_explains_is_a_part_of_the_force_error() -> None:
    rows = rows_of(runs_of(*turning(HUNG)), Driven())
    lowered = gravity_share(rows, "coulomb")
    assert lowered is not None and 0.02 < lowered < 1.0
    heavier = rows_of(runs_of(*turning(HUNG._replace(sine=0.12, cosine=-0.16))), Driven())
    more = gravity_share(heavier, "coulomb")
    assert more is not None and more > lowered


def test_an_angle_alone_is_said_to_hide_a_load() -> None:
    with pytest.warns(DataWarning, match=r"sine of the angle.*--eccentric"):
        drive(*turning(HUNG), structure="coulomb", eccentric=None)


@pytest.mark.parametrize(("axis", "eccentric"), [(HUNG, True), (HUNG, False), (BALANCED, None)])
def test_nothing_is_said_where_it_is_known_or_not_there(axis: Axis, eccentric: bool | None) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = drive(*turning(axis), structure="coulomb", eccentric=eccentric)
    assert ("sine" in found.refined.names) is bool(eccentric)
