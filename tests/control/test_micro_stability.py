"""Gains of the micro laws that no slope of the driver makes stable (Section 5.3)."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.control import pid_heat
from macromicro.control.settings import Control
from macromicro.schema.par import replaced
from macromicro.settings import Settings
from macromicro.tuning.loops import ripple

SHIPPED = Control(fine=pid_heat.Gains())


def bound_of(found: list[tuple[str, Any, str]], path: str) -> float:
    """The value that a refusal names, in SI: gains are shown per mm."""
    ((named, _, accepted),) = found
    assert named == path and "stable" in accepted
    return 1e3 * float(accepted.split()[2])


def test_shipped_gains_are_accepted() -> None:
    assert Control().unstable() == []
    assert SHIPPED.unstable() == []


@pytest.mark.parametrize(
    ("path", "most"), [("pi.ki", 1e9), ("pi_antiwindup.ki", 1e9), ("fine.ki", 2e8)]
)
def test_too_much_integral_action_is_refused_with_its_bound(path: str, most: float) -> None:
    found = replaced(SHIPPED, path, most).unstable()
    assert found[0][1] == most
    bound = bound_of(found, path)
    assert replaced(SHIPPED, path, 0.99 * bound).unstable() == []
    assert len(replaced(SHIPPED, path, 1.03 * bound).unstable()) == 1


@pytest.mark.parametrize("law", ["pi", "pi_antiwindup"])
@given(kp=st.floats(1e2, 1e5))
def test_the_integral_is_bounded_by_the_proportional_gain(law: str, kp: float) -> None:
    """Whatever the driver's slope: ki < kp / (driver + sensor + half a period)."""
    plain = replaced(Control(), f"{law}.kp", kp)
    assert replaced(plain, f"{law}.ki", 1.2 * kp / 5.5e-3).unstable() != []
    assert replaced(plain, f"{law}.ki", 0.8 * kp / 5.5e-3).unstable() == []


def test_an_integral_without_a_proportional_gain_is_refused() -> None:
    """Two integrations and a lag: unstable at every gain."""
    bare = replaced(replaced(Control(), "pi.kp", 0.0), "pi.ki", 1e3)
    ((path, _, accepted),) = bare.unstable()
    assert path in ("pi.kp", "pi.ki") and "stable" in accepted


def test_gains_that_no_single_one_mends_are_refused_without_a_bound() -> None:
    both = replaced(replaced(Control(), "pi.kp", 0.0), "pi.ki", 1e9)
    ((path, _, accepted),) = both.unstable()
    assert path == "pi.kp" and accepted == "gains of a stable loop, such as 3000"


def test_an_observer_slower_than_the_loop_is_refused() -> None:
    slow = replaced(SHIPPED, "fine.observer", 1.0)
    ((path, _, accepted),) = slow.unstable()
    assert path == "fine.observer" and accepted.startswith("at most")


def test_what_is_refused_hunts_on_the_bench() -> None:
    """By 0.1 mm and more at 5.3.2's gains with such an integral; 1 um with the shipped one."""
    settings = Settings()
    control = replaced(settings.controller, "pi_antiwindup.ki", 6e5)
    assert control.unstable() != []
    assert ripple(settings._replace(controller=control)) > 100.0
    assert ripple(settings) < 2.0
