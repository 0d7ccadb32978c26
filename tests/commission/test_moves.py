"""Moves to places of a machine's travel."""

from __future__ import annotations

import math

from macromicro.commission import _axis_gains, _verifying
from macromicro.machines import machine as machines
from macromicro.machines import planning


def test_places_are_shares_of_the_travel_in_whole_counts() -> None:
    tree = machines.named("axis", "machine").settings
    made = _verifying.test_moves("a title", "a meaning", (0.25, 0.9), 0.3, tree)
    travel = tree.travel.high / tree.encoder.pitch
    assert made.target.tolist() == [math.floor(0.25 * travel), math.floor(0.9 * travel)]
    assert (made.title, made.hold.tolist()) == ("a title", [0.3, 0.3])
    plan = planning.plan(made, tree)
    assert plan.target.tolist() == [n * tree.encoder.pitch for n in made.target]


def test_no_place_that_verifies_is_one_by_which_gains_were_found_or_chosen() -> None:
    tree = machines.named("axis", "machine").settings
    chosen = _verifying.test_moves("", "", _verifying.COMPARED_SHARES, 0.1, tree).target
    searched, verified = _axis_gains.programme(tree).target, _verifying.programme(tree).target
    far = 0.005 * tree.travel.high / tree.encoder.pitch
    for mine, others in ((verified, [*chosen, *searched]), (chosen, searched)):
        assert min(abs(a - b) for a in mine for b in others) > far
