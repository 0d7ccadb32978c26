"""Checks what a calibration is asked for."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from macromicro.calibration import references
from macromicro.calibration.procedure import Request
from macromicro.calibration.targets import RUNS
from macromicro.errors import InputError, ProblemError
from macromicro.machines import composite, compositions, on_rig
from macromicro.machines.composite import Composite
from macromicro.place import LENGTH, Place
from macromicro.rig.opening import TWIN
from macromicro.schema import keys
from macromicro.schema.text import printable
from macromicro.units import quantity

MOST_POSITIONS, MOST_RUNS = 1000, 50
NONE = "none"  # in place of a reference: what the stage's own sensor shows
CHANNEL = "laser"  # of a rig: its reference, m


def ready(
    config: Path | None,
    reference: str = "",
    positions: int = 40,
    runs: int = RUNS,
    periods: Sequence[str] = (),
    seed: int = 0,
    *,
    cogging: bool = False,
    reversals: bool = False,
    rig: str = TWIN,
) -> Request:
    """A checked request, before anything moves."""
    if compositions.is_two_stage(config):
        raise ProblemError(
            "--config",
            "the two-stage machine has tables of its own",
            "Calibrate its Hall sensor with `macromicro identify hall`; give the file of another "
            "machine here.",
        )
    assert config is not None
    machine, settings = compositions.load(config)
    place = composite.places(machine)[0]
    if cogging and isinstance(machine, Composite):
        raise ProblemError("--cogging", "only for a machine of one stage", "Leave it out.")
    if reversals and not (isinstance(machine, Composite) and machine.has_plane):
        raise ProblemError("--reversals", "only for a machine with a plane", "Leave it out.")
    keys.whole(positions, 5, MOST_POSITIONS, "--positions")
    keys.whole(runs, 2, MOST_RUNS, "--runs")
    lengths = tuple(quantity(text, place.base, "--period", place.unit) for text in periods)
    if any(not length > 0.0 for length in lengths):
        raise InputError("--period", printable(" ".join(periods)), "lengths above 0")
    keys.seed(seed, "--seed")
    source = on_rig.find_rigs(rig, machine, settings, seed, "a calibration")
    if source is not None:
        for fixture in source:
            fixture.need("a calibration", CHANNEL)
    instrument = references.INSTRUMENTS[_instrument("" if reference == NONE else reference, place)]
    what = (machine, settings, instrument, positions, runs, seed, lengths, cogging, reversals)
    return Request(*what, rigs=source)


def _instrument(name: str, place: Place) -> str:
    """The instrument of a name, or the usual one for such a stage."""
    fitting = references.LENGTHS if place == LENGTH else references.ANGLES
    if not name:
        return fitting[0]
    if name not in fitting:
        accepted = keys.nearest(name, (*fitting, NONE))
        raise InputError("--reference", printable(name), accepted)
    return name
