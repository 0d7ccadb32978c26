"""Settings of the machine `axis` from a commissioning; one newton is one volt at the D/A."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from macromicro.commission._axis_fit import Model
from macromicro.commission._mode import Mode
from macromicro.commission._probing import Ends, FrictionMap
from macromicro.commission.stand import Record, Stand
from macromicro.identify import axis_settings
from macromicro.identify.axis_settings import Around
from macromicro.machines import deriving
from macromicro.machines import machine as machines
from macromicro.schema import config

NOTCH, TOLERANCE = "controller.notch.frequency", "arrival.tolerance"
HELPS = 1.1  # times the bandwidth, from where a notch is worth its lag


def settings(
    model: Model,
    ends: Ends,
    *,
    friction: FrictionMap,
    strokes: Sequence[Record],
    effort: float,
    stand: Stand,
) -> dict[str, str]:
    """Settings by path, as text with units; 0 mm is the low end of the travel."""
    dt = stand.dt
    fastest = max(float(np.abs(np.gradient(one.x, dt)).max()) for one in strokes)
    around = Around(
        gain=1.0,
        effort=effort,
        pitch=stand.pitch,
        period=dt,
        travel=ends.travel,
        speed=fastest,
        ripple=friction.ripple,
    )
    started = max(friction.breakaway(model.axis.viscous) - model.axis.coulomb, 0.0)
    stiff = axis_settings.values(model.whole._replace(stribeck=started), around)
    if model.limber is not None:
        return with_mode(stiff, model.limber, dt)
    # What friction lets go is a rule of the machine: named is only what is coarser.
    named = stiff.pop(TOLERANCE)
    if as_file(stiff)[1].arrival.tolerance < float(named.strip('"').split()[0]):
        stiff[TOLERANCE] = named
    return stiff


def too_quick(mode: Mode, dt: float) -> bool:
    """Whether the mode is too fast for the period to be named (`feasible`)."""
    return 10.0 * dt * mode.shape.held > 1.0


def with_mode(stiff: dict[str, str], mode: Mode, dt: float) -> dict[str, str]:
    """The machine with the mode, and a notch where that allows faster gains."""
    shape = mode.shape
    if too_quick(mode, dt):
        return {**stiff, NOTCH: f'"{shape.resonance!r} Hz"'}
    drive = axis_settings.Drive(shape.rotor, shape.held, shape.damping, shape.at)
    without = axis_settings.limber(stiff, drive)
    notched = axis_settings.limber(stiff, drive._replace(notch=shape.resonance))
    return notched if _bandwidth(notched) > HELPS * _bandwidth(without) else without


def _bandwidth(values: dict[str, str]) -> float:
    return deriving.bandwidth(as_file(values)[1])


def as_file(values: dict[str, str], head: str = "", name: str = "axis") -> tuple[str, Any]:
    """The file of a machine with these settings, and all that follow from them."""
    toml = axis_settings.as_toml(values, head, name)
    table = tomllib.loads(toml)
    table.pop(config.MACHINE)
    machine = machines.named(name, "machine")
    return toml, config.overridden(machine.settings, table, "the identified machine")


def texts(figures: Mapping[str, tuple[float, str]], plain: Mapping[str, float]) -> dict[str, str]:
    """Figures with units and plain numbers as a settings file has them."""
    return {
        **{path: f'"{float(value)!r} {unit}"' for path, (value, unit) in figures.items()},
        **{path: repr(float(value)) for path, value in plain.items()},
    }
