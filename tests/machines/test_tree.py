"""What every tree of settings of a machine has: the choice of a law, rules, changes."""

from __future__ import annotations

from typing import NamedTuple

import pytest

from macromicro.control import stage_pi
from macromicro.control.outside import NoGains
from macromicro.errors import InputError
from macromicro.machines import compositions, tree
from macromicro.machines.parts import Timing, Travel
from macromicro.machines.tree import derive_all, machine_tree
from tests.control.own_laws import Gains

SLIDING = "tests.control.own_laws:sliding"
COUNTS = "tests.control.own_laws:InCounts"
RULES = (
    ("controller.kp", lambda t: 2.0 * t.travel.high),
    ("controller.ki", lambda t: 3.0 * t.controller.kp),
)


@machine_tree(stage_pi.LAW, RULES, lambda t: [("travel.high", t.travel.high, "less")][: t.n()])
class Tree(NamedTuple):
    """Of a machine."""

    timing: Timing = Timing()
    travel: Travel = Travel()
    controller: stage_pi.StagePi = stage_pi.StagePi()

    def n(self) -> int:
        """Whether it is too long."""
        return int(self.travel.high > 1.0)


def test_a_tree_has_the_law_of_its_machine_and_what_follows():
    first = derive_all(Tree())
    assert first.law == "pi" and first.own == NoGains() and first._fields[:2] == ("law", "own")
    assert first.controller[:2] == (0.6, pytest.approx(1.8))
    assert Tree.__doc__ == "Of a machine." and Tree.__name__ == "Tree"
    longer = first.with_("travel.high", "500 mm")
    assert longer.controller[:2] == (1.0, 3.0)
    set_by_hand = first.with_("controller.kp", "7 V/mm")
    assert set_by_hand.with_("travel.high", "500 mm").controller[:2] == (7000.0, 21000.0)
    with pytest.raises(InputError, match=r"travel.high: '2000 mm'; accepted: less"):
        first.with_("travel.high", "2 m")


def test_a_law_of_ones_own_joins_with_its_gains():
    own = tree.with_law(derive_all(Tree()), SLIDING, "--law")
    assert own.law == SLIDING and own.own == Gains()
    assert tree.gains(own) == Gains() and tree.gains_set(own) == "own"
    back = tree.with_law(own, "pi", "--law")
    assert tree.gains(back) == back.controller and tree.gains_set(back) == "controller"
    assert tree.with_law(back, SLIDING, "--law").own == Gains()
    other = own._replace(own=Gains()._replace(slope=7.0))
    assert tree.with_law(other, SLIDING, "--law").own.slope == 7.0  # found gains stay
    named = derive_all(Tree()).with_({"law": SLIDING, "own.slope": "9 1/s"})
    assert named.with_("law", "pi").law == "pi"
    assert named.own.slope == 9.0


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("pj", "--law: 'pj'; accepted: one of pi; or MODULE:LAW"),
        ("tests.nowhere:it", "--law: no module tests.nowhere"),
        (COUNTS, "is in count. This machine needs a law in m"),
    ],
)
def test_a_law_that_is_none_is_refused(name, words):
    with pytest.raises(InputError) as refused:
        tree.with_law(derive_all(Tree()), name, "--law")
    assert words in str(refused.value)


@pytest.mark.parametrize(
    ("machine", "table"),
    [
        ("axis", '[friction]\npart = "mylab.parts:seal"\n[friction.own]\nlevel = "6 N"\n'),
        ("rotary", 'friction.part = "bristles"\n'),
        ("xy", '[y.friction]\npart = "mylab.parts:seal"\n'),
    ],
)
def test_a_friction_part_of_ones_own_is_refused_with_the_remedy(tmp_path, machine, table):
    file = tmp_path / "seal.toml"
    file.write_text(f'machine = "{machine}"\n{table}')
    with pytest.raises(InputError, match=r"friction\.part: .*Remove it, or write a stage of your"):
        compositions.load(file)
