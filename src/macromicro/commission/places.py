"""Subjects of commissioning: a virtual machine, or a user's rig."""

from __future__ import annotations

import math
from pathlib import Path

from macromicro.calibration.request import CHANNEL
from macromicro.commission import kinds
from macromicro.commission.calibrating import ReferencedTwin
from macromicro.commission.procedure import Kind
from macromicro.commission.running import Place
from macromicro.errors import InputError, ProblemError
from macromicro.machines import board_limits, compositions
from macromicro.machines import machine as machines
from macromicro.machines import rig as rigs
from macromicro.machines.parts import NONE
from macromicro.nominal import PERIOD
from macromicro.plant import bench
from macromicro.rig.opening import open_rig
from macromicro.rig.twin import CompiledTwin
from macromicro.schema import config
from macromicro.schema.text import printable
from macromicro.settings import Settings


def virtual(path: Path | None, kind: str = "", *, calibrate: bool = False) -> Place:
    """A virtual machine of which only pitch, period and D/A range are known."""
    if path is None or compositions.is_two_stage(path):
        if calibrate:
            problem = "the carriage of the two-stage machine is not calibrated"
            raise ProblemError("--calibrate", problem, "Leave it out, or give another --config.")
        settings = Settings() if path is None else config.load_overrides(path, Settings())
        plant = bench.prepare(settings.bench, settings.sensors)
        return Place(
            "the carriage of the virtual bench",
            lambda seed: CompiledTwin(plant, seed),
            PERIOD,
            settings.sensors.encoder.pitch,
            settings.controller.motor_limit,
            False,
        )
    machine = machines.chosen(path)
    how = _of(path, machine.name, kind)
    stage, tree = machine.kind, machines.load(path)[1]
    twin = ReferencedTwin if calibrate else rigs.CompiledTwin
    gains = tree.controller
    return Place(
        f"the machine of {path.name}",
        lambda seed: twin(stage, tree, seed),
        tree.timing.period,
        tree.encoder.pitch,
        gains.high if how.one_way else gains.limit,
        False,
        how,
        gains.low if how.one_way else None,
        getattr(getattr(tree, "load", None), "ends", "") == NONE,
    )


def _of(path: Path, machine: str, kind: str) -> Kind:
    if kind:
        found = kinds.choose(kind, "--kind")
        if found.name != machine:
            told = f"{kind} is for the machine {printable(found.name)}"
            raise ProblemError("--kind", told, f"Give one for {machine}, the machine of --config.")
        return found
    listed = kinds.by_name(machine)
    if listed is None:
        where = f"--config {printable(path, 300)}, {machines.KEY}"
        accepted = f"one of {', '.join(kinds.NAMES)}; or with --kind {kinds.FORM}"
        raise InputError(where, machine, accepted)
    return listed


def own_place(
    name: str,
    pitch: float,
    seed: int,
    kind: str = "axis",
    lowest: float | None = None,
    *,
    calibrate: bool = False,
) -> Place:
    found = kinds.choose(kind, "--kind")
    if lowest is not None and not found.one_way:
        remedy = "Remove it, or choose another kind."
        raise ProblemError("--lowest", f"the efforts of --kind {kind} are symmetric", remedy)
    fixture = open_rig(name, seed, alone=True, limits=board_limits.UNKNOWN)
    fixture.need("commission", "encoder")
    if calibrate:
        fixture.need("--calibrate", CHANNEL)
    limit = math.nan if fixture.limits is None else fixture.limits.motor
    below = (lowest or 0.0) if found.one_way else None
    return Place(name, fixture.make, fixture.dt, pitch, limit, True, found, below)
