"""``macromicro commission``: identify an unknown stage and write the settings that run it."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from macromicro.commands.options import PNG

if TYPE_CHECKING:
    from macromicro.commission.procedure import Options
    from macromicro.commission.running import Place

OUT = Path("results/commission")
SPEED, TRAVEL = "0.5 m/s", "500 mm"
TURNING = "720 deg/s", "400 deg"  # of an axis that turns
ENDLESS = "-0.5 turn", "0.5 turn"  # the window of one that turns on
_OWN = "only with --rig; the simulated machine has its own"
CREEP = 25.0  # the greatest speed is so many times that of the creep


def commission(  # noqa: PLR0913, PLR0917 - a parameter for each option
    config: Path | None = None,
    rig: str = "twin",
    port: str | None = None,
    pitch: str = "",
    kind: str = "",
    kiln: str = "",
    effort: str = "",
    lowest: str = "",
    speed: str = "",
    creep: str = "",
    travel: str = "",
    low: str = "",
    high: str = "",
    ends: str = "",
    calibrate: bool = False,
    yes: bool = False,
    resume: bool = False,
    seed: int = 0,
    out: Path | None = None,
    overwrite: bool = False,
    figures: str = PNG,
) -> None:
    """Identify an unknown stage, tune its law and verify both.

    Before each step the command prints what will move, how far and with how many volts; on your own
    rig it also asks. Completed steps are kept: after Ctrl-C, --resume continues. The result is a
    page with all figures and warnings, and a machine.toml for run, tune and robust.
    """
    from macromicro.commands import _commissioning
    from macromicro.drawing.files import formats
    from macromicro.errors import ProblemError
    from macromicro.rig.board.named import board_name
    from macromicro.runs import folder
    from macromicro.schema import keys

    rig = board_name(rig, port, None, None)
    kinds = formats(figures)
    if overwrite and resume:
        raise ProblemError("--resume", "not allowed with --overwrite", "Choose one of them.")
    keys.seed(seed, "--seed")
    own, given = (pitch, kind, lowest), (effort, speed, creep, travel, low, high)
    task: Callable[..., _commissioning.Task]
    if kind == _commissioning.KIND:
        _refuse_single(figures, (pitch, lowest, *given, ends))
        if calibrate:
            raise ProblemError("--calibrate", f"not allowed with --kind {kind}")
        task = partial(_commissioning.two_stages, config, rig, kiln)
    elif kiln:
        raise ProblemError("--kiln", f"only with --kind {_commissioning.KIND}")
    elif pair := _pair(config, rig, own):
        if ends:
            raise ProblemError("--ends", "both axes of this machine are straight")
        options = partial(_options, given=given)
        task = partial(
            _commissioning.two_axes, pair, rig, options, kinds=kinds, calibrate=calibrate
        )
    else:
        place = _endless(_place(config, rig, own, seed, calibrate=calibrate), ends)
        allowed = _options(place, given)
        task = partial(_commissioning.one_stage, place, allowed, kinds=kinds, calibrate=calibrate)
    out = folder.choose_folder(out, OUT, overwrite=overwrite, resume=resume)
    _commissioning.run(
        task(out=out, seed=seed), out, rig, overwrite=overwrite, resume=resume, yes=yes
    )


def _refuse_single(figures: str, given: tuple[str, ...]) -> None:
    """Refuse options of a single stage with both stages of the two-stage machine."""
    from macromicro.commands._commissioning import KIND
    from macromicro.errors import InputError, ProblemError

    if figures != PNG:
        raise InputError("--figures", figures, f"{PNG} with --kind {KIND}")
    names = ("pitch", "lowest", "effort", "speed", "creep", "travel", "from", "to", "ends")
    for name, value in zip(names, given, strict=True):
        if value:
            raise ProblemError(f"--{name}", f"not allowed with --kind {KIND}")


def _of_two_axes(config: Path) -> bool:
    from macromicro.machines.compositions import of_file
    from macromicro.machines.machine import JOINT

    return of_file(config).name == JOINT


def _pair(config: Path | None, rig: str, own: tuple[str, str, str]) -> Path | None:
    """The file of a machine of two axes, simulated or on two rigs; None for a single stage."""
    from macromicro.errors import InputError, ProblemError
    from macromicro.machines.on_rig import several
    from macromicro.rig.opening import TWIN

    if rig == TWIN:
        simulated = config is not None and not any(own) and _of_two_axes(config)
        return config if simulated else None
    if not several(rig):
        return None
    if config is None or not _of_two_axes(config):
        accepted = "a file of the machine xy, with pitch, period and drive of each axis"
        raise InputError("--config", str(config or "missing"), accepted)
    for name, value in zip(("--pitch", "--kind", "--lowest"), own, strict=True):
        if value:
            raise ProblemError(
                name, "not allowed with two axes", "Set it for each axis in the file."
            )
    return config


def _place(
    config: Path | None, rig: str, own: tuple[str, str, str], seed: int, *, calibrate: bool
) -> Place:
    from macromicro.commission import kinds, places
    from macromicro.errors import ProblemError
    from macromicro.rig.opening import TWIN
    from macromicro.units import quantity

    pitch, kind, lowest = own
    if rig == TWIN:
        mine = config is not None and kind not in kinds.NAMES
        for name, value in (("--pitch", pitch), ("--kind", kind), ("--lowest", lowest)):
            if value and not (name == "--kind" and mine):
                raise ProblemError(name, _OWN)
        return places.virtual(config, kind, calibrate=calibrate)
    if config is not None:
        accepted = "with --rig only for a machine of two axes"
        raise ProblemError("--config", accepted)
    if not pitch:
        raise ProblemError(
            "--pitch", "missing", "Give the travel per encoder count of this rig, such as '5 um'."
        )
    below = quantity(lowest, "V", "--lowest") if lowest else None
    kind = kind or "axis"
    unit = kinds.choose(kind, "--kind").place
    way = quantity(pitch, unit.base, "--pitch", unit.fine)
    return places.own_place(rig, way, seed, kind, below, calibrate=calibrate)


def _options(place: Place, given: tuple[str, str, str, str, str, str]) -> Options:
    from macromicro.commission.procedure import Options
    from macromicro.errors import ProblemError
    from macromicro.units import quantity

    effort, speed, creep, travel, low, high = given
    p = place.kind.place
    usual = TURNING if p.turns else (SPEED, TRAVEL)
    fastest = quantity(speed or usual[0], p.named("m/s"), "--speed")
    if place.endless and not low and not high:
        low, high = ENDLESS
    if not effort and math.isnan(place.effort):
        raise ProblemError(
            "--effort", "missing", "Give the largest voltage for this rig, such as '5 V'."
        )
    return Options(
        quantity(effort, "V", "--effort") if effort else place.effort,
        fastest,
        quantity(creep, p.named("m/s"), "--creep") if creep else fastest / CREEP,
        quantity(travel or usual[1], p.base, "--travel", p.unit),
        quantity(low, p.base, "--from", p.unit) if low else None,
        quantity(high, p.base, "--to", p.unit) if high else None,
        place.lowest,
        place.endless,
    ).checked(p)


def _endless(place: Place, ends: str) -> Place:
    """The place with the user's statement whether it has end stops."""
    from macromicro.errors import InputError, ProblemError
    from macromicro.machines.parts import NONE
    from macromicro.machines.rotary_parts import STOPS

    if not ends:
        return place
    if ends not in (NONE, STOPS):
        raise InputError("--ends", ends, f"{STOPS} or {NONE}")
    if not place.real:
        raise ProblemError("--ends", _OWN)
    if not place.kind.place.turns:
        raise ProblemError("--ends", "only with a rotary kind, such as --kind rotary")
    return place._replace(endless=ends == NONE)
