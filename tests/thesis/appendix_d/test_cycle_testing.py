"""Figures of the cycle testing (Appendix D)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from tests.thesis.ended import collected

from macromicro.drawing.exhibit import Drawn
from macromicro.thesis.appendix_d import cycle_testing
from macromicro.thesis.appendix_d.cycle_testing import CycleData, shares
from macromicro.thesis.contents import find

PROCEDURE = find("cycle-testing")


@pytest.fixture(scope="module")
def data() -> CycleData:
    made: CycleData = collected("cycle-testing")
    return made


@pytest.fixture(scope="module")
def drawn(data: CycleData) -> dict[str, Drawn]:
    return {n: draw(data) for n, draw in PROCEDURE.figures.items()}


def axes_of(drawn: Drawn) -> list[Any]:
    """The axes of a figure."""
    assert not isinstance(drawn.body, str | tuple)
    return list(drawn.body.axes)


@pytest.mark.parametrize(
    ("number", "values"),
    [
        ("D.9", lambda c: c.tau1),
        ("D.10", lambda c: c.tau2),
        ("D.11", lambda c: c.fall),
        ("D.12", lambda c: c.tau1 + c.fall),
    ],
)
def test_eleven_light_lines_and_their_mean(
    data: CycleData, drawn: dict[str, Drawn], number: str, values: Any
) -> None:
    """Each line is a run as measured, the bold one their mean."""
    lines = axes_of(drawn[number])[0].get_lines()
    runs = [values(cycle_testing.measure(c)) for c in data.counts]
    assert len(runs) == 11
    for line, run in zip(lines, runs, strict=False):
        np.testing.assert_array_equal(line.get_ydata(), run)
        assert line.get_linewidth() < 1.0
    mean = lines[11]
    np.testing.assert_allclose(mean.get_ydata(), np.mean(runs, axis=0))
    assert mean.get_linewidth() > 2.0


def test_shares_are_those_of_the_claim(data: CycleData) -> None:
    """Claim A5: the curve at 150 counts is the mean that the claim judges; no share is lost."""
    first, last = shares(data.counts)
    each = [cycle_testing.measure(c) for c in data.counts]
    np.testing.assert_allclose(first[1], np.mean([c.first for c in each], axis=0))
    np.testing.assert_allclose(last[1], np.mean([c.last for c in each], axis=0))
    assert np.all(first.sum(axis=0) <= 100.0 + 1e-9)
    assert last[:, cycle_testing.LATE :].sum(axis=0) == pytest.approx(100.0, abs=1.0)


def test_both_share_figures_have_one_scale(drawn: dict[str, Drawn]) -> None:
    first, last = (axes_of(drawn[n])[0] for n in ("D.13", "D.14"))
    assert first.get_ylim() == last.get_ylim()
    assert [x.get_label() for x in first.get_lines()] == [f"{n} counts" for n in range(149, 153)]


def test_a_rig_without_a_thermometer(data: CycleData) -> None:
    """Claim A6, Figure D.12: the run's room is unknown, and neither says otherwise."""
    blind = data._replace(room=np.full(len(data.room), np.nan))
    claim = next(c for c in cycle_testing.claims(blind) if c.id == "A6")
    assert "nothing measured" in claim.reason and "nan" not in claim.reason
    figure = PROCEDURE.figures["D.12"](blind)
    assert not axes_of(figure)[1].texts
    assert "temperature" not in figure.caption
