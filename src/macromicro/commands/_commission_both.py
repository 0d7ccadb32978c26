"""``macromicro commission --kind two_stage``: both stages, one after the other."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import typer

from macromicro.commands.signals import Signals

if TYPE_CHECKING:
    from macromicro.thesis.procedure import Lab

KIND = "two_stage"
BYTES = 400_000_000


class Asked(NamedTuple):
    config: Path | None
    rig: str
    kiln: str
    seed: int
    out: Path
    overwrite: bool
    resume: bool
    yes: bool


def commission(asked: Asked) -> None:
    """Identify both stages from their sensors and verify the laws designed from the models."""
    from datetime import datetime

    from macromicro.commands.asking import stepwise
    from macromicro.commands.commission import show_rows
    from macromicro.machines.results import arrived
    from macromicro.runs import folder
    from macromicro.schema import keys
    from macromicro.thesis import commissioning, commissioning_page

    keys.seed(asked.seed, "--seed")
    lab = _lab(asked)
    names, out = commissioning_page.FILES, asked.out
    folder.check(out, BYTES, overwrite=asked.overwrite or asked.resume, names=names)
    started = datetime.now().astimezone().isoformat(sep=" ", timespec="seconds")

    ask = stepwise(asked.rig, yes=asked.yes or not lab.rigs)
    with Signals() as signals, folder.held(out, overwrite=True, names=names):
        if asked.overwrite and not asked.resume:
            _cleared(out, names)
        try:
            found = commissioning.commission(
                lab, out, ask, lambda title: print(f"{title}: done", file=sys.stderr)
            )
        except KeyboardInterrupt:
            print(f"macromicro: interrupted; to continue: --resume --out {out}", file=sys.stderr)
            raise typer.Exit(signals.status) from None
        signals.later()
        commissioning_page.write(found, " and ".join(r.name for r in lab.rigs) or "twin", started)
    show_rows(commissioning_page.rows(found))
    for doubt in found.doubts:
        print(f"doubtful: {doubt}")
    there, asked_for = arrived(found.ended.moves), len(found.ended.job.programme.target)
    print(f"verification: {there} of {asked_for} moves arrived")
    print(f"page: {out / names[0]}\nmachine: {out / commissioning.MACHINE}")
    if not found.met:
        print(f"macromicro: not verified: {found.why}", file=sys.stderr)
        raise typer.Exit(1)


def _lab(asked: Asked) -> Lab:
    from macromicro.errors import ProblemError
    from macromicro.rig.opening import TWIN, open_rig
    from macromicro.schema.config import load_overrides
    from macromicro.settings import Settings
    from macromicro.thesis.procedure import Lab

    if asked.rig == TWIN:
        if asked.kiln:
            raise ProblemError(
                "--kiln", "only with --rig", "The simulated machine has its own kiln."
            )
        base = Settings() if asked.config is None else load_overrides(asked.config, Settings())
        return Lab(base, asked.seed)
    if asked.config is not None:
        raise ProblemError("--config", "not allowed with --rig")
    rigs = tuple(open_rig(name, asked.seed) for name in (asked.rig, asked.kiln) if name)
    return Lab(Settings(), asked.seed, rigs)


def _cleared(out: Path, names: tuple[str, ...]) -> None:
    """Remove what an earlier commissioning left, and nothing else."""
    from macromicro.thesis import commissioning as c

    for name in (*names, c.MACHINE, c.ASKED, c.DIRECTIONS):
        (out / name).unlink(missing_ok=True)
    for name in (c.STEPS, c.VERIFICATION):
        shutil.rmtree(out / name, ignore_errors=True)
