"""Parts of other packages in the settings of shipped machines."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import pytest

from macromicro.batch.stage_job import StageJob
from macromicro.errors import InputError
from macromicro.machines import axis, equipped, machine, owned, planning, rotary, runs
from macromicro.machines.joint.settings import DEFAULT as XY
from macromicro.place import ANGLE
from macromicro.plant.rubbing import FrictionPart
from macromicro.robustness import stage as robustness
from macromicro.schema import config
from macromicro.schema.par import Par
from macromicro.sweep import subject
from tests.machines import own

own.parts()  # so that its name is found
SEAL = own.SEAL
AXIS = machine.MACHINES[0]


class Grip(NamedTuple):
    level: Annotated[float, Par("N*m", "level", "a test", lo=0.0)] = 0.03


grip = FrictionPart("grip", Grip, lambda p, s, x, v, h: (0.0, p.level / (abs(v) + 1e-4)),
                    place=ANGLE)  # fmt: skip
GRIP = "tests.machines.test_owned:grip"


def test_its_parameters_are_settings_and_gains_follow_from_its_sheet(tmp_path: Path) -> None:
    file = tmp_path / "axis.toml"
    file.write_text(own.PART_SETTINGS.replace("mylab.parts:seal", SEAL))
    _, tree = machine.load(file)
    assert tree.friction.own.level == 6.0 and tree.friction.coulomb == 6.0
    assert tree.friction.stribeck == 0.0 and tree.friction.viscous == 3.0
    plain = axis.DEFAULT.with_({"friction.coulomb": "6 N", "friction.stribeck": "0 N",
                                "friction.viscous": "3 N*s/m"})  # fmt: skip
    assert tree.controller == plain.controller and tree.motion == plain.motion
    again = machine.as_toml(AXIS, tree)
    assert 'level = "6 N"  # friction of the cold seal (mine)' in again
    file.write_text(again)
    assert machine.load(file)[1] == tree
    assert tree.with_("friction.own.rise", "5 N*s/m").friction.viscous == 5.0
    kept = tree.with_("friction.viscous", "1 N*s/m").with_("friction.own.rise", "5 N*s/m")
    assert kept.friction.viscous == 1.0  # set by hand
    back = tree.with_("friction.part", "bristles")
    assert axis.prepare(back).friction.coulomb == 6.0


def test_what_suits_no_axis_is_refused() -> None:
    with pytest.raises(InputError, match=r"friction.part: .*seal is in m. Choose a part in rad"):
        rotary.DEFAULT.with_("friction.part", SEAL)
    with pytest.raises(InputError, match=r"friction.own.level: '-1 N'; accepted: 0 N or more"):
        axis.DEFAULT.with_({"friction.part": SEAL, "friction.own.level": "-1 N"})
    with pytest.raises(InputError, match=r"friction.own.level.*unknown key"):
        axis.DEFAULT.with_("friction.own.level", "1 N")


def test_in_plain_python_it_runs_at_once() -> None:
    """On the rotary axis, with lines and without: interpreted, as its kind says."""
    tree = rotary.DEFAULT.with_("friction.part", GRIP)
    made = machine.under(machine.MACHINES[3], tree)
    assert made.kind.plain and made.kind.place == ANGLE
    assert not machine.under(AXIS, axis.DEFAULT.with_("friction.part", SEAL)).kind.plain
    lined = tree.with_("amplifier.enable", "line")
    assert rotary.kind(lined).lines and rotary.kind(lined).plain
    assert tree.friction.coulomb == 0.05  # no sheet: what the settings say
    plan = planning.plan(planning.usual(tree), tree)
    plan = plan._replace(target=plan.target[:1])
    found = runs.record(made, tree, plan)
    assert found.outcome.fault is None
    assert found.recording["true_position"].max() > 10.0  # deg


def test_two_axes_have_one_each() -> None:
    tree = XY.with_({"y.friction.part": SEAL, "y.friction.own.level": "8 N"})
    assert tree.x.friction.part == "bristles" and tree.y.friction.own.level == 8.0
    assert tree.y.friction.coulomb == 8.0 and tree.y.controller != XY.y.controller
    assert tree.path.speed < XY.path.speed  # which follows from both
    slow = min(tree.y.motion.velocity, XY.y.motion.velocity)
    assert tree.path.speed == pytest.approx(np.hypot(tree.x.motion.velocity, slow), rel=1e-3)


def test_what_is_not_known_about_it_is_drawn() -> None:
    tree = axis.DEFAULT.with_("friction.part", SEAL)
    rows = robustness.uncertain(machine.under(AXIS, tree), tree)
    assert [r.parts for r in rows if r.name == "seal"] == [(("friction.own.level", 1.0),)]
    assert not {"coulomb", "breakaway", "viscous"} & {r.name for r in rows}
    _, trees = robustness.machines(AXIS, tree, rows, 12, 3)
    levels = [each.friction.own.level for each in trees]
    assert 2.8 <= min(levels) < 3.5 and 5.0 < max(levels) <= 6.0
    assert all(each.controller == tree.controller for each in trees)
    usual = robustness.uncertain(AXIS, axis.DEFAULT)
    assert {"coulomb", "breakaway", "viscous"} < {r.name for r in usual}


def test_a_sweep_knows_its_parameters_and_sources() -> None:
    tree = axis.DEFAULT.with_("friction.part", SEAL)
    job = StageJob("axis", settings=tree)
    assert "friction.own.level" in subject.parameters(job)
    assert [name for name, _ in subject.laws(job)] == [f"part {SEAL}"]
    assert subject.laws(StageJob("axis")) == ()
    assert equipped.kind(tree) is axis.KIND and owned.of(axis.DEFAULT) is None


def test_a_part_joins_by_dotted_or_nested_words_alike() -> None:
    nested = config.overridden(axis.DEFAULT, {"friction": {"part": SEAL}}, "here")
    assert nested == config.overridden(axis.DEFAULT, {"friction.part": SEAL}, "here")
    assert owned.named(nested, {"friction.part": SEAL}, "here") == {}
    with pytest.raises(InputError, match=r"here, friction.part: '7'"):
        config.overridden(axis.DEFAULT, {"friction.part": 7}, "here")
