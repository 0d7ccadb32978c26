"""The machine as a client sees it at one instant, and its traces."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.serve.snapshot import AxisNow, Trouble
from macromicro.serve.web.bins import HEADER


class State(NamedTuple):
    """The machine at one instant. Lengths in m, angles in rad.

    Attributes
    ----------
    running : bool
        Whether the server's loop runs.
    mode : str
        One of `control.live.messages.MODES`, or "off".
    motion : int
        Number of the motion under way, 0 for none.
    position, uncertainty : float
        Of the whole positioner, with the half width of what is known; NaN where it is not.
    trusted : bool
        Whether the position is known since homing.
    trust : str
        Why, or why not.
    target : float
        Where it is going or is held; NaN where it is not.
    fault : Trouble | None
        The latched fault in words, with its remedy.
    holder : str
        The client that holds control, or "".
    temperature : float
        Of the wires, degC, estimated.
    axes : tuple[AxisNow, ...]
        Both of a machine of two.
    limits : dict[str, float]
        Soft limits in force: counts of the macro-stage, mm of the micro-stage, m of the whole.
    possible : tuple[str, ...]
        Requests that make sense now, by their names.
    told : dict[str, Any]
        All that the server says.
    """

    running: bool
    mode: str
    motion: int
    position: float
    uncertainty: float
    trusted: bool
    trust: str
    target: float
    fault: Trouble | None
    holder: str
    temperature: float
    axes: tuple[AxisNow, ...]
    limits: dict[str, float]
    possible: tuple[str, ...]
    told: dict[str, Any]


class Traces(NamedTuple):
    """The last seconds: the least and the largest value of each channel in each short time.

    Attributes
    ----------
    names : tuple[str, ...]
        Of the channels: places in mm or deg, efforts in V, temperature in degC.
    time : Array
        Middle of each short time since the loop's start, s; shape (n,).
    low, high : Array
        Shape (channels, n).
    """

    names: tuple[str, ...]
    time: Array
    low: Array
    high: Array


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)


def _axis(given: dict[str, Any]) -> AxisNow:
    return AxisNow(given["name"], *(_number(given[key]) for key in AxisNow._fields[1:]))


def read_state(told: dict[str, Any]) -> State:
    """What the server says, as a `State`.

    Parameters
    ----------
    told : dict[str, Any]
        Its message.

    Returns
    -------
    State
        The same, NaN for what has no number.
    """
    return State(
        bool(told["running"]),
        told["mode"],
        told["motion"],
        _number(told["position_m"]),
        _number(told["uncertainty_m"]),
        bool(told["trusted"]),
        told["trust"],
        _number(told["target_m"]),
        None if told["fault"] is None else Trouble(**told["fault"]),
        told["holder"],
        _number(told["temperature_c"]),
        tuple(_axis(axis) for axis in told["axes"]),
        told["limits"],
        tuple(told["possible"]),
        told,
    )


class Window:
    """Traces that grow by frames and forget what is older than `span` [s]."""

    def __init__(self, names: Iterable[str], span: float) -> None:
        self._names, self._span = tuple(names), span
        self._first, self._width = 0, 1.0
        self._bins: Array = np.empty((0, len(self._names), 2))

    def take(self, frame: bytes) -> Traces:
        """The traces with one more frame.

        Parameters
        ----------
        frame : bytes
            As `serve.web.bins.frame` makes it.

        Returns
        -------
        Traces
            The last `span` of them.
        """
        head = HEADER.unpack_from(frame)
        count, channels, first, width = head[2], head[3], int(head[4]), head[5]
        new = np.frombuffer(frame, "<f4", count * channels * 2, HEADER.size)
        new = new.reshape(count, channels, 2).astype(float)
        kept = self._bins[: max(first - self._first, 0)] if width == self._width else self._bins[:0]
        if len(kept) != first - self._first:  # another loop, or a frame that was lost
            kept, self._first = self._bins[:0], first
        self._width = width
        self._bins = np.concatenate([kept, new])
        most = round(self._span / width)
        self._first += max(len(self._bins) - most, 0)
        self._bins = self._bins[-most:]
        time: Array = (self._first + np.arange(len(self._bins)) + 0.5) * width
        return Traces(self._names, time, self._bins[:, :, 0].T, self._bins[:, :, 1].T)
