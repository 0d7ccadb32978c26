"""``tune`` for the machines of one stage and of several."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import NamedTuple

import typer

from macromicro.commands.signals import Signals
from macromicro.errors import ProblemError
from macromicro.schema.text import printable

ENDING = "stopping after this generation with the best so far (again: stop at once without results)"


class Asked(NamedTuple):
    config: Path
    law: str | None
    out: Path
    overwrite: bool
    figures: str
    as_json: bool
    seed: int


def only(given: dict[str, object], name: str) -> None:
    """Refuse an option that has no meaning for the machine."""
    for option, value in given.items():
        if value:
            raise ProblemError(option, f"the machine {name} has no such choice")


def name_of(config: Path) -> str:
    from macromicro.machines.compositions import chosen

    return chosen(config).name


def of_several(config: Path) -> bool:
    """Whether a settings file is for a machine of several stages on one clock."""
    from macromicro.machines.composition import STEP
    from macromicro.machines.compositions import chosen

    return chosen(config).family == STEP


def tune(
    asked: Asked,
    stage: str,
    objective: str,
    evaluations: int,
    machines: tuple[int | None, int | None],
) -> None:
    """Search for better gains; `machines`: numbers of varied and of fresh ones, or None."""
    from macromicro import studies
    from macromicro.batch import cores
    from macromicro.drawing.bar import progress
    from macromicro.drawing.files import formats
    from macromicro.machines import compositions
    from macromicro.report.summary import as_json as to_json
    from macromicro.runs import folder
    from macromicro.schema import keys
    from macromicro.tuning import stage as tuning
    from macromicro.tuning.evolution import Stop

    kinds = formats(asked.figures)
    machine, settings = compositions.load(asked.config, asked.law)
    how = studies.tuner(machine, settings, printable(asked.config, 300))
    how.check(stage, evaluations)
    aim = tuning.named(objective)
    keys.seed(asked.seed, "--seed")
    names, files = how.names, how.files
    for option, count in zip(("--benches", "--held-out"), machines, strict=True):
        if count is not None:
            keys.whole(count, 1, studies.MOST, option)
    folder.check(asked.out, 2_000_000, overwrite=asked.overwrite, names=files.FILES)
    with (
        Signals() as signals,
        folder.held(asked.out, overwrite=asked.overwrite, names=files.FILES),
        progress(f"{names[0]}, objective {aim.name}", "designs at most") as pace,
    ):
        pace.begin(evaluations)

        def tell(done: int, best: float) -> None:
            pace.reach(done, evaluations, f"least cost {best:.4g}")
            if signals.received:
                raise Stop

        others, fresh = (count or 0 for count in machines)
        budget = tuning.Budget(evaluations, asked.seed, others, fresh, cores())
        signals.later(ENDING)
        try:
            found = how.search(aim, budget, tell)
        except KeyboardInterrupt:  # a second signal
            print("macromicro: interrupted, nothing was written", file=sys.stderr)
            raise typer.Exit(signals.status) from None
        files.write(asked.out, found, kinds)
    if asked.as_json:
        print(to_json(files.content(found)), end="")
    else:
        print("\n".join(files.lines(found)))
        print(results(asked.out, files.SETTINGS, better=found.better))
    ended(signals, found.evaluations)


def ended(signals: Signals, designs: int) -> None:
    """Note that a signal ended a search early, and exit with its status."""
    if signals.received:
        print(
            f"macromicro: interrupted after {designs} designs; the best is kept",
            file=sys.stderr,
        )
        raise typer.Exit(signals.status)


def results(out: Path, settings: str, *, better: bool) -> str:
    return f"results: {out}" + (f"; try: macromicro run --config {out / settings}" * better)
