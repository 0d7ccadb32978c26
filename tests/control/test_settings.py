"""What a user may set about control."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from macromicro.control import calibration, settings
from macromicro.control.macro import NAMES
from macromicro.control.pi import PiAntiWindup
from macromicro.control.settings import MICRO_LAWS, Control
from macromicro.errors import InputError
from macromicro.schema.config import load_overrides
from macromicro.schema.par import Entry, entries
from macromicro.settings import Settings

NUMBERS = [e for e in entries(Control()) if not e.par.choices]


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
    assert made.macro.law == NAMES.index(law)
    assert made.macro.dead_zone == lift
    assert made.macro.limit == 5.0


@pytest.mark.parametrize("law", MICRO_LAWS)
def test_every_micro_law_brings_its_own_gains(law: str) -> None:
    """Section 5.3."""
    spec = Control(micro_law=law)
    own = {"p": spec.p, "pi": spec.pi, "pi-antiwindup": spec.pi_antiwindup}[law]
    assert settings.prepare(spec).micro == PiAntiWindup(*own)


@pytest.mark.parametrize("law", MICRO_LAWS)
def test_the_gains_of_every_micro_law_are_kept_in_si_and_read_in_mm(law: str) -> None:
    """The kernel takes the five fields as they are: any other unit would be a wrong gain."""
    pars = {e.path: e.par for e in entries(getattr(Control(), law.replace("-", "_")))}
    kept = [(pars[name].unit, pars[name].read_in) for name in ("kp", "ki", "kaw")]
    assert kept == [("V/m", "V/mm"), ("V/(m*s)", "V/(mm*s)"), ("1/s", "1/s")]


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


@pytest.mark.parametrize("name", ["p", "pi", "pi_antiwindup"])
def test_a_law_whose_limit_lies_beyond_ctrls_is_named(name: str) -> None:
    law = getattr(Control(), name)._replace(high=4.0)
    spec = Control(ctrl_limit=3.9)._replace(**{n: getattr(Control(), n)._replace(high=3.0)
                                               for n in ("p", "pi", "pi_antiwindup")})  # fmt: skip
    assert spec.problems() == []
    found = spec._replace(**{name: law}).problems()
    assert found == [(f"{name}.high", 4.0, "at most {ctrl_limit}")]
    assert spec._replace(ctrl_limit=4.0, **{name: law}).problems() == []


@pytest.mark.parametrize(("width", "wrong"), [(2.9, False), (3.0, True)])
def test_a_dead_zone_as_wide_as_the_motors_limit_is_named(width: float, wrong: bool) -> None:
    found = Control(dead_zone=width, motor_limit=3.0).problems()
    assert found == ([("dead_zone", width, "below {motor_limit}")] if wrong else [])


@pytest.mark.parametrize("entry", NUMBERS, ids=lambda e: e.path)
def test_every_number_has_finite_bounds_with_room_for_a_search(entry: Entry) -> None:
    """A tuning searches a decade to either side; what is fixed at 0 is no gain of that law."""
    par, gain = entry.par, entry.path.rpartition(".")[2] in ("kp", "ki", "kd", "kaw")
    assert -math.inf < par.lo <= entry.value <= par.hi < math.inf
    if gain and par.hi > 0.0:
        assert par.lo == 0.0 and 10.0 * entry.value <= par.hi


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("pid.kp", "1e300 V/count"),
        ("pid.kd", "-1 V*s/count"),
        ("pi_antiwindup.kaw", "1e4 1/s"),
        ("sequence.tolerance", "1e308 count"),
        ("sequence.patience", "1e-300 s"),
    ],
)
def test_a_file_with_a_senseless_gain_is_refused(key: str, value: str, tmp_path: Path) -> None:
    file = tmp_path / "wild.toml"
    file.write_text(f'controller.{key} = "{value}"\n')
    with pytest.raises(InputError, match=rf"controller\.{key}.*accepted: from .* to "):
        load_overrides(file, Settings())


def test_the_calibration_is_the_one_given_or_the_shipped_one() -> None:
    other = calibration.default_calibration()._replace(low=0.1)
    assert settings.prepare(Control(), table=other).calibration is other
    assert settings.prepare(Control()).calibration.low == calibration.default_calibration().low
