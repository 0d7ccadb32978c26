"""What every client of a machine offers: a method for each line of `serve.requests`, and more."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, Generic, TypeVar

from macromicro.errors import InputError
from macromicro.place import Place
from macromicro.remote import _orders, capturing
from macromicro.remote._link import Link
from macromicro.serve.capturing import NOW, Trigger

Begun = TypeVar("Begun")
Answer = TypeVar("Answer")
Caught = TypeVar("Caught")
Quantity = float | str


class Client(ABC, Generic[Begun, Answer, Caught]):
    """The methods of a client, whose documentation is here.

    Positions and speeds are numbers in base units (m, or rad of a rotary machine), or texts with a
    unit: ``"42.123 mm"``. Motions wait for their end unless `wait` is false. Every method raises
    `RequestRefused`, `ConnectionLost` or `InputError`; a motion that fails raises `MotionFailed`.
    """

    link: Link

    @property
    def about(self) -> dict[str, Any]:
        """What the server says of itself and its machine."""
        return self.link.about

    @property
    def settings(self) -> list[dict[str, Any]]:
        """The controller's settings in force: path, value, unit, meaning, bounds."""
        return self.link.gains

    @property
    def place(self) -> Place:
        """What the machine's places are counted in, and read in by people."""
        return _orders.place_of(self.about)

    @abstractmethod
    def _motion(self, name: str, *args: Any, wait: bool, replace: bool = False) -> Begun: ...

    @abstractmethod
    def _order(self, name: str, *args: Any, **fields: Any) -> Answer: ...

    @abstractmethod
    def _capture(self, fields: dict[str, Any]) -> Caught: ...

    def move_to(self, position: Quantity, *, replace: bool = False, wait: bool = True) -> Begun:
        """Move the whole positioner to a position."""
        return self._motion("move to", position, wait=wait, replace=replace)

    def move_by(self, distance: Quantity, *, replace: bool = False, wait: bool = True) -> Begun:
        """Move the whole positioner by a distance from its last target, else from its position."""
        return self._motion("move by", distance, wait=wait, replace=replace)

    def move_macro(self, counts: float, *, replace: bool = False, wait: bool = True) -> Begun:
        """Move the macro-stage alone; the micro-stage is switched off."""
        return self._motion("move macro", counts, wait=wait, replace=replace)

    def move_micro(
        self, contraction: Quantity, *, replace: bool = False, wait: bool = True
    ) -> Begun:
        """Move the micro-stage alone."""
        return self._motion("move micro", contraction, wait=wait, replace=replace)

    def move_macro_by(self, counts: float, *, replace: bool = False, wait: bool = True) -> Begun:
        """Move the macro-stage alone by some counts from its last target."""
        return self._motion("move macro by", counts, wait=wait, replace=replace)

    def move_micro_by(
        self, distance: Quantity, *, replace: bool = False, wait: bool = True
    ) -> Begun:
        """Move the micro-stage alone by a distance from the contraction that it holds."""
        return self._motion("move micro by", distance, wait=wait, replace=replace)

    def move_point(
        self, *place: Quantity, replace: bool = False, wait: bool = True, **named: Quantity
    ) -> Begun:
        """Move all stages of a machine of several on a straight line, or those that are named."""
        return self._motion("move point", *place, named, wait=wait, replace=replace)

    def move_point_by(
        self, *way: Quantity, replace: bool = False, wait: bool = True, **named: Quantity
    ) -> Begun:
        """Move all stages by distances on a straight line, or those that are named."""
        return self._motion("move point by", *way, named, wait=wait, replace=replace)

    def move_axis(
        self, axis: str, position: Quantity, *, replace: bool = False, wait: bool = True
    ) -> Begun:
        """Move one of several stages."""
        return self._motion("move axis", axis, position, wait=wait, replace=replace)

    def move_axis_by(
        self, axis: str, distance: Quantity, *, replace: bool = False, wait: bool = True
    ) -> Begun:
        """Move one of several stages by a distance from the target that it holds."""
        return self._motion("move axis by", axis, distance, wait=wait, replace=replace)

    def home(self, *, wait: bool = True) -> Begun:
        """Find the home position; the position is trusted afterwards."""
        return self._motion("home", wait=wait)

    def jog(self, stage: str, speed: Quantity, *, hold: Quantity | None = None) -> Begun:
        """Move one stage at a speed until the next jog or a soft limit; 0 stops it.

        This client keeps it going as long as it lives. With `hold`, s, the caller does: the jog
        ends as "lost" unless it is called again within that time.
        """
        values = (stage, speed) if hold is None else (stage, speed, hold)
        return self._motion("jog", *values, wait=False)

    def end_follow(self) -> Answer:
        """Rest on the last set point; the motion that `follow` began ends as "done"."""
        return self._order("end follow")

    def set_speed(self, stage: str, speed: Quantity) -> Answer:
        """Set the maximum speed of moves of a stage, from the next one on."""
        return self._order("set speed", stage, speed)

    def programme(self, name: str | os.PathLike[str], *, wait: bool = True) -> Begun:
        """Run a motion programme."""
        return self._motion("programme", name, wait=wait)

    def stop(self) -> Answer:
        """Decelerate at once. Needs no control."""
        return self._order("stop")

    def emergency(self) -> Answer:
        """Make all outputs safe before the next control step. Needs no control."""
        return self._order("emergency")

    def zero(self) -> Answer:
        """Set the laser and the relative reading to zero; absolute positions stay."""
        return self._order("zero")

    def enable(self) -> Answer:
        """Go from disabled to ready. Nothing moves."""
        return self._order("enable")

    def disable(self) -> Answer:
        """Switch both stages off at once; a motion under way ends as "stopped"."""
        return self._order("disable")

    def fan(self, on: bool) -> Answer:
        """Switch the actuator's fan."""
        return self._order("fan", on)

    def clear(self) -> Answer:
        """Clear a fault whose cause is gone; the machine is disabled."""
        return self._order("clear")

    def gains(self, changes: Mapping[str, float | int | str]) -> Answer:
        """Change settings of the controller, all or none."""
        now = {each["path"]: each["value"] for each in self.settings}
        for path in changes:
            if path not in now:
                raise InputError("gains", path, f"one of {', '.join(now)}")
        pairs = [[path, now[path], value] for path, value in changes.items()]
        return self._order("gains", changes=pairs)

    def limits(self, values: Mapping[str, float] | None) -> Answer:
        """Change the soft limits, within the machine's own."""
        return self._order("limits", values=None if values is None else dict(values))

    def take(self) -> Answer:
        """Take control, unless another client has it."""
        return self._order("take")

    def release(self) -> Answer:
        """Give control back, which ends a jog."""
        return self._order("release")

    def record(self) -> Answer:
        """Begin a recording of all columns on the server."""
        return self._order("record")

    @abstractmethod
    def ready(self) -> Any:
        """Enable the machine where it is disabled, and home it where its position is not trusted.
        Homing moves it. Does nothing where it is ready; may be called again.

        Raises
        ------
        RequestRefused
            The machine refuses, as in a fault.
        MotionFailed
            Homing fails.
        """

    @abstractmethod
    def traces(self, span: float = 10.0) -> Any:
        """Yield the last seconds about 30 times a second.

        Parameters
        ----------
        span : float, optional
            2, 10 or 60 s.

        Yields
        ------
        Traces
            All that there is of the span.
        """

    @abstractmethod
    def save_recording(self, path: str | os.PathLike[str]) -> Any:
        """End the recording that `record` began, and fetch its file.

        Parameters
        ----------
        path : str | os.PathLike[str]
            The file; an existing one is replaced.

        Returns
        -------
        int
            Number of rows.

        Raises
        ------
        RequestRefused
            This client has begun no recording.
        """

    @abstractmethod
    def follow(self, stage: str = "", *, hold: float = 0.1) -> Any:
        """Stream set points for the machine to follow within its limits.

        Parameters
        ----------
        stage : str, optional
            What follows; by default the only stage, the macro-stage, or all axes.
        hold : float, optional
            Longest time without a set point, s, 0.01 to 1: the machine comes to rest after it,
            and the motion ends as "lost".

        Returns
        -------
        Stream or AsyncStream
            A context manager with `put`; at its end the machine rests at the last set point.
        """

    def capture(
        self,
        signals: str | Sequence[str],
        trigger: str | Trigger = NOW,
        *,
        before: float = 0.0,
        after: float = 1.0,
        repeat: bool = False,
    ) -> Caught:
        """Capture signals around an event, at the loop's rate.

        Parameters
        ----------
        signals : str | Sequence[str]
            Names of telemetry columns, at most 8; `about["signals"]` lists them with their units.
        trigger : str | Trigger, optional
            "now"; "begin" or "end" of a motion; "fault"; "limit", a limit switch or the end of a
            motion at a limit; or a `Trigger` of an edge or a level of a signal.
        before, after : float, optional
            Times before and after the trigger, s; together less than the last minute.
        repeat : bool, optional
            Whether it begins again once it is complete.

        Returns
        -------
        Capture or AsyncCapture
            The capture, which waits for its trigger from now on; it takes the place of the last
            one of this client.

        Raises
        ------
        RequestRefused
            There is no such signal or trigger.
        """
        return self._capture(capturing.order(signals, trigger, before, after, repeat))
