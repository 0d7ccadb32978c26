"""Faults of the board in words."""

from __future__ import annotations

from collections.abc import Mapping

from macromicro.rig.board.protocol import SPEC
from macromicro.rig.codes import OK
from macromicro.rig.faults import TEXTS

_FAULTS = SPEC["faults"]
_OWN = {
    _FAULTS["limit_switch"]: "a limit switch was pushed on",
    _FAULTS["bridge"]: "the motor bridge reports a fault",
    _FAULTS["late"]: "its control interrupt or guard took too long",
    _FAULTS["host_silent"]: "the host was silent",
}


def fault(status: Mapping[str, float]) -> str:
    code = int(status["fault"])
    if code == OK:
        return "none"
    when = f"after {1e-6 * SPEC['period'] * status['when']:.3f} s of its clock"
    if code in _OWN:
        return f"{_OWN[code]}, {when}"
    text = TEXTS.get(code)
    if text is None:
        return f"fault {code}, {when}"
    seen = text.evidence.format(
        value=text.scale * status["value"], limit=text.scale * status["limit"]
    )
    return f"{text.message} ({seen}), {when}. {text.remedy}"
