"""``macromicro doctor --rig NAME --walk``: the first power-up, confirmed step by step."""

from __future__ import annotations

import sys
from collections.abc import Iterator

from macromicro.commands._checking import fixture_of, told, volts_of
from macromicro.errors import ProblemError
from macromicro.rig import walk as steps
from macromicro.rig.session import BENCH
from macromicro.rig.walk import END, GO, SKIP, walk
from macromicro.serve.health import Finding

MOTOR = 6.0  # V


def rig(name: str, move: str | None, heat: str | None, *, yes: bool) -> Iterator[Finding]:
    motor = MOTOR if move is None else volts_of(move, "--move")
    ctrl = steps.CTRL if heat is None else volts_of(heat, "--heat")
    fixture = fixture_of(name)
    if fixture.kind != BENCH:
        raise ProblemError("--walk", f"only for a rig of kind bench, not {fixture.kind}")
    if not yes and not sys.stdin.isatty():
        raise ProblemError(
            f"--rig {name}",
            "confirmation needed, but standard input is not a terminal",
            "Add --yes.",
        )

    def ask(step: steps.Step, lines: list[str]) -> str:
        if yes and step.by_hand:
            return SKIP
        print(*lines, sep="\n", file=sys.stderr, flush=True)
        if yes:
            return GO
        print("y: do it, s: skip it, any other key ends: ", end="", file=sys.stderr, flush=True)
        answer = sys.stdin.readline().strip().lower()
        return {"y": GO, "yes": GO, "s": SKIP, "skip": SKIP}.get(answer, END)

    for each in walk(fixture, steps.Limits(motor, ctrl), ask):
        yield told(each)
