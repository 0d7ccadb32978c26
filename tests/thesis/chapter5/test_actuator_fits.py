"""The actuator model put together from made-up steps, and how a model is judged."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.columns import Column
from macromicro.errors import InputError
from macromicro.hysteresis import from_density
from macromicro.hysteresis.preisach import Preisach
from macromicro.hysteresis.table import FodTable
from macromicro.identify import heating
from macromicro.identify.wire_model import hysteresis
from macromicro.models import actuator
from macromicro.models.heating import Modes, step_response
from macromicro.models.weighted_gain import Exponential, exponential
from macromicro.recording import Recording
from macromicro.thesis.chapter5.actuator_models import NEAR_STOP, against, judge, thesis

COLUMNS = (Column("t", "s", ""), Column("laser", "um", ""), Column("ctrl", "V", ""))
MODES = Modes(1.3, 0.09, 0.012, 0.7, 0.2, 0.1)
TABLE = FodTable.from_everett(
    from_density(lambda up, down: np.where(up - down < 1.0, 1.0, 0.0), 20.0, 0.5, 161), 0.2, 4.2
)
# Below the stop (5.5), less hot by a third; above it two steps that run into the stop.
LOW = (1.49, 1.5, 1.525, 1.55, 1.575)
GOALS = {v: 0.7 * exponential(Exponential(), v) for v in LOW} | {1.7: 95.0, 1.8: 130.0}


def trial(warm: np.ndarray, ctrl: np.ndarray, dt: float) -> Recording:
    """A record of these temperatures, at the table's positions."""
    x = Preisach(TABLE).run(np.r_[20.0, warm])[1:]
    return Recording.from_arrays(COLUMNS, [np.arange(len(x)) * dt, 1e3 * x, ctrl], dt, {})


def stepped(volts: float) -> Recording:
    t = np.arange(0.0, 400.0, 0.1)
    return trial(25.0 + GOALS[volts] * step_response(MODES, t), np.full(len(t), volts), 0.1)


def cooled() -> Recording:
    t = np.arange(0.0, 9.0, 0.02)
    warm = 25.0 + 50.0 * np.exp(-np.maximum(t - 5.0, 0.0) / 0.9)
    return trial(warm, np.where(t < 5.0 - 1e-9, 1.55, 0.0), 0.02)


def test_a_hysteresis_is_the_table_with_its_range() -> None:
    found = hysteresis(TABLE)
    assert (found.low, found.span) == (0.2, 4.0)
    np.testing.assert_allclose(found.table.values, TABLE.values / 4.0)


@pytest.fixture(scope="module")
def fitted() -> object:
    return thesis(TABLE, {v: [stepped(v)] for v in GOALS}, [cooled()], 1.55)


def test_the_thesis_model_is_found_again(fitted: object) -> None:
    """Gain by the voltages below the stop, and by 95 % of the stroke above it."""
    from macromicro.thesis.chapter5.actuator_models import ThesisFit

    assert isinstance(fitted, ThesisFit)
    whole = float(step_response(MODES, 399.0))
    assert fitted.steady == pytest.approx({v: GOALS[v] * whole for v in LOW}, rel=2e-3)
    for volts, goal in fitted.goals.items():
        assert goal == pytest.approx(GOALS[volts], rel=0.02)
    assert list(fitted.goals) == [1.7, 1.8]
    np.testing.assert_allclose(fitted.heating.modes[:3], MODES[:3], rtol=0.05)
    np.testing.assert_allclose(fitted.heating.modes[3:], np.array(MODES[3:]) / whole, rtol=0.05)
    assert fitted.cooling.time == pytest.approx(0.9, abs=0.03)
    assert fitted.model.cool_time == fitted.cooling.time
    assert fitted.model.ambient == 25.0
    assert fitted.linearised.asymptote == fitted.nonlinear.asymptote > 1.002 * fitted.steady[1.575]


def test_the_line_has_its_asymptote_above_all_temperatures(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """By two thousandths at least, where the curve's own lies lower: the logarithm needs it."""
    real = heating.static_gain

    def low(volts: list[float], rise: list[float]) -> heating.GainFit:
        return real(volts, rise)._replace(asymptote=0.99 * rise[-1])

    monkeypatch.setattr(heating, "static_gain", low)
    found = thesis(TABLE, {v: [stepped(v)] for v in (*LOW, 1.8)}, [cooled()], 1.55)
    assert found.linearised.asymptote == pytest.approx(1.002 * found.steady[1.575], rel=1e-12)


def test_above_one_voltage_only_the_upper_gain_is_nothing() -> None:
    """One step beyond the stop tells no exponential."""
    steps = {v: [stepped(v)] for v in (*LOW, 1.8)}
    found = thesis(TABLE, steps, [cooled()], 1.55)
    assert found.model.gain.scale == 0.0 and len(found.goals) == 1


def test_steps_that_end_at_the_stop_tell_no_steady_temperature(fitted: object) -> None:
    assert 0.95 < NEAR_STOP < 1.0
    with pytest.raises(InputError, match="steps"):
        thesis(TABLE, {1.5: [stepped(1.5)]}, [cooled()], 1.55)
    with pytest.raises(InputError, match="clear of the stop"):
        thesis(TABLE, {v: [stepped(v)] for v in GOALS}, [cooled()], 1.8)


def test_a_judgement_is_at_the_end_on_the_way_and_throughout() -> None:
    """Shares of the stroke. On the way: to 1.5 times the first 98 %; the end: the last 2 %."""
    t = 5.0 + np.arange(1001) * 0.01
    measured = np.minimum((t - 5.0) / 2.0, 1.0) * 3.0
    model = measured.copy()
    model[:295] += 0.1  # up to 2.95 s; 98 % are reached at 1.96 s, 1.5 times that is 2.94 s
    model[295:980] += 0.3
    model[980:] -= 0.2  # the last 0.2 s
    found = judge(t, measured, model, 4.0)
    assert found.steady == pytest.approx(-0.05)
    assert found.dynamic == pytest.approx(0.025)
    whole = (295 * 0.1**2 + 685 * 0.3**2 + 21 * 0.2**2) / 1001
    assert found.whole == pytest.approx(np.sqrt(whole) / 4.0)


def test_against_a_record_the_model_gets_what_was_sent(fitted: object) -> None:
    from macromicro.thesis.chapter5.actuator_models import ThesisFit

    assert isinstance(fitted, ThesisFit)
    record = stepped(1.55)
    found = against(fitted.model, [record, record])
    made, _ = actuator.simulate(fitted.model, np.full(4000, 1.55), 0.1)
    wanted = judge(np.arange(4000) * 0.1, record["laser"] * 1e-3, made, 4.0)
    assert found == pytest.approx(wanted, rel=1e-9)
    assert found.whole < 0.05
