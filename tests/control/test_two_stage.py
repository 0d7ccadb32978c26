"""The controller as an object does what its kernel does."""

from __future__ import annotations

from typing import Any

import pytest

from macromicro.control import supervisor
from macromicro.control.supervisor import DONE, FAULT, MACRO, MICRO, SETTLING, WAITING
from macromicro.control.two_stage import TwoStage
from macromicro.types import Sample

from .test_supervisor import DT, NAN, made, plan


def test_a_step_is_the_kernels() -> None:
    asked: list[Any] = []

    def kernel(*given: Any) -> Any:
        asked.append(given)
        return supervisor.step(*given)

    p, what, s = made(), plan((NAN, 0, 30.0, 0.0)), supervisor.begin(7.0)
    sample = Sample(0.0, 7.0, 0.1, 0.0, 1.0, 0.0)
    assert TwoStage(p, kernel).step(s, what, sample, DT) == supervisor.step(p, what, s, sample, DT)
    assert asked == [(p, what, s, sample, DT)]


@pytest.mark.parametrize("phase", [WAITING, MACRO, SETTLING, MICRO, DONE, FAULT])
def test_only_a_plan_that_is_done_is_finished(phase: int) -> None:
    s = supervisor.begin(0.0)._replace(phase=phase)
    assert TwoStage(made()).finished(s) == (phase == DONE)
