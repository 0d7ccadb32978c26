"""The questionable register names the part of any machine that is at fault."""

from __future__ import annotations

import pytest

from macromicro.machines import guard_words
from macromicro.rig import codes
from macromicro.serve import faults
from macromicro.serve.scpi.status import bit_of

TIME, TEMPERATURE, STAGE, MICRO = 2, 4, 9, 10


@pytest.mark.parametrize("machine", [faults.STAGE, faults.AXIS, faults.AXIS + 200])
@pytest.mark.parametrize("code", guard_words.TEXTS)
def test_faults_of_a_stage(machine: int, code: int) -> None:
    """None of them says that a micro-stage failed, as their numbers below 100 would."""
    others = {guard_words.HOT: TEMPERATURE, guard_words.CLOCK: TIME, guard_words.ILLEGAL: None}
    assert bit_of(machine + code) == others.get(code, STAGE)


@pytest.mark.parametrize(
    ("code", "bit"),
    [
        (codes.ENCODER_JUMP, STAGE),
        (codes.HALL_NOISY, MICRO),
        (codes.CLOCK, TIME),
        (codes.CLOCK_STANDS, TIME),
        (codes.TOO_HOT, TEMPERATURE),
        (faults.LATE, TIME),
        (faults.LOST_COUNTS, STAGE),
        (faults.RIG_FAILED, None),
        (faults.LOOP_SILENT, None),
    ],
)
def test_faults_of_the_two_stages_and_of_the_loop(code: int, bit: int | None) -> None:
    assert bit_of(code) == bit
