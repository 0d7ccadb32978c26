"""``macromicro calibrate``: measure a stage's errors once and correct them."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from macromicro.commands.options import PNG
from macromicro.commands.signals import Signals

if TYPE_CHECKING:
    from collections.abc import Callable

    from macromicro.calibration.measuring import Readings
    from macromicro.calibration.procedure import Request

OUT = Path("results/calibrate")
WRONG = 1  # exit code of a calibration that no longer holds


def calibrate(  # noqa: PLR0913, PLR0917 - a parameter for each option
    config: Path | None = None,
    reference: str = "",
    positions: int = 40,
    runs: int = 5,
    period: list[str] | None = None,
    cogging: bool = False,
    reversals: bool = False,
    readings: Path | None = None,
    list_to: Path | None = None,
    by_hand: bool = False,
    check: bool = False,
    rig: str = "twin",
    yes: bool = False,
    seed: int = 0,
    out: Path | None = None,
    overwrite: bool = False,
    figures: str = PNG,
    as_json: bool = False,
) -> None:
    """Measure a stage's errors, correct them and verify that.

    The corrections are written as calibration.toml, which the machine's file includes
    (docs/calibrate.md).
    """
    from macromicro.calibration import by_hand as hand
    from macromicro.calibration import files, procedure
    from macromicro.calibration.request import NONE, ready
    from macromicro.commands.asking import confirm
    from macromicro.drawing.files import formats
    from macromicro.runs import folder

    kinds = formats(figures)
    what = (config, reference, positions, runs, tuple(period or ()), seed)
    request = ready(*what, cogging=cogging, reversals=reversals, rig=rig)
    moves = list_to is None and not by_hand and readings is None
    if request.rigs is not None and moves:
        confirm([procedure.intent(request)], f"--rig {rig}", yes=yes)
    if list_to is not None:
        hand.write_list(list_to, request, overwrite=overwrite)
        print(f"positions to go to: {list_to}")
        return
    if check:
        _check(request, as_json)
        return
    place = folder.choose_folder(out, OUT, overwrite=overwrite)
    folder.check(place, files.BYTES, overwrite=overwrite, names=files.FILES)
    if reference == NONE:
        with Signals(), folder.locked(place, overwrite=overwrite, names=files.FILES):
            _by_hand(request, place, as_json)
        return
    given = hand.ask_readings(request, sys.stdin, sys.stderr) if by_hand else None
    if readings is not None:
        given = hand.read_readings(readings, request)
    with Signals(), folder.locked(place, overwrite=overwrite, names=files.FILES):
        _calibrate(request, given, place, kinds, as_json)


def _calibrate(
    request: Request, given: Readings | None, place: Path, kinds: tuple[str, ...], as_json: bool
) -> None:
    from macromicro.calibration import files, procedure
    from macromicro.drawing.bar import progress

    begun: list[str] = []
    with progress("calibrating", "positions") as pace:

        def tell(title: str) -> Callable[[int, int], None]:
            def reached(done: int, count: int) -> None:
                if title not in begun:
                    begun.append(title)
                    pace.begin(count)
                pace.reach(done, count, title)

            return reached

        if given is None:
            found = procedure.calibrate(request, tell)
        else:
            found = procedure.from_readings(request, given)
    files.write(place, found, kinds)
    if as_json:
        print(files.as_json(found), end="")
        return
    print(files.text(found))
    print(f"page: {place / files.PAGE}")
    print(f'try: include = "{place / files.CORRECTIONS}" in the machine\'s file')


def _by_hand(request: Request, place: Path, as_json: bool) -> None:
    from macromicro.calibration import files, own_sensor

    found = own_sensor.measure(request)
    files.write_own(place, found)
    if as_json:
        print(files.own_json(found))
        return
    print(files.own_text(found))
    print(f'try: include = "{place / files.CORRECTIONS}" in the machine\'s file')


def _check(request: Request, as_json: bool) -> None:
    import json

    from macromicro.calibration import checking

    found = checking.check(request)
    if as_json:
        print(json.dumps(checking.content(found), indent=2))
    else:
        print(checking.text(found))
    if not all(each.holds for each in found.axes):
        raise typer.Exit(WRONG)
