"""Which targets the whole positioner reaches, from wherever it stands."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.control.live import messages as m
from macromicro.control.live import targets
from macromicro.control.live.messages import Accepted, Refused

from .bench import homed

OWN = homed().p.settings.limits


@pytest.mark.parametrize("by_laser", [False, True])
@given(macro_high=st.floats(200.0, OWN.macro_high), micro_high=st.floats(1.0, OWN.micro_high))
def test_both_ends_of_the_reach_are_accepted_and_no_more_is(
    by_laser: bool, macro_high: float, micro_high: float
) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(targets, "by_laser", lambda p, s: by_laser)
        limits = OWN._replace(macro_high=macro_high, micro_high=micro_high)
        bench = homed()
        assert bench.ask(m.SetLimits(limits)) == Accepted()
        tolerance = bench.s.laws.sequence.tolerance
        low, high = targets.reach(bench.p.settings, limits, tolerance)
        assert limits.whole_low <= low < high <= limits.whole_high
        for target in (low, high):
            found = targets.whole(bench.p, bench.s, target, "move", False)
            assert not isinstance(found, Refused), found
        if by_laser:
            beyond = targets.whole(bench.p, bench.s, high + 1e-8, "move", False)
            assert isinstance(beyond, Refused)
