"""Coverage of printed errors: the page is that of its figures, and quick runs agree with it."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import make_coverage as DOCS
import numpy as np
import pytest

ROOT = Path(__file__).parents[1]


def loaded(path: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(Path(path).stem, ROOT / path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


BENCH = loaded("benchmarks/intervals.py")


def test_the_page_is_that_of_its_figures() -> None:
    rows = DOCS.read()
    shown = f"<!-- coverage -->\n{DOCS.shares(rows)}<!-- end -->"
    assert shown in DOCS.PAGE.read_text(encoding="utf-8")
    methods = {r["method"] for r in rows}
    assert {"drive, inverse dynamics", "drive, output error"} < methods
    assert {f"linear, {m} of order {k}" for m in BENCH.METHODS for k in (1, 2)} < methods
    assert {"drive, on a spring", "drive, decay", "thermal, heating"} < methods
    for method in methods:
        kinds = set(BENCH.DISTURBANCES) - BENCH.LEFT_OUT.get(method, set())
        assert {r["disturbance"] for r in rows if r["method"] == method} == kinds


@pytest.mark.parametrize(
    ("one", "wide", "bias", "text"),
    [
        (68.0, 95.0, 9.0, "68/95"), (60.0, 90.0, 0.0, "60/90"), (76.0, 99.0, 0.0, "76/99"),
        (59.0, 95.0, 0.4, "**59/95**"), (68.0, 89.0, 0.6, "**68/89** biased"),
        (77.0, 95.0, -0.6, "**77/95** biased"), (68.0, 100.0, 0.0, "**68/100**"),
    ],
)  # fmt: skip
def test_a_share_outside_its_range_is_marked(
    one: float, wide: float, bias: float, text: str
) -> None:
    row = {"one": one, "wide": wide, "bias": bias, "scatter": 1.0, "records": 50}
    assert DOCS.cell([row]) == text
    assert DOCS.cell([row, {**row, "told_in": 45}]) == text
    assert DOCS.cell([row, {**row, "told_in": 20}]) == f"{text} in 40 %"
    assert DOCS.cell([{**row, "told_in": 19}]) == "withheld"


def test_shares_of_several_parameters_are_a_range() -> None:
    rows = [
        {"one": one, "wide": wide, "bias": 0.0, "scatter": 1.0, "records": 50}
        for one, wide in ((62.0, 95.0), (70.0, 95.0), (66.0, 97.0))
    ]
    assert DOCS.cell(rows) == "62-70/95-97"
    assert DOCS.cell([*rows, {**rows[0], "one": 40.0}]) == "**40-70/95-97**"


def test_intervals_are_counted_by_what_they_hold(monkeypatch: pytest.MonkeyPatch) -> None:
    """Errors 0, 1, 2, 3 where 1 is told, and 2 for 95 %; a refused record does not count."""

    def estimates(kind: str, seed: int) -> object:
        if seed == 4:
            raise BENCH.InputError("record", "bad", "a good one")
        told = np.array([1.0]), np.array([[1.0], [2.0]])
        yield kind, ("m",), np.array([5.0]), np.array([5.0 + seed]), *told

    monkeypatch.setitem(BENCH.GROUPS, "made", estimates)
    (row,) = BENCH.covered("made", "sensor", 5)
    assert (row["records"], row["one"], row["wide"]) == (4, 50.0, 75.0)
    assert (row["truth"], row["bias"], row["told"]) == (5.0, 1.5, 1.0)
    assert row["scatter"] == pytest.approx(np.std([0, 1, 2, 3]), rel=0.01)


@pytest.mark.parametrize("kind", BENCH.DISTURBANCES)
def test_records_are_those_of_the_machine_and_repeat(kind: str) -> None:
    for made in (lambda s: BENCH.driven(kind, s), lambda s: BENCH.linear(kind, 2, s)):
        (u, x), (again, same) = made(3), made(3)
        np.testing.assert_array_equal(x, same)
        np.testing.assert_array_equal(u, again)
        assert np.ptp(x) > 0.0 and not np.array_equal(u, made(4)[0])


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["white force", "coloured force", "sensor"])
def test_a_drives_errors_hold(kind: str) -> None:
    """Sixty records: shares within three of their own standard errors of what thirty can show."""
    rows = BENCH.covered("drive", kind, 60, first=5000)
    checked = [r for r in rows if kind != "sensor" or r["method"] == "drive, output error"]
    assert len(checked) in (4, 8)
    for row in checked:
        assert 42.0 <= row["one"] <= 94.0 and row["wide"] >= 83.0, row


@pytest.mark.slow
def test_starts_that_a_count_leaves_open_do_not_spoil_elastic_friction() -> None:
    """With starts as measured the search ended at 500 times the noise of the position."""
    _, names, truth, values, std, _ = next(BENCH.elastic("quantised", 5068))
    assert names == BENCH.ELASTIC_NAMES
    np.testing.assert_allclose(values, truth, rtol=1e-4)
    assert np.all(std < 1e-4 * truth)
