"""The guard's state as a row of numbers for compiled code."""

from __future__ import annotations

from typing import Any

from macromicro.kernel import kernel
from macromicro.models.electrothermal import Heating
from macromicro.rig.envelope import Envelope
from macromicro.rig.guard import Heat, Watch
from macromicro.rig.sensing import Seen

_SEEN = 4
_MACRO = _SEEN + len(Seen._fields)
_MICRO = _MACRO + len(Envelope._fields)
_HEATING = _MICRO + len(Envelope._fields)
_HEAT = _HEATING + len(Heating._fields)
FIELDS = _HEAT + 2


@kernel
def store(s: Watch, row: Any) -> None:
    row[0] = float(s.fault)
    row[1] = s.value
    row[2] = s.limit
    row[3] = s.time
    row[_SEEN] = s.seen.encoder
    row[_SEEN + 1] = s.seen.encoder_age
    row[_SEEN + 2] = s.seen.hall
    row[_SEEN + 3] = s.seen.hall_age
    row[_SEEN + 4] = s.seen.same
    row[_SEEN + 5] = s.seen.railed
    row[_SEEN + 6] = s.seen.pushed
    row[_SEEN + 7] = s.seen.leant
    row[_SEEN + 8] = s.seen.against
    row[_SEEN + 9] = s.seen.jump
    row[_SEEN + 10] = s.seen.possible
    row[_SEEN + 11] = s.seen.before
    row[_SEEN + 12] = s.seen.noise
    row[_SEEN + 13] = s.seen.time
    row[_SEEN + 14] = s.seen.passed
    row[_SEEN + 15] = s.seen.stood
    row[_MACRO] = s.macro.reference
    row[_MACRO + 1] = s.macro.allowed
    row[_MACRO + 2] = s.macro.timer
    row[_MICRO] = s.micro.reference
    row[_MICRO + 1] = s.micro.allowed
    row[_MICRO + 2] = s.micro.timer
    row[_HEATING] = s.heat.heating.s0
    row[_HEATING + 1] = s.heat.heating.s1
    row[_HEATING + 2] = s.heat.heating.s2
    row[_HEAT] = s.heat.anchor
    row[_HEAT + 1] = s.heat.idle


@kernel
def restored(row: Any) -> Watch:
    k = _SEEN
    return Watch(
        int(row[0]),
        row[1],
        row[2],
        row[3],
        Seen(
            row[k],
            row[k + 1],
            row[k + 2],
            row[k + 3],
            row[k + 4],
            row[k + 5],
            row[k + 6],
            row[k + 7],
            row[k + 8],
            row[k + 9],
            row[k + 10],
            row[k + 11],
            row[k + 12],
            row[k + 13],
            row[k + 14],
            row[k + 15],
        ),
        Envelope(row[_MACRO], row[_MACRO + 1], row[_MACRO + 2]),
        Envelope(row[_MICRO], row[_MICRO + 1], row[_MICRO + 2]),
        Heat(
            Heating(row[_HEATING], row[_HEATING + 1], row[_HEATING + 2]),
            row[_HEAT],
            row[_HEAT + 1],
        ),
    )
