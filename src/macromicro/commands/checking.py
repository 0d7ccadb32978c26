"""A law, machine, part or rig of a user's own, looked at for ``macromicro doctor``."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import suppress

from macromicro.commands import asking
from macromicro.control import contract, outside
from macromicro.control.settings import Control
from macromicro.control.stage_law import Sample, StageLaw, Target
from macromicro.errors import InputError
from macromicro.machines import contract as machine_contract
from macromicro.machines import machine as machines
from macromicro.machines import part_contract
from macromicro.nominal import PERIOD
from macromicro.plant import own_part
from macromicro.rig import contract as rig_contract
from macromicro.rig import contract_moving
from macromicro.rig.opening import TWIN, open_rig
from macromicro.rig.session import BENCH, Fixture
from macromicro.schema import plugins
from macromicro.serve.health import FAIL, OK, Finding
from macromicro.units import quantity

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
        yield told(each)
    if whole:
        yield Finding("speed", OK, _speed(outside.checked(made, name, OPTION)))


def machine(name: str) -> Iterator[Finding]:
    """What a machine keeps and what not, and how fast it runs."""
    for each in machine_contract.check(machines.named(name, "--machine")):
        yield told(each)


def part(name: str) -> Iterator[Finding]:
    """What a part keeps and what not."""
    made = own_part.imported(name, "--part")
    with suppress(InputError):  # what is wrong is said below; compiled beside its own sources
        own_part.find(name, "--part")
    for each in part_contract.check(made, name):
        yield told(each)


def rig(name: str, move: str | None, *, yes: bool) -> Iterator[Finding]:
    """What a rig keeps and what not; with `move` (text in V) what it does in motion, too."""
    volts = 0.0 if move is None else volts_of(move, "--move")
    fixture, whole = fixture_of(name), True
    if move is not None and fixture.kind != BENCH:
        raise InputError("--move", move, f"a rig of kind bench, not {fixture.kind}")
    for each in rig_contract.check(fixture):
        whole = whole and each.passed
        yield told(each)
    if move is not None and whole:
        asking.agreed(contract_moving.said(fixture, volts), f"--rig {name}", yes=yes)
        for each in contract_moving.check(fixture, volts):
            yield told(each)


def fixture_of(name: str) -> Fixture:
    """The rig of a name, of one stage alone with a period of its own; `InputError` for the twin,
    which has nothing to look at."""
    if name == TWIN:
        raise InputError("--rig", name, "a rig of yours (docs/rigs.md): the twin keeps it all")
    found = open_rig(name, alone=True)
    return open_rig(name) if found.has("hall") else found


def volts_of(text: str, option: str) -> float:
    """A voltage that a person permits, V; `InputError` if it is none, or too high."""
    volts = quantity(text, "V", option)
    if not 0.0 < volts <= 10.0:
        raise InputError(option, text, "more than 0 V, at most 10 V")
    return volts


def told(each: contract.Finding) -> Finding:
    """A finding of a contract as `doctor` prints it."""
    return Finding(each.what, OK if each.passed else FAIL, each.found, each.remedy)


def _speed(law: StageLaw) -> str:
    """How long a period of the law takes, interpreted, as the live machine runs it."""
    gains, target = outside.given(law, law.gains()), Target(0.1, 0.0, 0.0, math.inf)
    memory, began = law.start(gains, Sample(0.0, 0.0)), time.perf_counter()
    for k in range(_CALLS):
        sample = Sample(k * PERIOD, 1e-6 * k)
        memory, _ = law.step(gains, memory, target, sample, PERIOD)
    each = 1e6 * (time.perf_counter() - began) / _CALLS
    return f"{each:.2g} us a period interpreted, as `serve` runs it (a period is 1000 us)"
