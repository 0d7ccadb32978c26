"""``macromicro tune``: gains by search, judged before and after."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from macromicro.commands.group import tell
from macromicro.commands.options import PNG
from macromicro.commands.signals import Signals
from macromicro.commands.streams import say

if TYPE_CHECKING:
    from macromicro.tuning.request import Ready

ENDING = "stopping after this generation with the best so far (again: stop at once without results)"


def tune(  # noqa: PLR0913, PLR0917 - one for each option
    stage: str | None = None,
    objective: str = "settling",
    law: str | None = None,
    evaluations: int = 300,
    seed: int = 0,
    robust: bool = False,
    benches: int | None = None,
    held_out: int | None = None,
    penalty: list[str] | None = None,
    config: Path | None = None,
    out: Path | None = None,
    overwrite: bool = False,
    figures: str = PNG,
    as_json: bool = False,
) -> None:
    """Find better gains for a control law and judge them.

    A machine of several stages is tuned stage by stage, then as a whole, for its path
    (docs/tuning.md).
    """
    from macromicro.drawing.files import formats
    from macromicro.runs import folder
    from macromicro.tuning import files
    from macromicro.tuning.request import Request, ready

    kinds = formats(figures)
    asked = Request(
        config, stage, objective, law, evaluations, seed, robust, benches, held_out,
        _penalties(penalty or []),
    )  # fmt: skip
    found = ready(asked)
    tell(found.subject.start)
    name = stage or (config.stem if config else "")
    place = folder.choose_folder(out, Path("results") / f"tune-{name}", overwrite=overwrite)
    folder.check(place, files.BYTES, overwrite=overwrite, names=files.FILES)
    with Signals() as signals, folder.locked(place, overwrite=overwrite, names=files.FILES):
        _tune(found, place, kinds, as_json, signals)


def _penalties(texts: list[str]) -> dict[str, float]:
    from macromicro.errors import InputError
    from macromicro.schema.text import printable

    found: dict[str, float] = {}
    for text in texts:
        name, _, number = text.partition("=")
        try:
            found[name] = float(number)
        except ValueError:
            accepted = "NAME=WEIGHT with a number, such as overshoot=0.01"
            raise InputError("--penalty", printable(text), accepted) from None
    return found


def _tune(
    asked: Ready, place: Path, kinds: tuple[str, ...], as_json: bool, signals: Signals
) -> None:
    from macromicro.drawing.bar import progress
    from macromicro.tuning import files
    from macromicro.tuning.evolution import Stop

    designs = asked.budget.evaluations
    asked.subject.prepare()
    signals.later(ENDING)
    try:
        with progress(f"tuning {asked.subject.name}, {asked.objective}", "designs") as pace:
            pace.begin(designs)

            def tell(done: int, best: float) -> None:
                pace.reach(done, designs, f"least cost {best:.4g}")
                if signals.received:
                    raise Stop

            found = asked.search(tell)
        report = files.summarise(found)
        files.write(place, report, kinds)
    except KeyboardInterrupt:  # a second signal
        say("interrupted, nothing was written")
        raise typer.Exit(signals.status) from None
    if as_json:
        print(files.as_json(report), end="")
    else:
        print(report.text)
        print(f"page: {place / files.PAGE}")
        if found.better:
            print(f"try: macromicro run --config {place / files.SETTINGS}")
    if signals.received:
        say(f"interrupted after {found.evaluations} designs; the best is kept")
        raise typer.Exit(signals.status)
