"""Snapshots and traces of the machine for a client."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.serve.snapshot import AxisNow, Trouble
from macromicro.serve.web.bins import HEADER


class State(NamedTuple):
    """The machine at one instant. Lengths in m, angles in rad."""

    running: bool  # whether the server's loop runs
    mode: str  # one of `control.live.messages.MODES`, or "off"
    motion: int  # number of the motion under way, 0 for none
    position: float  # of the whole positioner, with the half width of what is known
    uncertainty: float  # NaN where it is not
    trusted: bool  # whether the position is known since homing
    trust: str  # why, or why not
    target: float  # where it is going or is held; NaN where it is not
    fault: Trouble | None  # the latched fault in words, with its remedy
    holder: str  # the client that holds control, or ""
    temperature: float  # of the wires, degC, estimated
    axes: tuple[AxisNow, ...]  # both of a machine of two
    # soft limits in force, in m or rad: ``whole_low`` and ``whole_high``; of the thesis' machine
    # those of each stage as well, in counts and mm
    limits: dict[str, float]
    possible: tuple[str, ...]  # requests that make sense now, by their names
    told: dict[str, Any]  # all that the server says


class Traces(NamedTuple):
    """The last seconds: the least and the largest value of each channel in each short time."""

    # of the channels: places in mm or deg, efforts in V, temperature in degC
    names: tuple[str, ...]
    time: Array  # middle of each short time since the loop's start, s; shape (n,)
    # low, high: shape (channels, n)
    low: Array
    high: Array


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)


def _axis(given: dict[str, Any]) -> AxisNow:
    return AxisNow(given["name"], *(_number(given[key]) for key in AxisNow._fields[1:]))


def read_state(told: dict[str, Any]) -> State:
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
    """Traces that grow by frames and forget what is older than `span`."""

    def __init__(self, names: Iterable[str], span: float) -> None:
        self._names, self._span = tuple(names), span
        self._first, self._width = 0, 1.0
        self._bins: Array = np.empty((0, len(self._names), 2))

    def take(self, frame: bytes) -> Traces:
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
