"""Options of each kind of identification: meaning, default, and how the command line says them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, NamedTuple

Tests = tuple[str, ...]  # files with records that are not fitted


class Said(NamedTuple):
    help: str
    default: str | None = None  # in words; None: as it is
    metavar: str | None = None
    parse: Callable[[str], Any] | None = None  # a text of several types


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def _whole(text: str) -> int | str:
    return int(text) if text.lstrip("+-").isdecimal() else text


class Drive(NamedTuple):
    gain: Annotated[float | None, Said("Force per unit of u, such as N/V.", "1")] = None
    structure: Annotated[
        str, Said("auto, viscous, coulomb, asymmetric, stribeck, full or lugre.")
    ] = "auto"
    along: Annotated[
        int | None, Said("For lugre: nodes of the friction along the travel.", "auto")
    ] = None
    limit: Annotated[float | None, Said("The drive saturates at +-LIMIT.")] = None
    delay: Annotated[
        int | str | None,
        Said(
            "Delay of u in samples, or fit: identified with the parameters.",
            "0",
            "<int>|fit",
            _whole,
        ),
    ] = None
    spring: Annotated[bool, Said("The load is on a spring.")] = False
    dead_zone: Annotated[bool, Said("The drive has a dead zone at small u.")] = False
    eccentric: Annotated[bool, Said("Gravity acts on a rotating load (x an angle).")] = False
    endless: Annotated[
        bool, Said("Continuous rotation: the model has no end stops (x an angle).")
    ] = False
    free: Annotated[bool, Said("Free decay without a drive (columns t, x).")] = False
    tests: Tests = ()


class Carriage(NamedTuple):
    pitch: Annotated[str | None, Said("Travel per count, such as 71.4um.", "by y")] = None
    tests: Tests = ()


class Actuator(NamedTuple):
    table: Annotated[Path | None, Said("table.h5 of `identify hysteresis`.", metavar="FILE")] = None
    ambient: Annotated[float | None, Said("Room temperature [degC].", "25")] = None
    austenite: Annotated[
        float | None, Said("Without --table: temperature of half contraction [degC].", "80")
    ] = None
    tests: Tests = ()


class Linear(NamedTuple):
    method: Annotated[str, Said("output_error, box_jenkins, mls, sriv, gls or least_squares.")] = (
        "output_error"
    )
    order: Annotated[str, Said("Orders of a and b, and the delay.")] = "1,1,1"
    start: Annotated[str, Said("Records start at rest, or free.")] = "rest"
    width: Annotated[float, Said("Dead zone, subtracted from the magnitude of u.")] = 0.0
    offset: Annotated[float | None, Said("Constant of the output, in its unit.", "found")] = None
    tests: Tests = ()


class Deadzone(NamedTuple):
    travel: Annotated[tuple[float, float] | None, Said("Range of x over which motion counts.")] = (
        None
    )
    pause: Annotated[float, Said("A longer standstill counts as a stop [s].")] = 0.05
    gain: Annotated[float | None, Said("Static gain [x/s/V], for a0 and delta of (4.5).")] = None
    width: Annotated[float | None, Said("Dead zone for these [V].", "the one found")] = None
    tests: Tests = ()


class Hysteresis(NamedTuple):
    curves: Annotated[str, Said("auto, ascending or descending.")] = "auto"
    shape: Annotated[str, Said("Relay density: free, monotone or nonnegative.")] = "monotone"
    smooth: Annotated[
        float | str,
        Said("Smoothing length [grid steps]; auto: by cross-validation.", "1", parse=_number),
    ] = 1.0
    between: Annotated[
        str,
        Said(
            "Interpolation between curves: along the input, or along the "
            "output for steep branches; auto: by cross-validation."
        ),
    ] = "input"
    drift: Annotated[bool, Said("Scale each curve of a MicroMag file by its calibration.")] = False
    tests: Tests = ()


class Stress(NamedTuple):
    tests: Tests = ()


class Thermal(NamedTuple):
    table: Annotated[
        Path | None, Said("table.h5 of `identify hysteresis`, to infer heat from positions.")
    ] = None
    ambient: Annotated[float | None, Said("Room temperature [degC].", "first value, or 25")] = None
    step: Annotated[float | None, Said("Voltage of the step for the dynamics [V].")] = None
    tests: Tests = ()


class Hall(NamedTuple):
    low: Annotated[float, Said("First voltage of the table.")] = 0.0
    high: Annotated[float, Said("Last voltage of the table.")] = 5.0
    points: Annotated[int, Said("Number of voltages in the table.")] = 126
    method: Annotated[str, Said("mean or spline.")] = "mean"
    tests: Tests = ()


class Plays(NamedTuple):
    plays: Annotated[
        int, Said("Number of play operators, including the one without a threshold.")
    ] = 16
    rate: Annotated[bool, Said("The loop depends on the rate (column t).")] = False
    tests: Tests = ()
