"""What a law of another package must keep: whoever keeps it passes, whoever does not is told."""

from __future__ import annotations

import math
import re
from typing import Annotated, Any, NamedTuple

import pytest

from macromicro.control import contract
from macromicro.control.stage_law import Sample, StageLaw, Target
from macromicro.kernel import kernel
from macromicro.schema.par import Par
from tests.control import own_laws
from tests.control.own_laws import Gains, InCounts, Memory, begin, plain, slide, sliding

GOOD = StageLaw("good", Gains, Memory, begin, slide)


@pytest.mark.parametrize(("law", "speed"), [(sliding, "yes"), (plain, "no"), (InCounts, "no")])
def test_good_laws_keep_everything(law: Any, speed: str) -> None:
    found = list(contract.check(law))
    assert contract.broken(law) == []
    assert [each.what for each in found] == [
        "shape", "gains", "signature", "memory", "purity", "finite effort", "direction",
        "other periods", "compiled",
    ]  # fmt: skip
    assert found[-1].found.startswith(speed) and all(not each.remedy for each in found)


calls = 0


def _forgetful(g: Gains, m: Memory, target: Target, sample: Sample, dt: float) -> Any:
    global calls  # noqa: PLW0603
    calls += 1
    return slide(g, m, target, sample, dt)[0], 1e-3 * calls + g.slope * (
        target.position - sample.position
    )


def _divides(g: Gains, m: Memory, target: Target, sample: Sample, dt: float) -> Any:
    return m, 1.0 / (target.position - sample.position)


def _overflows(g: Gains, m: Memory, target: Target, sample: Sample, dt: float) -> Any:
    error = target.position - sample.position
    return m, error if abs(error) < 100.0 else math.inf


def _backwards(g: Gains, m: Memory, target: Target, sample: Sample, dt: float) -> Any:
    return slide(g, m, target, sample, dt)[0], -slide(g, m, target, sample, dt)[1]


def _whole(g: Gains, m: Memory, target: Target, sample: Sample, dt: float) -> Any:
    return Memory(0, m.speed), slide(g, m, target, sample, dt)[1]  # type: ignore[arg-type]


def _changes(g: Gains, m: Memory, target: Target, sample: Sample, dt: float) -> Any:
    return (m.place, m.speed), slide(g, m, target, sample, dt)[1]


def _slow_alone(g: Gains, m: Memory, target: Target, sample: Sample, dt: float) -> Any:
    return m, math.nan if dt > 5e-3 else slide(g, m, target, sample, dt)[1]


@kernel
def _words(g: Gains, m: Memory, target: Target, sample: Sample, dt: float) -> Any:
    return m, float(f"{slide(g, m, target, sample, dt)[1]}".strip())


class _Low(NamedTuple):
    slope: Annotated[float, Par("1/s", "", "", lo=1.0)] = 0.5
    reach: Annotated[float, Par("V", "", "")] = 2.0


class _Count(NamedTuple):
    slope: Annotated[int, Par("1/s", "", "")] = 1
    reach: Annotated[float, Par("V", "", "")] = 2.0


@pytest.mark.parametrize(
    ("changes", "what", "said"),
    [
        ({"unit": "mm"}, "shape", "'m' or 'count'"),
        ({"gains": _Low}, "gains", "1 1/s or more"),
        ({"gains": _Count}, "gains", "floats alone"),
        ({"step": lambda gains, memory: None}, "signature", r"step\(gains, memory, target, s"),
        ({"start": lambda gains: None}, "signature", r"start\(gains, sample\)"),
        ({"step": _forgetful}, "purity", "keep nothing outside of the memory"),
        ({"step": _divides}, "memory", "ZeroDivisionError"),
        ({"step": _overflows}, "finite effort", "inf V"),
        ({"step": _backwards}, "direction", "check the sign"),
        ({"step": _whole}, "memory", "place = 0"),
        ({"step": _changes}, "memory", "a memory of type tuple"),
        ({"step": _slow_alone}, "other periods", "nan V at a period of 0.01 s"),
        ({"step": lambda g, m, t, s, dt: (m, 1)}, "memory", "an effort of type int"),
        ({"step": lambda g, m, t, s, dt: 1.0}, "memory", "step returns"),
        ({"step": _words, "start": own_laws.start}, "compiled", "it does not compile"),
    ],
)
def test_what_is_broken_is_said(changes: dict[str, Any], what: str, said: str) -> None:
    found = [each for each in contract.check(GOOD._replace(**changes)) if not each.passed]
    assert [each.what for each in found][:1] == [what]
    text = " ".join(contract.broken(GOOD._replace(**changes)))
    assert re.search(said, text), text
    assert all(each.remedy for each in found)
