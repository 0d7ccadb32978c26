"""The setup of a machine that a settings file, or none, is for: with a programme, ready to run."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from macromicro import programme as examples
from macromicro.design.served import timetable
from macromicro.errors import InputError, ProblemError
from macromicro.machines import compositions, programmes
from macromicro.machines.runs import StageSetup
from macromicro.programme import Programme
from macromicro.rig.replay import SCHEME, open_recording
from macromicro.runs import programmed
from macromicro.runs.programmed import TwoStageSetup
from macromicro.runs.setup import Setup
from macromicro.schema import config
from macromicro.settings import Settings, choose

if TYPE_CHECKING:
    from macromicro.runs.job import Request


def of(
    path: Path | None,
    programme: Any = None,
    *,
    law: str | None = None,
    settings: Any = None,
    cycles: int = 1,
    fan: bool = False,
) -> Setup:
    """The machine of a settings file with a programme, its file or an example's name.

    `settings` replace the file's.
    """
    if compositions.is_two_stage(path):
        if settings is None:
            return two_stage(choose(Settings(), path, law), programme, cycles=cycles, fan=fan)
        config.check(settings, "settings")
        return two_stage(choose(settings, None, law), programme, cycles=cycles, fan=fan)
    if fan:
        raise ProblemError("--fan", "this machine has no fan")
    assert path is not None  # which names the machine
    machine, own = compositions.with_settings(path, law, settings)
    return stages(machine, own, programme, cycles=cycles)


def two_stage(
    settings: Settings, programme: Any = None, *, cycles: int = 1, fan: bool = False
) -> TwoStageSetup:
    if not isinstance(programme, Programme):
        file = examples.find(os.fspath(programme or TwoStageSetup.usual))
        programme = programmed.load(file, settings)
    try:
        repeated = programme.repeated(cycles)
    except InputError as error:
        raise error.at("--cycles") from None
    return TwoStageSetup(settings, repeated, fan=fan, cycles=cycles)


def stages(machine: Any, settings: Any, programme: Any = None, *, cycles: int = 1) -> StageSetup:
    if programme is None:
        programme = programmes.choose(machine, settings)
    elif isinstance(programme, str | os.PathLike):
        programme = programmes.choose(machine, settings, str(os.fspath(programme)))
    moving = programmes.repeat(machine, programme, cycles)
    plan = programmes.plan(machine, settings, moving)
    return StageSetup(machine, settings, plan, programme=moving, cycles=cycles)


def of_request(request: Request) -> tuple[Setup, Any, str]:
    """The setup of a request, what it runs on, and the name of its folder."""
    programme: Any = request.programme
    replayed = request.rig.startswith(SCHEME)
    own = replayed and programme is None  # the recording's own moves
    if own and compositions.is_two_stage(request.config):
        programme = timetable(open_recording(request.rig))
    how: Any = {"law": request.law, "cycles": request.cycles, "fan": request.fan}
    setup = of(request.config, programme, **how)
    named = request.programme or setup.usual or request.config or ""
    name = Path(request.rig.removeprefix(SCHEME) if own else named).stem
    source = setup.source(request.rig, request.seed)
    return setup, source, f"{name}-replay" if replayed else name
