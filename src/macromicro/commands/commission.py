"""``macromicro commission``: a stage that nobody knows, step by step to settings that run it."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from macromicro.commands.group import PNG, Figures, whole
from macromicro.commands.signals import Signals

if TYPE_CHECKING:
    from macromicro.commission.procedure import Options
    from macromicro.commission.running import Commissioned, Place

SPEED, TRAVEL = "0.5 m/s", "500 mm"
TURNING = "720 deg/s", "400 deg"  # of an axis that turns
ENDLESS = "-0.5 turn", "0.5 turn"  # the window of one that turns on
_OWN = "only with --rig: a virtual machine has its own"
CREEP = 25.0  # the greatest speed is so many times that of the creep


def commission(  # noqa: PLR0913, PLR0917 - a parameter for each option
    config: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Settings of the virtual machine to be commissioned, or of two axes on two rigs.",
            show_default="the two-stage bench",
        ),
    ] = None,
    rig: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="The twin, MODULE:FACTORY of your own rig, or FILE.toml of a card; two axes: one "
            "for each, + between.",
        ),
    ] = "twin",
    pitch: Annotated[
        str, typer.Option(help="Travel per encoder count of your own rig, such as '5 um'.")
    ] = "",
    kind: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="What your own rig is: axis, rotary, piezo or wire; two_stage: both stages, also "
            "of the twin; MODULE:KIND of your own, also with --config.",
            show_default="axis",
        ),
    ] = "",
    kiln: Annotated[
        str,
        typer.Option(
            metavar="NAME", help="With --kind two_stage: the rig of the kiln.", show_default="none"
        ),
    ] = "",
    effort: Annotated[
        str, typer.Option(help="Largest effort, such as '8 V'.", show_default="all there is")
    ] = "",
    lowest: Annotated[
        str,
        typer.Option(
            help="Lowest effort of your own rig that is no axis, such as '-2 V'.",
            show_default="0 V",
        ),
    ] = "",
    speed: Annotated[
        str, typer.Option(help="Greatest speed.", show_default=f"{SPEED}, or {TURNING[0]}")
    ] = "",
    creep: Annotated[
        str, typer.Option(help="Speed at which ends are felt for.", show_default="speed / 25")
    ] = "",
    travel: Annotated[
        str,
        typer.Option(
            help="Longest way on which an end is looked for.",
            show_default=f"{TRAVEL}, or {TURNING[1]}",
        ),
    ] = "",
    low: Annotated[
        str,
        typer.Option("--from", help="Low end of a window, from where the axis stands: '-20 mm'."),
    ] = "",
    high: Annotated[str, typer.Option("--to", help="High end of it; no end is felt for.")] = "",
    ends: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="none: your own rig turns on, in half a turn either way or --from and --to.",
            show_default="stops",
        ),
    ] = "",
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask before each step.")] = False,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on after the last step that was completed.")
    ] = False,
    seed: Annotated[
        int, typer.Option(parser=whole, metavar="N", help="Seed of a virtual machine's noise.")
    ] = 0,
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("results/commission"),
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Begin anew, and replace what is there.")
    ] = False,
    figures: Figures = PNG,
) -> None:
    """Find what a stage does, its model and its gains, and verify them on it.

    Every step says before it moves what it will do, how far and how hard; on your own rig it asks
    as well. Each is kept when it is done: after Ctrl-C, --resume goes on. At the end there are a
    page with all figures and doubts, and a machine.toml for run, tune and robust.
    """
    from datetime import datetime

    from macromicro.commands import commission_both, commission_plane
    from macromicro.commands.asking import stepwise
    from macromicro.commission import report
    from macromicro.commission.running import commission as perform
    from macromicro.drawing.files import formats
    from macromicro.errors import InputError
    from macromicro.runs import folder
    from macromicro.schema import keys

    kinds = formats(figures)
    if kind == commission_both.KIND:
        _only(pitch, effort, lowest, speed, creep, travel, low, high, ends)
        asked = commission_both.Asked(config, rig, kiln, seed, out, overwrite, resume, yes)
        commission_both.commission(asked)
        return
    if kiln:
        raise InputError("--kiln", kiln, f"only with --kind {commission_both.KIND}")
    keys.seed(seed, "--seed")
    given = (effort, speed, creep, travel, low, high)
    if _in_step(config, rig, (pitch, kind, lowest)):
        assert config is not None
        if ends:
            raise InputError("--ends", ends, "nothing: both axes of this machine are straight")
        both = commission_plane.Asked(config, rig, seed, out, overwrite, resume, yes, kinds)
        commission_plane.commission(both, lambda each: _options(each, given))
        return
    place = _place(config, rig, (pitch, kind, lowest), seed)
    place = _endless(place, ends)
    options = _options(place, given)
    names, replace = report.names(place.kind), overwrite or resume
    folder.check(out, report.BYTES, overwrite=replace, names=names)
    with Signals() as signals, folder.held(out, overwrite=replace, names=names):
        if overwrite and not resume:
            for name in names:
                (out / name).unlink(missing_ok=True)
        started = datetime.now().astimezone().isoformat(sep=" ", timespec="seconds")
        signals.later("ending after this period; --resume goes on with this step")

        def ended() -> bool:
            return bool(signals.received)

        def done(title: str) -> None:
            print(f"{title}: done", file=sys.stderr)

        try:
            found = perform(
                place,
                options,
                out,
                seed=seed,
                ask=stepwise(rig, yes=yes or not place.real),
                done=done,
                ended=ended,
            )
        except KeyboardInterrupt:
            print(f"macromicro: interrupted; --resume goes on, in {out}", file=sys.stderr)
            raise typer.Exit(signals.status) from None
        report.write(out, found, place, started, kinds)
    _show(found, place, out)
    if not found.verified.met:
        print(f"macromicro: not verified: {report.why(found)}", file=sys.stderr)
        raise typer.Exit(1)


def _only(*given: str) -> None:
    """Refuse options that both stages have no use for."""
    from macromicro.errors import InputError

    names = ("pitch", "effort", "lowest", "speed", "creep", "travel", "from", "to", "ends")
    for name, value in zip(names, given, strict=True):
        if value:
            raise InputError(f"--{name}", value, "not with --kind two_stage")


def _in_step(config: Path | None, rig: str, own: tuple[str, str, str]) -> bool:
    """Whether a machine of two axes is commissioned, simulated or on two rigs."""
    from macromicro.commands.machine_run import in_step
    from macromicro.errors import InputError
    from macromicro.machines.joint.two_rigs import several
    from macromicro.rig.opening import TWIN

    if rig == TWIN:
        return config is not None and not any(own) and in_step(config)
    if not several(rig):
        return False
    if config is None or not in_step(config):
        accepted = "a file of the machine xy, which says pitch, period and drive of each axis"
        raise InputError("--config", str(config or "missing"), accepted)
    for name, value in zip(("--pitch", "--kind", "--lowest"), own, strict=True):
        if value:
            raise InputError(name, value, "nothing: the file of two axes says it of each")
    return True


def _place(config: Path | None, rig: str, own: tuple[str, str, str], seed: int) -> Place:
    from macromicro.commission import kinds, places
    from macromicro.errors import InputError
    from macromicro.rig.opening import TWIN
    from macromicro.units import quantity

    pitch, kind, lowest = own
    if rig == TWIN:
        mine = config is not None and kind not in kinds.NAMES
        for name, value in (("--pitch", pitch), ("--kind", kind), ("--lowest", lowest)):
            if value and not (name == "--kind" and mine):
                raise InputError(name, value, _OWN)
        return places.virtual(config, kind)
    if config is not None:
        accepted = "not with --rig, whose settings are to be found; but with those of two axes"
        raise InputError("--config", str(config), accepted)
    if not pitch:
        raise InputError("--pitch", "missing", "travel per encoder count of this rig, as '5 um'")
    below = quantity(lowest, "V", "--lowest") if lowest else None
    kind = kind or "axis"
    unit = kinds.chosen(kind, "--kind").place
    way = quantity(pitch, unit.base, "--pitch", unit.fine)
    return places.own(rig, way, seed, kind, below)


def _options(place: Place, given: tuple[str, str, str, str, str, str]) -> Options:
    from macromicro.commission.procedure import Options
    from macromicro.errors import InputError
    from macromicro.units import quantity

    effort, speed, creep, travel, low, high = given
    p = place.kind.place
    usual = TURNING if p.turns else (SPEED, TRAVEL)
    fastest = quantity(speed or usual[0], p.named("m/s"), "--speed")
    if place.endless and not low and not high:
        low, high = ENDLESS
    if not effort and math.isnan(place.effort):
        raise InputError("--effort", "missing", "the largest effort for this rig, as '5 V'")
    return Options(
        quantity(effort, "V", "--effort") if effort else place.effort,
        fastest,
        quantity(creep, p.named("m/s"), "--creep") if creep else fastest / CREEP,
        quantity(travel or usual[1], p.base, "--travel", p.unit),
        quantity(low, p.base, "--from", p.unit) if low else None,
        quantity(high, p.base, "--to", p.unit) if high else None,
        place.lowest,
        place.endless,
    ).checked()


def _endless(place: Place, ends: str) -> Place:
    """The place, of which a person has said whether anything ends its way."""
    from macromicro.errors import InputError
    from macromicro.machines.parts import NONE
    from macromicro.machines.rotary_parts import STOPS

    if not ends:
        return place
    if ends not in (NONE, STOPS):
        raise InputError("--ends", ends, f"{STOPS} or {NONE}")
    if not place.real:
        raise InputError("--ends", ends, _OWN)
    if not place.kind.place.turns:
        raise InputError("--ends", ends, "only with a kind that turns, such as --kind rotary")
    return place._replace(endless=ends == NONE)


def _show(found: Commissioned, place: Place, out: Path) -> None:
    from macromicro.commission import report
    from macromicro.machines.results import arrived

    for name, value, half, unit in report.rows(found, place):
        print(f"{name:28}{value:>12} {half:>10} {unit}")
    for doubt in report.doubts(found, place):
        print(f"doubtful: {doubt}")
    there = arrived(found.verified.moves)
    print(f"verification: {there} of {found.verified.asked} moves arrived")
    print(f"page: {out / report.PAGE}\nmachine: {out / report.MACHINE}")
