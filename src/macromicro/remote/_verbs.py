"""The client's requests: a method for each line of `serve.requests`."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, Generic, TypeVar

Begun = TypeVar("Begun")
Told = TypeVar("Told")
Quantity = float | str


class Verbs(ABC, Generic[Begun, Told]):
    """The requests of a client.

    Positions and speeds are numbers in base units (m, or rad of a rotary machine), or texts with a
    unit: ``"42.123 mm"``. Motions wait for their end unless `wait` is false. Every method raises
    `RequestRefused`, `ConnectionLost` or `InputError`; a motion that fails raises `MotionFailed`.
    """

    @abstractmethod
    def _motion(
        self, name: str, values: tuple[Any, ...] = (), *, wait: bool, replace: bool = False
    ) -> Begun: ...

    @abstractmethod
    def _order(
        self, name: str, values: tuple[Any, ...] = (), own: dict[str, Any] | None = None
    ) -> Told: ...

    @abstractmethod
    def _programme(self, name: str | os.PathLike[str], *, wait: bool) -> Begun: ...

    @abstractmethod
    def _gains(self, changes: Mapping[str, float | int | str]) -> Told: ...

    def move_to(self, position: Quantity, *, replace: bool = False, wait: bool = True) -> Begun:
        """Move the whole positioner to a position."""
        return self._motion("move to", (position,), wait=wait, replace=replace)

    def move_by(self, distance: Quantity, *, replace: bool = False, wait: bool = True) -> Begun:
        """Move the whole positioner by a distance from its last target, else from its position."""
        return self._motion("move by", (distance,), wait=wait, replace=replace)

    def move_macro(self, counts: float, *, replace: bool = False, wait: bool = True) -> Begun:
        """Move the macro-stage alone; the micro-stage is switched off."""
        return self._motion("move macro", (counts,), wait=wait, replace=replace)

    def move_micro(
        self, contraction: Quantity, *, replace: bool = False, wait: bool = True
    ) -> Begun:
        """Move the micro-stage alone."""
        return self._motion("move micro", (contraction,), wait=wait, replace=replace)

    def move_macro_by(self, counts: float, *, replace: bool = False, wait: bool = True) -> Begun:
        """Move the macro-stage alone by some counts from its last target."""
        return self._motion("move macro by", (counts,), wait=wait, replace=replace)

    def move_micro_by(
        self, distance: Quantity, *, replace: bool = False, wait: bool = True
    ) -> Begun:
        """Move the micro-stage alone by a distance from the contraction that it holds."""
        return self._motion("move micro by", (distance,), wait=wait, replace=replace)

    def move_point(
        self, *place: Quantity, replace: bool = False, wait: bool = True, **named: Quantity
    ) -> Begun:
        """Move all stages of a machine of several on a straight line, or those that are named."""
        return self._motion("move point", (*place, named), wait=wait, replace=replace)

    def move_point_by(
        self, *way: Quantity, replace: bool = False, wait: bool = True, **named: Quantity
    ) -> Begun:
        """Move all stages by distances on a straight line, or those that are named."""
        return self._motion("move point by", (*way, named), wait=wait, replace=replace)

    def move_axis(
        self, axis: str, position: Quantity, *, replace: bool = False, wait: bool = True
    ) -> Begun:
        """Move one of several stages."""
        return self._motion("move axis", (axis, position), wait=wait, replace=replace)

    def move_axis_by(
        self, axis: str, distance: Quantity, *, replace: bool = False, wait: bool = True
    ) -> Begun:
        """Move one of several stages by a distance from the target that it holds."""
        return self._motion("move axis by", (axis, distance), wait=wait, replace=replace)

    def home(self, *, wait: bool = True) -> Begun:
        """Find the home position; the position is trusted afterwards."""
        return self._motion("home", wait=wait)

    def jog(self, stage: str, speed: Quantity, *, hold: Quantity | None = None) -> Begun:
        """Move one stage at a speed until the next jog or a soft limit; 0 stops it.

        This client keeps it going as long as it lives. With `hold`, s, the caller does: the jog
        ends as "lost" unless it is called again within that time.
        """
        values = (stage, speed) if hold is None else (stage, speed, hold)
        return self._motion("jog", values, wait=False)

    def end_follow(self) -> Told:
        """Rest on the last set point; the motion that `follow` began ends as "done"."""
        return self._order("end follow")

    def set_speed(self, stage: str, speed: Quantity) -> Told:
        """Set the maximum speed of moves of a stage, from the next one on."""
        return self._order("set speed", (stage, speed))

    def programme(self, name: str | os.PathLike[str], *, wait: bool = True) -> Begun:
        """Run a motion programme."""
        return self._programme(name, wait=wait)

    def stop(self) -> Told:
        """Decelerate at once. Needs no control."""
        return self._order("stop")

    def emergency(self) -> Told:
        """Make all outputs safe before the next control step. Needs no control."""
        return self._order("emergency")

    def zero(self) -> Told:
        """Set the laser and the relative reading to zero; absolute positions stay."""
        return self._order("zero")

    def enable(self) -> Told:
        """Go from disabled to ready. Nothing moves."""
        return self._order("enable")

    def disable(self) -> Told:
        """Switch both stages off at once; a motion under way ends as "stopped"."""
        return self._order("disable")

    def fan(self, on: bool) -> Told:
        """Switch the actuator's fan."""
        return self._order("fan", (on,))

    def clear(self) -> Told:
        """Clear a fault whose cause is gone; the machine is disabled."""
        return self._order("clear")

    def gains(self, changes: Mapping[str, float | int | str]) -> Told:
        """Change settings of the controller, all or none."""
        return self._gains(changes)

    def limits(self, values: Mapping[str, float] | None) -> Told:
        """Change the soft limits, within the machine's own."""
        return self._order("limits", own={"values": None if values is None else dict(values)})

    def take(self) -> Told:
        """Take control, unless another client has it."""
        return self._order("take")

    def release(self) -> Told:
        """Give control back, which ends a jog."""
        return self._order("release")

    def record(self) -> Told:
        """Begin a recording of all columns on the server."""
        return self._order("record")
