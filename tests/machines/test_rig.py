"""A machine's twin as a rig: interpreted and compiled give the same bits."""

from __future__ import annotations

import math

import pytest

from macromicro.errors import InputError
from macromicro.machines import axis
from macromicro.machines.rig import CompiledTwin, Twin
from macromicro.types import SAFE


def driven(twin: Twin) -> list[tuple[float, float]]:
    seen = []
    with twin as rig:
        for k in range(60):
            shown = rig.read()
            assert rig.read() == pytest.approx(shown, nan_ok=True)  # a reading changes nothing
            seen.append((shown.t, shown.encoder))
            assert math.isnan(shown.hall) and math.isnan(shown.laser)
            rig.write(SAFE._replace(motor=4.0 * math.sin(0.2 * k) + 2.0))
            rig.clock.wait(rig.dt)
    return seen


def test_the_compiled_twin_shows_the_same_bits() -> None:
    tree = axis.DEFAULT.with_("encoder.noise", "3 um")
    plain = driven(Twin(axis.KIND, tree, 5))
    assert driven(CompiledTwin(axis.KIND, tree, 5)) == plain
    assert [t for t, _ in plain] == pytest.approx([k * tree.timing.period for k in range(60)])
    assert len({count for _, count in plain}) > 20
    assert driven(Twin(axis.KIND, tree, 6)) != plain


def test_a_twin_that_is_left_gives_no_effort() -> None:
    twin = Twin(axis.KIND, axis.DEFAULT)
    with twin as rig:
        rig.write(SAFE._replace(motor=5.0))
    for _ in range(20):
        twin.clock.wait(twin.dt)
    assert twin.read().encoder == 0.0
    with pytest.raises(InputError, match="period"):
        twin.clock.wait(2.0 * twin.dt)
