"""A control law of a user's own, looked at for ``macromicro doctor --law``."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import suppress

from macromicro.control import contract, outside
from macromicro.control.settings import Control
from macromicro.control.stage_law import Sample, StageLaw, Target
from macromicro.errors import InputError
from macromicro.machines import contract as machine_contract
from macromicro.machines import machine as machines
from macromicro.nominal import PERIOD
from macromicro.schema import plugins
from macromicro.serve.health import FAIL, OK, Finding

OPTION = "--law"
_CALLS = 20_000


def law(name: str) -> Iterator[Finding]:
    """What a law keeps and what not, and how long a period of it takes."""
    if not plugins.spelled(name):  # an entry point, or a slip
        Control().joined(name, OPTION)
    made, whole = outside.imported(name, OPTION), True
    with suppress(InputError):  # what is wrong is said below; compiled beside its own sources
        outside.find(name, OPTION)
    for each in contract.check(made, name):
        whole = whole and each.passed
        yield Finding(each.what, OK if each.passed else FAIL, each.found, each.remedy)
    if whole:
        yield Finding("speed", OK, _speed(outside.checked(made, name, OPTION)))


def machine(name: str) -> Iterator[Finding]:
    """What a machine keeps and what not, and how fast it runs."""
    made = machines.named(name, "--machine")
    if made is None:
        raise InputError("--machine", name, "a machine of one stage")
    for each in machine_contract.check(made):
        yield Finding(each.what, OK if each.passed else FAIL, each.found, each.remedy)


def _speed(law: StageLaw) -> str:
    """How long a period of the law takes, interpreted, as the live machine runs it."""
    gains, target = law.gains(), Target(0.1, 0.0, 0.0)
    memory, began = law.start(gains, Sample(0.0, 0.0)), time.perf_counter()
    for k in range(_CALLS):
        sample = Sample(k * PERIOD, 1e-6 * k)
        memory, _ = law.step(gains, memory, target, sample, PERIOD)
    each = 1e6 * (time.perf_counter() - began) / _CALLS
    return f"{each:.2g} us a period interpreted, as `serve` runs it (a period is 1000 us)"
