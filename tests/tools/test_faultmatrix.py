"""The fault matrix: its judge, its tables, and a few of its cells."""

from __future__ import annotations

import math
import os
from pathlib import Path

import pytest

from faultmatrix import table
from faultmatrix.bed import Period, homed
from faultmatrix.bounds import Bounds
from faultmatrix.cells import FALSE, HARMLESS, SAFE_, UNSEEN, Cell, Plan, Trial, healthy, planned
from faultmatrix.judge import Judge
from faultmatrix.matrix import filled, moments
from faultmatrix.subjects import made

BOUNDS = Bounds(1e-5, 0.1, (4.0,), 1e-4)


def judged(*periods: tuple[float, float, bool, float]) -> Judge:
    """True and reported place, trust, volts; one period of 1 ms each."""
    judge = Judge(BOUNDS, 0.0)
    for k, (true, told, trusted, volts) in enumerate(periods):
        judge.see(Period(1e-3 * k, true, told, 1e-5, trusted, (volts,)))
    return judge


def test_a_wrong_position_is_false_only_where_it_is_trusted_for_long() -> None:
    wrong = (1e-3, 0.0, True, 0.0)
    assert judged(*[wrong] * 150).false == 0.0
    assert judged(*[wrong] * 250).false == pytest.approx(1e-3)
    assert judged(*[(1e-3, 0.0, False, 0.0)] * 500).false == 0.0
    assert judged(*[(1e-5, 0.0, True, 0.0)] * 500).false == 0.0
    # Noise that is right now and then is wrong all the same.
    assert judged(*[(1e-3 * (k % 10 != 0), 0.0, True, 0.0) for k in range(500)]).false > 0.0


def test_pushing_without_motion_is_unsafe() -> None:
    assert judged(*[(0.0, 0.0, True, 4.5)] * 1900).unsafe == []
    assert "4.5 V" in judged(*[(0.0, 0.0, True, 4.5)] * 2100).unsafe[0]
    assert judged(*[(2e-4 * k, 2e-4 * k, True, 4.5) for k in range(2100)]).unsafe != []  # too fast
    assert judged(*[(0.0, 0.0, True, 3.9)] * 2100).unsafe == []


def test_speed_counts_while_it_is_driven() -> None:
    fast = [(2e-4 * k, 2e-4 * k, True, 1.0) for k in range(150)]
    assert "times its speed" in judged(*fast).unsafe[0]
    assert judged(*fast[:100]).unsafe == []  # for less than 0.1 s
    assert judged(*[(*each[:3], 0.0) for each in fast]).unsafe == []


def test_when_outputs_are_off_for_good() -> None:
    on, off = (0.0, 0.0, True, 1.0), (0.0, 0.0, True, 0.0)
    assert judged(on, off, on, off, off).off == pytest.approx(3e-3)
    assert math.isnan(judged(off, on).off)


def test_faults_of_one_effect_share_a_row() -> None:
    cells = [
        Cell("wire", "motor-dead", "moving", SAFE_, "stuck", 0.25),
        Cell("wire", "motor-dead", "disabled", UNSEEN, "nothing moves"),
        Cell("wire", "encoder-jump", "moving", FALSE, "1 mm off"),
        Cell("wire", "encoder-jump", "disabled", HARMLESS, ""),
    ]
    text = table.section(cells)
    assert "| `motor-dead` | stuck | 0.25 s | disabled: nothing moves | - |" in text
    assert "| `encoder-jump` | **moving: FALSELY TRUSTED: 1 mm off** | - | - | disabled |" in text
    assert table.bad(cells) == [cells[2]]


@pytest.fixture(scope="module")
def slide(tmp_path_factory: pytest.TempPathFactory) -> Plan:
    subject = made("slide", tmp_path_factory.mktemp("slide"))
    return planned(subject, homed(subject))


@pytest.mark.parametrize(
    ("fault", "mode", "verdict"),
    [
        ("none", "holding", HARMLESS),
        pytest.param("none", "jogging", HARMLESS, marks=pytest.mark.slow),
        pytest.param("encoder-dither", "moving", HARMLESS, marks=pytest.mark.slow),
        pytest.param("encoder-silent", "moving", SAFE_, marks=pytest.mark.slow),
        ("motor-dead", "jogging", SAFE_),
        ("motor-dead", "disabled", UNSEEN),
    ],
)
def test_cells(fault: str, mode: str, verdict: str, slide: Plan) -> None:
    whole = healthy(slide, mode)
    first = Trial(slide, fault, mode, 0.1, whole).run()
    assert first.verdict == verdict, first
    if verdict == SAFE_:
        assert first.seconds < 1.0
    if fault == "motor-dead":  # the same again
        assert str(Trial(slide, fault, mode, 0.1, whole).run()) == str(first)


@pytest.mark.parametrize(
    "kind",
    [
        "turn",
        pytest.param("two-stage", marks=pytest.mark.slow),
        pytest.param("piezo", marks=pytest.mark.slow),
        pytest.param("two-axes", marks=pytest.mark.slow),
    ],
)
def test_every_kind_has_a_verdict(kind: str, tmp_path: Path) -> None:
    cells = filled(kind, tmp_path, quick=True, only=("motor-dead",), modes=("disabled", "moving"))
    assert [cell.verdict for cell in cells] == [UNSEEN, SAFE_]


def test_a_glitch_comes_at_many_moments_of_homing() -> None:
    assert len(moments("home-glitch", "homing", False)) == 10
    assert len(moments("home-on", "homing", False)) == 3
    assert moments("hall-stuck", "moving", False) > moments("motor-dead", "moving", False)


def test_opening_a_machine_leaves_the_environment_as_it_was(tmp_path: Path) -> None:
    before = dict(os.environ)
    subject = made("wire", tmp_path)
    assert "encoder-jump" in subject.faults()
    subject.open()
    assert dict(os.environ) == before
