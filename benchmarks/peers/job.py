"""The common job: the tuned macro-stage controller on the tuned macro model, 10 s at 1 kHz.

A step of 2800 counts. The controller (4.10) sees the position in whole counts, its effort is
lifted over the dead zone (Section 4.2.3) and saturated; the model is the saturation, the
dead zone with a jump (4.5) and the linear dynamics (4.3), (4.4). Every peer does the same
operations in the same order, so that all may agree to the last bit:

    seen[k]   = floor(x[k]),  e[k] = target - seen[k]
    u[k]      = within(limit, lifted(width, now e[k] + before e[k-1]))
    x[k+1]    = x[k] + dt v[k]
    v[k+1]    = b net(u[k]) - a v[k],     x[0] = v[0] = e[-1] = 0.

Needs nothing but Python, so that the peers' own environments can import it; only `default`
asks the package, for the parameters.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import NamedTuple


class Job(NamedTuple):
    """Taps [V/count], dead-zone inverse and limit [V], (4.3) and its period [s], (4.5), the
    model's dead zone and saturation [V], target [counts], number of periods."""

    now: float
    before: float
    width: float
    limit: float
    a: float
    b: float
    dt: float
    a0: float
    delta: float
    zone: float
    rail: float
    target: float = 2800.0
    samples: int = 10_000


def default() -> Job:
    """The job with the package's default controller and model."""
    from macromicro.control import settings
    from macromicro.control.settings import Control
    from macromicro.models.macro import MacroModel

    law = settings.prepare(Control(macro_law="pd-tuned")).macro
    model = MacroModel()
    now, before = law.own
    return Job(
        now, before, law.dead_zone, law.limit, *model.linear, model.a0, model.delta, model.width,
        model.limit,
    )  # fmt: skip


def written(job: Job, place: Path) -> Path:
    """`place`, with the job in it for `read`."""
    place.write_text(json.dumps(job._asdict()), encoding="utf-8")
    return place


def read(place: Path) -> Job:
    """The job that `written` left."""
    return Job(**json.loads(place.read_text(encoding="utf-8")))


def effort(job: Job, error: float, last: float) -> float:
    """The controller [V] on this and the last error [counts]."""
    return sent(job, job.now * error + job.before * last)


def sent(job: Job, u: float) -> float:
    """What becomes of the PD's effort [V]: lifted over the dead zone, within the limit."""
    if u > 0.0:
        u += job.width
    elif u < 0.0:
        u -= job.width
    return min(max(u, -job.limit), job.limit)


def net(job: Job, volts: float) -> float:
    """What of `volts` [V] moves the linear dynamics: saturation, dead zone, jump."""
    u = min(max(volts, -job.rail), job.rail)
    rest = u - job.zone if u > job.zone else u + job.zone if u < -job.zone else 0.0
    return math.copysign(job.a0 + job.delta * abs(rest), rest) if rest else 0.0
