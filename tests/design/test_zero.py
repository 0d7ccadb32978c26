"""The laser's zero: where the micro-stage stood when it was reset."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from macromicro import api
from macromicro.design import zero
from macromicro.recorded import columns_named
from macromicro.recording import Recording
from macromicro.schema.par import changed
from macromicro.settings import Settings

COLUMNS = columns_named("t", "laser", "laser_reset", "micro_reference", "hall_position")


N = 600


def recording(resets: list[int], reference: np.ndarray, place: np.ndarray) -> Recording:
    """Places in mm, by both sensors; the laser reads from the last reset on."""
    reset, laser, zero_at = np.zeros(N), np.zeros(N), 0.0
    for k in range(N):
        laser[k] = 1e3 * (place[k] - zero_at)
        if k in resets:
            reset[k], zero_at = 1.0, place[k]
    values = [np.arange(N) * 1e-3, laser, reset, reference, place]
    return Recording.from_arrays(COLUMNS, values, 1e-3, {})


def test_a_reset_of_an_extended_stage_leaves_the_reading() -> None:
    reference = np.where(np.arange(N) >= 50, 1.5, 0.0)  # the move begins with its reset
    place = np.minimum(np.maximum(np.arange(N) - 50, 0) * 0.01, 1.5)
    r = recording([50], reference, place)
    assert np.array_equal(zero.contraction(r), r["laser"])
    assert [zero.offset(r, row) for row in (0, 50, 51, 599)] == [0.0] * 4


def test_a_run_that_begins_with_a_fine_move_begins_extended() -> None:
    place = np.minimum(np.arange(N) * 0.01, 1.5)
    for first in (0, 18):
        r = recording([first], np.full(N, 1.5), place)
        assert zero.offset(r, 500) == 0.0 and np.array_equal(zero.contraction(r), r["laser"])


@pytest.mark.parametrize("late", [0, 200])
def test_where_it_stood_then_is_what_is_missing(late: int) -> None:
    """Held already, or still on its way for `late` ms."""
    place = np.minimum(1.5, 1.5 - 0.002 * (100 + late - np.arange(N)))
    r = recording([100], np.full(N, 1.5), place)
    missing = 1e3 * place[100]
    found = zero.contraction(r)
    # The reset's own period still reads from before.
    assert np.array_equal(found[:101], r["laser"][:101])
    assert found[101:] == pytest.approx(1e3 * place[101:], abs=1e-6)
    assert zero.offset(r, 100) == 0.0
    assert zero.offset(r, 101) == pytest.approx(missing) == pytest.approx(zero.offset(r, 599))


def test_each_reset_counts_from_then_on() -> None:
    place = np.r_[np.full(300, 1.0), np.full(300, 2.0)]
    r = recording([40, 320], np.full(N, 1.0), place)
    off = zero.contraction(r) - r["laser"]
    assert off[41:321] == pytest.approx(1000.0) and off[321:] == pytest.approx(2000.0)
    assert not off[:41].any()
    assert zero.offset(r, 320) == pytest.approx(1000.0)
    assert zero.offset(r, 321) == pytest.approx(2000.0)


def test_without_a_reset_or_a_hall_sensor_the_reading_stays() -> None:
    r = recording([], np.full(N, 1.5), np.full(N, 1.5))
    assert np.array_equal(zero.contraction(r), r["laser"]) and zero.offset(r, 500) == 0.0
    r = recording([100], np.full(N, 1.5), np.full(N, 1.5))
    kept = [c for c in r.columns if c.name != "hall_position"]
    r = Recording.from_arrays(kept, [r[c.name] for c in kept], 1e-3, {})
    assert np.array_equal(zero.contraction(r), r["laser"]) and zero.offset(r, 500) == 0.0


def test_without_a_quiet_time_nothing_is_known() -> None:
    swinging = 1.5 + 0.02 * np.sin(2.0 * np.pi * 7.0 * np.arange(N) * 1e-3)
    assert zero.offset(recording([100], np.full(N, 1.5), swinging), 500) == 0.0
    hall = np.full(N, 1.5)
    hall[101:] = np.nan
    r = recording([100], np.full(N, 1.5), np.full(N, 1.5))
    values = [hall if c.name == "hall_position" else r[c.name] for c in r.columns]
    assert zero.offset(Recording.from_arrays(r.columns, values, 1e-3, {}), 500) == 0.0


@pytest.mark.slow
def test_both_stages_at_once_are_in_place_when_the_carriage_is(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_text(
        '[[moves]]\nmacro = "100 mm"\nhold = "1 ms"\n[[moves]]\nmicro = "1.5 mm"\nhold = "1 s"\n'
    )
    tree = Settings()._replace(controller=Settings().controller.joined("terminal,inverse", "test"))
    quick = {"controller.sequence." + k: v for k, v in (("overlap", 1), ("wait", 0.1))}
    tree = changed(tree, {**quick, "controller.sequence.dwell": 0.05})
    run = api.run(path, settings=tree)
    coarse, fine = api.moves(run)
    assert fine.start_s < coarse.arrived_s + 0.2
    assert fine.arrived_s is not None and fine.arrived_s < 0.5
    assert abs(fine.final_error) < 3.0 and abs(fine.true_error) < 0.6
