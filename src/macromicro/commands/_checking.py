"""Checks of laws, machines and rigs of the user for ``doctor``, and a rig's first power-up."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Iterator
from contextlib import suppress

from macromicro import conformance
from macromicro.commands import asking
from macromicro.control import contract, outside
from macromicro.control.settings import Control
from macromicro.control.stage_law import Sample, StageLaw, Target
from macromicro.errors import InputError, ProblemError
from macromicro.machines import contract as machine_contract
from macromicro.machines import machine as machines
from macromicro.nominal import PERIOD
from macromicro.rig import contract as rig_contract
from macromicro.rig import walk
from macromicro.rig.opening import TWIN, open_rig
from macromicro.rig.session import BENCH, Fixture
from macromicro.schema import plugins
from macromicro.serve.health import FAIL, OK, Finding
from macromicro.units import quantity

OPTION = "--law"
_CALLS = 20_000
MOTOR = 6.0  # V, of the first power-up


def law(name: str) -> Iterator[Finding]:
    """Check a law against its contract and time one of its periods."""
    if not plugins.is_plugin_name(name):  # an entry point, or a slip
        Control().joined(name, OPTION)
    made, whole = outside.import_law(name, OPTION), True
    with suppress(InputError):  # what is wrong is said below; compiled beside its own sources
        outside.find(name, OPTION)
    for each in contract.check(made, name):
        whole = whole and each.passed
        yield as_finding(each)
    if whole:
        yield Finding("speed", OK, _speed(outside.check(made, name, OPTION)))


def machine(name: str) -> Iterator[Finding]:
    """Check a machine against its contract and measure its speed."""
    for each in machine_contract.check(machines.named(name, "--machine")):
        yield as_finding(each)


def rig(name: str, move: str | None, *, yes: bool) -> Iterator[Finding]:
    """Check a rig against its contract; with `move` (text in V) also in motion."""
    volts = 0.0 if move is None else volts_of(move, "--move")
    fixture, whole = fixture_of(name), True
    if move is not None and fixture.kind != BENCH:
        raise ProblemError("--move", f"only for a rig of kind bench, not {fixture.kind}")
    for each in rig_contract.check(fixture):
        whole = whole and each.passed
        yield as_finding(each)
    if move is not None and whole:
        asking.confirm(rig_contract.announce(fixture, volts), f"--rig {name}", yes=yes)
        for each in rig_contract.check_moving(fixture, volts):
            yield as_finding(each)


def fixture_of(name: str) -> Fixture:
    """The rig of that name; the simulated machine is refused, as it needs no check."""
    if name == TWIN:
        raise ProblemError(
            "--rig",
            "the simulated machine needs no check",
            "Name a rig of your own (docs/rigs.md).",
        )
    found = open_rig(name, alone=True)
    return open_rig(name) if found.has("hall") else found


def volts_of(text: str, option: str) -> float:
    """A permitted voltage in V; one that is too high is refused."""
    volts = quantity(text, "V", option)
    if not 0.0 < volts <= 10.0:
        raise InputError(option, text, "more than 0 V, at most 10 V")
    return volts


def as_finding(each: conformance.Finding) -> Finding:
    """A finding as `doctor` prints it."""
    return Finding(each.what, OK if each.passed else FAIL, each.found, each.remedy)


def _speed(law: StageLaw) -> str:
    """Time of one interpreted period, as the live machine runs it."""
    gains, target = outside.arguments(law, law.gains()), Target(0.1, 0.0, 0.0, math.inf)
    memory, began = law.start(gains, Sample(0.0, 0.0)), time.perf_counter()
    for k in range(_CALLS):
        sample = Sample(k * PERIOD, 1e-6 * k)
        memory, _ = law.step(gains, memory, target, sample, PERIOD)
    each = 1e6 * (time.perf_counter() - began) / _CALLS
    return f"{each:.2g} us a period interpreted, as `serve` runs it (a period is 1000 us)"


def check_walk(name: str, move: str | None, heat: str | None, *, yes: bool) -> Iterator[Finding]:
    motor = MOTOR if move is None else volts_of(move, "--move")
    ctrl = walk.CTRL if heat is None else volts_of(heat, "--heat")
    fixture = fixture_of(name)
    if fixture.kind != BENCH:
        raise ProblemError("--walk", f"only for a rig of kind bench, not {fixture.kind}")
    if not yes:
        asking.check_terminal(f"--rig {name}")

    answers = {"y": walk.GO, "yes": walk.GO, "s": walk.SKIP, "skip": walk.SKIP}

    def ask(step: walk.Step, lines: list[str]) -> str:
        if yes and step.by_hand:
            return walk.SKIP
        print(*lines, sep="\n", file=sys.stderr, flush=True)
        if yes:
            return walk.GO
        print("y: do it, s: skip it, any other key ends: ", end="", file=sys.stderr, flush=True)
        answer = sys.stdin.readline().strip().lower()
        return answers.get(answer, walk.END)

    for each in walk.walk(fixture, walk.Limits(motor, ctrl), ask):
        yield as_finding(each)
