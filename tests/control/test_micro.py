"""Whose turn it is in the micro-stage: the PI, or a law by the contract, with its columns."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import pytest

from macromicro import api, recorded
from macromicro.columns import Quantity
from macromicro.control import micro, outside, pi, settings, supervisor
from macromicro.control.inverse.model import Inverse
from macromicro.control.outside import FRESH, Held
from macromicro.control.pi import PiAntiWindup
from macromicro.control.settings import Control
from macromicro.control.stage_law import Sample, StageLaw, Target
from macromicro.errors import InputError
from macromicro.kernel import compiled, kernel
from macromicro.schema.par import Par
from macromicro.settings import Settings

DT = 1e-3


class Gains(NamedTuple):
    """Of a proportional law."""

    kp: Annotated[float, Par("V/m", "gain", "test", lo=0.0)] = 2000.0


class Memory(NamedTuple):
    """What it remembers."""

    periods: Annotated[float, Quantity("1", "periods so far", column="periods")]
    from_place: float


@kernel
def start(p: Gains, sample: Sample) -> Memory:
    """From where it begins."""
    return Memory(0.0, sample.position)


@kernel
def step(p: Gains, s: Memory, target: Target, sample: Sample, dt: float) -> tuple[Memory, float]:
    """P."""
    return Memory(s.periods + 1.0, s.from_place), p.kp * (target.position - sample.position)


@kernel
def turn(p, own, kept, integral, target, sample, dt):
    """`micro.step`, as kernels call it."""
    return micro.step(p, own, kept, integral, target, sample, dt)


@kernel
def pause(own, kept, sample, dt):
    """`micro.rest`."""
    return micro.rest(own, kept, sample, dt)


@kernel
def noted(out, k, own, kept, first):
    """`micro.note`."""
    micro.note(out, k, own, kept, first)


class Calm(NamedTuple):
    """Of the same law with a rest."""

    kp: Annotated[float, Par("V/m", "gain", "test", lo=0.0)] = 2000.0


@kernel
def rest(p: Calm, s: Memory, sample: Sample, dt: float) -> Memory:
    """A hundred periods at once."""
    return Memory(s.periods + 100.0, s.from_place)


P_LAW = StageLaw("p-law", Gains, Memory, start, step)
CALM = StageLaw("calm", Calm, Memory, start, step, rest=rest)
LIMITS = PiAntiWindup(0.0, 0.0, 0.0, 0.0, 3.0)


def joined(name: str = f"{__name__}:P_LAW") -> Control:
    return Control()._with("micro_law", name, "test")


def test_without_a_law_by_the_contract_it_is_the_pi() -> None:
    p, kept = PiAntiWindup(), ()
    aim, seen = Target(1e-3, 0.0, 0.0), Sample(0.0, 4e-4)
    for call in (micro.step, compiled(turn)):
        integral, after, effort = call(p, (), kept, 0.7, aim, seen, DT)
        assert (integral, effort) == pi.step(p, 0.7, 1e-3 - 4e-4, DT) and after == ()
    assert micro.rest((), (), seen, DT) == () == compiled(pause)((), (), seen, DT)
    assert (
        micro.columns(()) == () and micro.begin(()) == () and micro.prepare(outside.NoGains()) == ()
    )


def test_a_law_of_ones_own_starts_where_the_stage_is_and_keeps_the_limits() -> None:
    gains = joined().fine
    own = micro.prepare(gains)
    assert own == (Gains(),)
    first = micro.begin(own)
    assert first == (Held(FRESH, Memory(0.0, 0.0)),)
    for call in (micro.step, compiled(turn)):
        aim = Target(1e-3, 0.0, 0.0)
        integral, kept, effort = call(LIMITS, own, first, 0.5, aim, Sample(0.0, 4e-4), DT)
        assert (integral, effort) == (0.0, 2000.0 * (1e-3 - 4e-4))
        assert kept == (Held(0.0, Memory(1.0, 4e-4)),)
        _, kept, effort = call(LIMITS, own, kept, 0.0, aim, Sample(0.0, -1e-3), DT)
        assert effort == 3.0 and kept[0].memory == Memory(2.0, 4e-4)
        assert call(LIMITS, own, kept, 0.0, aim, Sample(0.0, 2e-3), DT)[2] == 0.0


def test_after_a_rest_a_law_without_rest_begins_anew() -> None:
    own = micro.prepare(joined().fine)
    kept = (Held(0.0, Memory(5.0, 1e-3)),)
    for call in (micro.rest, compiled(pause)):
        assert call(own, kept, Sample(0.0, 0.0), DT) == (Held(FRESH, Memory(5.0, 1e-3)),)


def test_a_law_with_rest_begins_once_and_runs_on() -> None:
    own = micro.prepare(joined(f"{__name__}:CALM").fine)
    begun = micro.begin(own)
    assert begun[0].fresh == 0.0
    aim, seen = Target(1e-3, 0.0, 0.0), Sample(0.0, 4e-4)
    for call, quiet in ((micro.step, micro.rest), (compiled(turn), compiled(pause))):
        kept, periods = begun, []
        for turns in (True, False, True):
            if turns:
                _, kept, effort = call(LIMITS, own, kept, 0.0, aim, seen, DT)
                assert effort == 2000.0 * (1e-3 - 4e-4)
            else:
                kept = quiet(own, kept, seen, DT)
            assert kept[0].fresh == 0.0
            periods.append(kept[0].memory.periods)
        assert periods == [1.0, 101.0, 102.0]


def test_a_wire_cools_in_a_rest() -> None:
    own = micro.prepare(joined("inverse").fine)
    kept = micro.begin(own)
    aim, seen = Target(2e-3, 0.0, 0.0), Sample(0.0, 0.0)
    for _ in range(200):
        _, kept, effort = micro.step(LIMITS, own, kept, 0.0, aim, seen, DT)
    hot = kept[0].memory.model.wire
    assert hot > 5.0 and 0.0 <= effort <= 3.0
    for _ in range(100):
        kept = micro.rest(own, kept, seen, DT)
    assert 0.0 < kept[0].memory.model.wire < hot


def test_columns_follow_from_what_a_law_tells() -> None:
    own = micro.prepare(joined("inverse").fine)
    names = [c.name for c in micro.columns(own)]
    told = ("place", "offset", "wire", "plates", "base", "heat", "loss", "late")
    assert names == [f"micro_law_{n}" for n in told]
    kept = micro.begin(own)
    kept = (Held(0.0, kept[0].memory._replace(offset=0.25)),)
    for call in (micro.note, compiled(noted)):
        out = np.zeros((10, 3))
        call(out, 1, own, kept, 2)
        assert out[:, 1].tolist() == [0.0, 0.0, kept[0].memory.model.x, 0.25, *[0.0] * 6]
        assert not out[:, [0, 2]].any()


def test_both_stages_may_have_laws_with_columns() -> None:
    control = settings.prepare(Control().joined("terminal,inverse", "test"))
    names = [c.name for c in recorded.columns(control)][recorded.ROWS :]
    assert names[0].startswith("law_") and names[-1] == "micro_law_late"
    progress = supervisor.begin(0.0, control)
    for call in (recorded.beside, compiled(recorded.beside)):
        out = np.full((recorded.ROWS + len(names), 1), math.nan)
        call(out, 0, control, progress)
        assert np.isnan(out[: recorded.ROWS]).all()
        assert np.isfinite(out[recorded.ROWS :]).all()


def test_the_pis_place_has_the_limits_of_the_settings() -> None:
    tree = Control(ctrl_limit=4.0).joined("inverse", "test")
    made = settings.prepare(tree)
    assert made.micro == PiAntiWindup(0.0, 0.0, 0.0, 0.0, 4.0) and made.compiles
    assert tree.also() == {"micro_law": ("inverse",)}
    assert isinstance(tree.fine, Inverse)
    assert tree.joined("pi", "test").micro_law == "pi"


def test_a_name_that_is_no_laws_is_refused() -> None:
    with pytest.raises(InputError, match="inverse"):
        Control().joined("invers", "--law")


@pytest.mark.slow
def test_a_run_is_driven_by_it_and_records_its_columns(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_text('[[moves]]\nmicro = ["1 mm", "0.8 mm"]\nhold = "0.4 s"\n')
    runs = []
    for name in ("inverse", f"{__name__}:P_LAW"):
        tree = Settings()._replace(controller=joined(name))
        runs.append(api.run(path, settings=tree))
        assert f"micro_law_{'place' if name == 'inverse' else 'periods'}" in runs[-1]
    done = runs[1]["micro_law_periods"]
    assert done.max() >= 799.0
    assert abs(runs[0]["true_micro"][-1] - 0.8) < 2e-3
