"""Telemetry for the plots: nothing that happened within a pixel is lost."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from macromicro.serve.shared import INDEX, NAMES
from macromicro.serve.web import bins


@pytest.mark.parametrize(("first", "rows", "width"), [(0, 10, 4), (3, 9, 4), (7, 1, 4), (5, 6, 1)])
def test_bins_hold_smallest_and_largest(first: int, rows: int, width: int) -> None:
    values = np.random.default_rng(1).normal(size=(2, rows))
    found = bins.bin_rows(values, first, width)
    numbers = np.arange(first, first + rows) // width
    assert found.shape == (numbers[-1] - numbers[0] + 1, 2, 2)
    for k in range(found.shape[0]):
        part = values[:, numbers == numbers[0] + k]
        assert found[k, :, 0] == pytest.approx(part.min(axis=1), rel=1e-6)
        assert found[k, :, 1] == pytest.approx(part.max(axis=1), rel=1e-6)


def test_missing_readings_leave_the_others() -> None:
    values = np.array([[1.0, np.nan, 3.0, np.nan]])
    found = bins.bin_rows(values, 0, 2)
    assert found[:, 0, :].tolist() == [[1.0, 1.0], [3.0, 3.0]]
    assert np.isnan(bins.bin_rows(np.full((1, 3), np.nan), 0, 4)).all()


def test_a_spike_of_one_period_survives_a_minute_in_few_columns() -> None:
    values = np.zeros((1, 60_000))
    values[0, 12_345] = 7.0
    view = bins.view(1, 60.0, 300)
    assert bins.bin_rows(values, 0, view.width)[:, 0, 1].max() == 7.0


@pytest.mark.parametrize("span", bins.SPANS)
@pytest.mark.parametrize("columns", [bins.LEAST, 601, bins.MOST])
def test_a_view_shows_its_span_in_no_more_columns(span: float, columns: int) -> None:
    view = bins.view(3, span, columns)
    assert view.columns <= columns
    assert view.rows >= span * 1e3 > view.rows - view.width


@pytest.mark.parametrize("period", [1.2e-3, 2e-3, 0.1])
def test_a_view_of_another_period_has_as_many_seconds(period: float) -> None:
    view = bins.view(3, 10.0, 400, period)
    assert view.columns <= 400
    assert view.rows * period == pytest.approx(10.0, abs=view.width * period)
    block = np.zeros((len(NAMES), 5))
    head = bins.HEADER.unpack_from(bins.Plots(NAMES, 1.0).frame(view, 5, block))
    assert head[5] == pytest.approx(view.width * period)


def test_a_frame_tells_place_and_time_of_its_bins() -> None:
    view = bins.view(9, 10.0, 1000)
    block = np.zeros((len(NAMES), 25))
    block[INDEX["t"]] = np.arange(100, 125) * 1e-3
    # Raw count 110 is coordinate 100 of the homed frame: 100 / 14 mm, and 0.5 mm of contraction.
    block[INDEX["macro_position"]] = 110.0
    block[INDEX["macro_reference"]] = 124.0
    block[INDEX["hall_position"]] = 0.5
    block[INDEX["position"]] = 100.0 / 14.0 + 0.5
    block[INDEX["uncertainty"]] = 35.7
    data = bins.Plots(NAMES, 0.2 / 2800.0).frame(view, 124, block)
    kind, number, count, channels = struct.unpack_from("<4I", data)
    assert (kind, number, count, channels) == (bins.KIND, 9, 3, len(bins.CHANNELS))
    assert struct.unpack_from("<8d", data, 16) == pytest.approx(
        (10, 0.01, 0.124, 124, 100.0 / 14.0 + 0.5, 100.0 / 14.0, 0.5, 35.7)
    )
    values = np.frombuffer(data, np.float32, offset=bins.HEADER.size).reshape(count, channels, 2)
    assert values[0, 0, 0] == pytest.approx(114.0 / 14.0)
    assert values[0, 1, 1] == pytest.approx(100.0 / 14.0)
    assert bins.Plots(NAMES, 1.0).frame(view, 3, block[:, :0]) == b""
