"""Every fault of the guard has words: what happened, on what evidence, what to do."""

from __future__ import annotations

import pytest

from macromicro.rig import codes, guard
from macromicro.rig.faults import TEXTS, describe
from macromicro.rig.limits import Limits
from macromicro.schema.par import entries


def test_all_is_well_is_no_fault() -> None:
    assert describe(guard.fresh()) is None


def test_every_code_has_its_words() -> None:
    known = set(range(codes.ILLEGAL, codes.CLOCK_STANDS + 1))
    assert set(TEXTS) == known
    assert len({text.name for text in TEXTS.values()}) == len(known)


@pytest.mark.parametrize("code", sorted(TEXTS))
def test_evidence_holds_the_numbers(code: int) -> None:
    unit = 1e-3 if code == codes.MICRO_LOST else 1.0  # mm
    watch = guard.fresh()._replace(fault=code, value=3.25 * unit, limit=2.5 * unit, time=1.5)
    fault = describe(watch)
    assert fault is not None
    assert (fault.code, fault.time_s) == (code, 1.5)
    assert "1.500 s" in fault.evidence and "not read back" in fault.evidence
    assert any(shown in fault.evidence for shown in ("3.25", "3 "))
    assert "{" not in fault.evidence
    assert fault.message.endswith(".") and fault.remedy.endswith(".")


@pytest.mark.parametrize("code", sorted(TEXTS))
def test_remedies_name_limits_that_exist(code: int) -> None:
    known = {f"guard.{entry.path}" for entry in entries(Limits())}
    words = TEXTS[code].remedy.replace(";", " ").replace(",", " ").split()
    named = {word.rstrip(".") for word in words if word.startswith("guard.")}
    assert named and named <= known


def test_a_following_error_of_the_micro_stage_is_told_in_mm() -> None:
    """The guard has it in m."""
    lost = guard.fresh()._replace(fault=codes.MICRO_LOST, value=1.25e-3, limit=0.7e-3)
    fault = describe(lost)
    assert fault is not None
    assert fault.evidence.startswith("following error 1.250 mm, allowed 0.700 mm,")
