"""What a user may set about control."""

from __future__ import annotations

import pytest

from macromicro.control import settings
from macromicro.control.macro import LAWS
from macromicro.control.pi import PiAntiWindup
from macromicro.control.settings import MICRO_LAWS, Control


@pytest.mark.parametrize(
    ("law", "switch", "lift"),
    [
        ("pid", "as designed", 0.0),
        ("pid", "on", 3.0),
        ("pd-initial", "as designed", 3.0),
        ("pd-initial", "off", 0.0),
        ("pd-tuned", "as designed", 3.0),
        ("pd-tuned", "off", 0.0),
    ],
)
def test_every_macro_law_with_and_without_the_inverse(law: str, switch: str, lift: float) -> None:
    """Section 4.3: the PID is the benchmark without compensation."""
    made = settings.prepare(Control(macro_law=law, dead_zone_inverse=switch))
    assert made.macro.law == LAWS.index(law)
    assert made.macro.dead_zone == lift
    assert made.macro.limit == 5.0


@pytest.mark.parametrize("law", MICRO_LAWS)
def test_every_micro_law_brings_its_own_gains(law: str) -> None:
    """Section 5.3."""
    spec = Control(micro_law=law)
    own = {"p": spec.p, "pi": spec.pi, "pi-antiwindup": spec.pi_antiwindup}[law]
    assert settings.prepare(spec).micro == PiAntiWindup(*own)


def test_fan_is_passed_on() -> None:
    """Section 6.3.1."""
    assert settings.prepare(Control(), fan=True).fan == 1.0
    assert settings.prepare(Control()).fan == 0.0


@pytest.mark.parametrize("name", ["p", "pi", "pi_antiwindup"])
def test_limits_the_wrong_way_round_are_named(name: str) -> None:
    spec = Control()
    law = getattr(spec, name)._replace(low=2.0, high=1.5)
    found = spec._replace(**{name: law}).problems()
    assert [path for path, _, _ in found] == [f"{name}.low"]
    assert spec.problems() == []
