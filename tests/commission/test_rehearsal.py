"""Moves on the model of an axis: the tolerance within which it comes to rest."""

from __future__ import annotations

from macromicro.commission import _axis_gains
from macromicro.machines import machine as machines
from macromicro.machines import planning, results, runs
from macromicro.schema import config

# What a commissioning found: friction that hunts under a slow loop over counts of 0.2 um.
SLOW = {
    "amplifier": {"mode": "voltage", "gain": 1.0, "full_scale": "10 V", "supply": "10 V",
                  "current": "0.935 A"},
    "drive": {"kind": "linear"},
    "encoder": {"at": "load", "pitch": "0.202 um", "rate": "1e8 counts/s"},
    "motor": {"force": "10.7 N/A", "resistance": "10.7 ohm", "inductance": "107 uH"},
    "load": {"mass": "0.0328 kg", "stop_low": "-4 mm", "stop_high": "192 mm"},
    "friction": {"coulomb": "0.544 N", "stribeck": "0.187 N", "stribeck_speed": "3 mm/s"},
    "timing": {"period": "1 ms", "delay": "1 ms"},
}  # fmt: skip


def axis() -> machines.Machine:
    return machines.named("axis", "machine")


def late(tree: object, tolerance: float) -> int:
    """Moves that do not arrive within a tolerance, of one run."""
    made = axis()
    law = tree._replace(  # type: ignore[attr-defined]
        arrival=tree.arrival._replace(tolerance=tolerance),  # type: ignore[attr-defined]
        controller=tree.controller._replace(rest=0.5 * tolerance),  # type: ignore[attr-defined]
    )
    what = _axis_gains.programme(law)
    plan = planning.plan(what, law)
    done = runs.record(made, law, plan, seed=11)
    moves = results.moves(done.recording, plan, law.arrival, made.kind.place)
    return sum(m.arrived_s is None for m in moves)


def test_a_slow_axis_with_a_fine_encoder_is_given_what_it_can_hold() -> None:
    tree = config.overridden(axis().settings, SLOW, "found")
    counts, known = 4.0 * tree.encoder.pitch, tree.arrival.tolerance
    assert 2.0 * counts < known < 100e-6 and late(tree, counts) >= 2
    assert late(tree, known) == 0 and _axis_gains.settling_time(axis(), tree) is None


def test_a_model_that_rests_less_closely_than_expected_is_given_more() -> None:
    tree = config.overridden(axis().settings, SLOW, "found")
    arrival = tree.arrival._replace(tolerance=4.0 * tree.encoder.pitch)
    found = _axis_gains.settling_time(axis(), tree._replace(arrival=arrival))
    assert found is not None and 2.0 * arrival.tolerance < found < 100e-6
    assert late(tree, found) == 0


def test_an_axis_that_rests_on_its_counts_keeps_them() -> None:
    tree = axis().settings
    assert _axis_gains.arrives(axis(), tree) and _axis_gains.settling_time(axis(), tree) is None


def test_what_is_not_known_is_drawn_either_way_under_the_same_law() -> None:
    tree = axis().settings
    drawn = list(_axis_gains.drawn_friction(tree))
    gives = {one.friction.presliding / tree.friction.presliding for one in drawn}
    fades = {one.friction.stribeck_speed / tree.friction.stribeck_speed for one in drawn}
    assert len(drawn) == 4 and gives == fades == {0.5, 2.0}
    assert all(one.controller == tree.controller for one in drawn)


def test_a_fault_is_no_arrival() -> None:
    tree = axis().settings
    strict = tree._replace(guard=tree.guard._replace(error=1e-6))
    assert not _axis_gains.arrives(axis(), strict)
    assert _axis_gains.settling_time(axis(), strict) is None
