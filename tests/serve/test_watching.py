"""What the position file is told of the rows."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from macromicro.control.live import messages as m
from macromicro.nominal import PERIOD
from macromicro.serve import _watching
from macromicro.serve.settings import LiveSettings
from macromicro.serve.shared import INDEX, PLAIN, Shared, Status

STOOD = round(_watching.STOOD_S / PERIOD)


def shown(counts: list[float], mode: int = m.DISABLED) -> Shared:
    shared = Shared.create(5000)
    for count in counts:
        row = np.zeros(len(INDEX))
        row[INDEX["macro_position"]], row[INDEX["mode"]] = count, mode
        shared.show(row, Status()[:-1])
    return shared


@pytest.mark.parametrize(
    ("counts", "moving"),
    [
        ([5.0], False),
        ([0.0, 1.0, 2.0], True),
        ([0.0, 95.0, *[101.0] * (STOOD - 1)], True),  # it still coasted within the time
        ([0.0, 95.0, *[101.0] * STOOD], False),
        ([5.0, 6.0] * STOOD, False),  # it stands on an edge
        ([0.0, np.nan, 0.0], False),
    ],
)
def test_a_carriage_that_coasts_is_moving(counts: list[float], moving: bool) -> None:
    found = _watching.place(shown(counts), "homed", LiveSettings())
    assert found is not None
    row, place = found
    assert place.moving is moving
    assert (row, place.encoder) == (len(counts), counts[-1])


def test_a_motion_is_moving_where_nothing_counts() -> None:
    found = _watching.place(shown([5.0] * 2 * STOOD, m.MOVING_MICRO), "homed", LiveSettings())
    assert found is not None
    assert found[1].moving


@pytest.mark.parametrize(("period", "moving"), [(PERIOD, True), (2.0 * PERIOD, False)])
def test_how_long_it_has_stood_goes_by_the_loops_period(period: float, moving: bool) -> None:
    settings: Any = SimpleNamespace(period=period, homing=(0,), telemetry=PLAIN)
    found = _watching.place(shown([0.0, 95.0, *[101.0] * (STOOD // 2)]), "homed", settings)
    assert found is not None
    assert found[1].moving is moving


def test_before_the_first_row_there_is_no_place() -> None:
    assert _watching.place(Shared.create(5000), "", LiveSettings()) is None
