"""``macromicro commission`` for two axes on one clock: each axis, then both together."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import typer

from macromicro.commands.signals import Signals

if TYPE_CHECKING:
    from macromicro.commission.procedure import Options
    from macromicro.commission.running import Commissioned, Place


class Asked(NamedTuple):
    config: Path
    rig: str
    seed: int
    out: Path
    overwrite: bool
    resume: bool
    yes: bool
    figures: Sequence[str]


def commission(asked: Asked, options: Callable[[Place], Options]) -> None:
    """Identify both axes from their encoders and verify them with coordinated moves."""
    from contextlib import ExitStack
    from datetime import datetime

    from macromicro.commands.asking import stepwise
    from macromicro.commands.commission import show_rows
    from macromicro.commission import plane, report
    from macromicro.machines.joint.settings import AXES
    from macromicro.machines.results import arrived
    from macromicro.report import plane as pages
    from macromicro.rig.opening import TWIN
    from macromicro.runs import folder

    if asked.rig == TWIN:
        pair, places = plane.virtual(asked.config, asked.seed)
    else:
        pair, places = plane.own(asked.config, asked.rig, asked.seed)
    allowed = (options(places[0]), options(places[1]))
    out, replace = asked.out, asked.overwrite or asked.resume
    rooms = [(out, pages.FILES)]
    rooms += [(out / n, report.names(p.kind)) for n, p in zip(AXES, places, strict=True)]
    for room, names in rooms:
        folder.check(room, report.BYTES, overwrite=replace, names=names)
    with Signals() as signals, ExitStack() as stack:
        for room, names in rooms:
            stack.enter_context(folder.held(room, overwrite=replace, names=names))
            for name in names if asked.overwrite and not asked.resume else ():
                (room / name).unlink(missing_ok=True)
        started = datetime.now().astimezone().isoformat(sep=" ", timespec="seconds")
        signals.later("stopping after this period; --resume repeats this step")

        def found(name: str, one: Commissioned) -> None:
            report.write(out / name, one, places[AXES.index(name)], started, asked.figures)

        try:
            both = plane.commission(
                pair,
                places,
                allowed,
                out,
                ask=stepwise(asked.rig, yes=asked.yes or not places[0].real),
                done=lambda title: print(f"{title}: done", file=sys.stderr),
                ended=lambda: bool(signals.received),
                found=found,
            )
        except KeyboardInterrupt:
            print(f"macromicro: interrupted; to continue: --resume --out {out}", file=sys.stderr)
            raise typer.Exit(signals.status) from None
        pages.write(out, both, places, started, asked.figures)
    show_rows(pages.rows(both, places))
    for doubt in pages.doubts(both, places):
        print(f"doubtful: {doubt}")
    for name, one in zip(AXES, both.axes, strict=True):
        there = arrived(one.verified.moves)
        print(f"verification of {name}: {there} of {one.verified.asked} moves arrived")
    print(f"verification of both: {arrived(both.moves)} of {len(both.plan.legs)} moves arrived")
    print(f"page: {out / report.PAGE}\nmachine: {out / report.MACHINE}")
    if not both.met:
        print(f"macromicro: not verified: {pages.why(both)}", file=sys.stderr)
        raise typer.Exit(1)
