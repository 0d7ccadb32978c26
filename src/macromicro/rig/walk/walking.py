"""The guided first power-up: each step asks for confirmation."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from macromicro.conformance import Finding, failed
from macromicro.rig._strokes import Driven
from macromicro.rig.session import Fixture
from macromicro.rig.walk import steps
from macromicro.rig.walk.steps import Known, Limits

GO, SKIP, END = "go", "skip", "end"
Ask = Callable[[steps.Step, list[str]], str]


def walk(fixture: Fixture, limits: Limits, ask: Ask) -> Iterator[Finding]:
    """Walk through the steps that a rig has the channels for; it is closed between the steps."""
    known, found = Known(), []
    skipped, without = [], []
    ended = False
    for step in steps.of(fixture):
        if not step.ready(known):
            without.append(step.name)
            continue
        answer = SKIP if ended else ask(step, step.said(limits, known))
        ended = ended or answer == END
        if answer != GO:
            skipped.append(step.name)
            continue
        each, known = _gone(fixture, step, limits, known)
        found.append(each)
        yield each
    yield _sum(found, skipped, without)


def _gone(fixture: Fixture, step: steps.Step, limits: Limits, known: Known) -> steps.Done:
    try:
        with fixture.open() as rig:
            return step.go(Driven(fixture, rig), limits, known)
    except Exception as error:
        remedy = "fix what the message names, then begin again"
        return failed(step.name, error, remedy), known


def _sum(found: list[Finding], skipped: list[str], without: list[str]) -> Finding:
    right = [each.what for each in found if each.passed]
    wrong = [each.what for each in found if not each.passed]
    parts = [f"right: {', '.join(right)}" if right else "nothing was found right"]
    for words, names in (("not right", wrong), ("skipped", skipped)):
        parts += [f"{words}: {', '.join(names)}"] if names else []
    parts += [f"not looked at without a direction: {', '.join(without)}"] if without else []
    remedy = "" if not wrong else f"start with {wrong[0]}: later steps may depend on it"
    if not wrong and not right:
        remedy = "nothing was looked at: answer y where the rig may do what is said"
    return Finding("walk", bool(right) and not wrong, "; ".join(parts), remedy)
