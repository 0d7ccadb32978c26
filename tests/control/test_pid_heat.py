"""The law `pid-heat` on the wire of the law `inverse`, of which it knows two voltages."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from macromicro.api import load_settings
from macromicro.control import contract, pid_heat
from macromicro.control.pid_heat import LAW, Gains, Memory
from macromicro.control.stage_law import Sample, StageLaw, Target
from macromicro.control.stage_pi import LAW as PI
from macromicro.control.stage_pi import StagePi
from macromicro.errors import InputError
from macromicro.kernel import compiled
from macromicro.settings import Settings

from .inverse.wires import DT, Wire

P = Gains()
REST = Target(2e-3, 0.0, 0.0)


class Driven(Wire):
    """The wire under any law of a stage."""

    def __init__(self, law: StageLaw, gains: object) -> None:
        super().__init__()
        self.law, self.gains = law, gains
        self.memory = law.start(gains, Sample(0.0, 0.0))

    def period(self, goal: float, speed: float = 0.0, missing: bool = False) -> float:
        aim = Target(1e-3 * goal, 1e-3 * speed, 0.0)
        sample = Sample(self.t, math.nan if missing else 1e-3 * self.seen)
        self.memory, volts = compiled(self.law.step)(self.gains, self.memory, aim, sample, DT)
        self._after(volts)
        return volts


def late(places: np.ndarray, goal: float) -> float:
    """Seconds until it stays within 10 um."""
    return (int(np.flatnonzero(np.abs(places - goal) > 0.01)[-1]) + 1) * DT


def test_it_keeps_the_contract_of_laws() -> None:
    assert contract.broken(LAW) == []


def test_it_is_quicker_than_the_pi_both_ways_and_on_a_small_step() -> None:
    own, pi = Driven(LAW, P), Driven(PI, StagePi(low=1.3, high=1.9))
    taken = [
        [late(w.go(goal, 2.5), goal) for w in (own, pi)] for goal in (2.0, 1.0, 2.5, 2.45, 2.5)
    ]
    assert all(mine < theirs for mine, theirs in taken)
    assert sum(mine for mine, _ in taken) < 0.8 * sum(theirs for _, theirs in taken)
    assert np.abs(np.array(own.places[-500:]) - 2.5).max() < 5e-3


def test_the_observer_follows_a_ramp_without_a_lag_and_goes_on_without_readings() -> None:
    s = LAW.start(P, Sample(0.0, 1e-3))
    for k in range(1, 200):
        s, _ = LAW.step(P, s, REST, Sample(k * DT, 1e-3 + 5e-3 * k * DT), DT)
    assert s.speed == pytest.approx(5e-3, rel=1e-6)
    assert s.place == pytest.approx(1e-3 + 5e-3 * 199 * DT, rel=1e-9)
    before = s.place
    s, _ = LAW.step(P, s, REST, Sample(0.2, math.nan), DT)
    assert s.place == pytest.approx(before + 5e-3 * DT) and s.speed == pytest.approx(5e-3)


def test_without_a_turn_it_observes_on_and_forgets_its_integral() -> None:
    s = Memory(1e-3, 2e-3, 0.7, 0.01)
    s = LAW.rest(P, s, Sample(0.0, math.nan), DT)  # type: ignore[misc]
    assert s == Memory(pytest.approx(1e-3 + 2e-3 * DT), 2e-3, 0.0, 0.0)


def test_a_start_without_a_reading_is_extended() -> None:
    assert LAW.start(P, Sample(0.0, math.nan)) == Memory(0.0, 0.0, 0.0, 0.0)


def test_the_place_is_led_by_its_speed_and_the_target_by_its_own() -> None:
    gains = Gains(ki=0.0, kp=1e3, lead=0.05, step=0.0, low=1.0, high=2.0)
    still = Memory(1.9e-3, 0.0, 0.0, 0.0)
    sample = Sample(0.0, 1.9e-3)
    assert LAW.step(gains, still, REST, sample, DT)[1] == pytest.approx(1.1)
    ahead = REST._replace(velocity=2e-3)
    assert LAW.step(gains, still, ahead, sample, DT)[1] == pytest.approx(1.2)
    moving = still._replace(speed=1e-3, place=1.9e-3 - 1e-3 * DT)
    assert LAW.step(gains, moving, REST, sample, DT)[1] == pytest.approx(1.05)


def test_far_below_it_gives_full_heat_and_beyond_it_none_at_all() -> None:
    at = Memory(0.0, 0.0, 0.0, 0.0)
    assert LAW.step(P, at, REST, Sample(0.0, 0.0), DT)[1] == pytest.approx(P.high, abs=P.step)
    beyond = Memory(3e-3, 0.0, 0.0, 0.01)
    s, volts = LAW.step(P, beyond, REST, Sample(0.0, 3e-3), DT)
    assert volts == 0.0 and s.owed == 0.0


def test_the_integral_is_held_back_while_the_heat_is_full() -> None:
    """Back-calculation as in Section 5.3.2: it ends where ki e = -kaw (given - wanted)."""
    gains = P._replace(kp=1e3)
    s = Memory(1e-3, 0.0, 0.0, 0.0)
    for _ in range(5000):
        s, _ = LAW.step(gains, s, REST, Sample(0.0, 1e-3), DT)
    wanted = gains.kp * 1e-3 + s.share
    assert gains.ki * 1e-3 == pytest.approx(gains.kaw * (wanted - 1.0), rel=1e-6)


def test_what_the_converter_rounds_is_owed() -> None:
    """A share between two steps is held in the mean."""
    gains = Gains(kp=0.0, ki=0.0, kaw=0.0, low=1.0, high=2.0, step=0.01)
    s, volts = Memory(2e-3, 0.0, 0.4033, 0.0), []
    for _ in range(1000):
        s, each = LAW.step(gains, s, REST, Sample(0.0, 2e-3), DT)
        volts.append(each)
    assert np.mean(volts) == pytest.approx(1.4033, abs=2e-5)
    assert abs(s.owed) <= 0.01
    full = s._replace(share=0.996, owed=0.2)
    for owed in (0.2, -0.2):
        s, _ = LAW.step(gains, full._replace(owed=owed), REST, Sample(0.0, 2e-3), DT)
        assert abs(s.owed) <= pid_heat.MOST_OWED


def test_voltages_in_the_wrong_order_are_refused(tmp_path: Path) -> None:
    tree = Settings()
    tree = tree._replace(controller=tree.controller.joined("pid-heat", "test"))
    assert isinstance(tree.controller.fine, Gains) and not P.problems()
    path = tmp_path / "own.toml"
    path.write_text(
        '[controller]\nmicro_law = "pid-heat"\nfine = { low = "2 V", high = "1.9 V" }\n'
    )
    with pytest.raises(InputError, match=r"controller\.fine\.low: '2 V'; accepted: below"):
        load_settings(path)
