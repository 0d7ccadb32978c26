"""What a client may ask of its machine: a method for each line of `serve.requests`."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, Generic, TypeVar

Begun = TypeVar("Begun")
Told = TypeVar("Told")
Quantity = float | str


class Verbs(ABC, Generic[Begun, Told]):
    """The requests, for whoever sends them.

    Places and speeds are numbers in base units (m, or rad of a machine that turns), or texts with
    a unit: ``"42.123 mm"``. What moves waits for its end, unless `wait` is false, and returns its
    motion. Every method raises `RequestRefused` where the machine refuses, `MotionFailed` where a
    motion that is waited for ends otherwise than done, `ConnectionLost` where no answer comes, and
    `InputError` for a value that cannot be.
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
        """The whole positioner to a place.

        Parameters
        ----------
        position : Quantity
            m or rad, or a text with a unit.
        replace : bool, optional
            Whether a motion under way ends as "superseded"; else the move is refused meanwhile.
        wait : bool, optional
            Whether to return only at the end.

        Returns
        -------
        Begun
            The motion.
        """
        return self._motion("move to", (position,), wait=wait, replace=replace)

    def move_by(self, distance: Quantity, *, replace: bool = False, wait: bool = True) -> Begun:
        """The whole positioner by a distance from the target of the last move.

        After a stop, a jog, homing, a fault, or disabling there is none: then from where it is.

        Parameters
        ----------
        distance : Quantity
            m or rad, or a text with a unit.
        replace : bool, optional
            As of `move_to`.
        wait : bool, optional
            Whether to return only at the end.

        Returns
        -------
        Begun
            The motion.
        """
        return self._motion("move by", (distance,), wait=wait, replace=replace)

    def move_macro(self, counts: float, *, replace: bool = False, wait: bool = True) -> Begun:
        """The macro-stage alone; the micro-stage goes off.

        Parameters
        ----------
        counts : float
            Of the encoder, homed frame; a whole number.
        replace : bool, optional
            As of `move_to`.
        wait : bool, optional
            Whether to return only at the end.

        Returns
        -------
        Begun
            The motion.
        """
        return self._motion("move macro", (counts,), wait=wait, replace=replace)

    def move_micro(
        self, contraction: Quantity, *, replace: bool = False, wait: bool = True
    ) -> Begun:
        """The micro-stage alone; the macro-stage stands.

        Parameters
        ----------
        contraction : Quantity
            m, or a text with a unit.
        replace : bool, optional
            As of `move_to`.
        wait : bool, optional
            Whether to return only at the end.

        Returns
        -------
        Begun
            The motion.
        """
        return self._motion("move micro", (contraction,), wait=wait, replace=replace)

    def move_macro_by(self, counts: float, *, replace: bool = False, wait: bool = True) -> Begun:
        """The macro-stage alone by some counts, from its last target as `move_by`.

        Parameters
        ----------
        counts : float
            Of the encoder; it goes to the nearest count, and fractions add up.
        replace : bool, optional
            As of `move_to`.
        wait : bool, optional
            Whether to return only at the end.

        Returns
        -------
        Begun
            The motion.
        """
        return self._motion("move macro by", (counts,), wait=wait, replace=replace)

    def move_micro_by(
        self, distance: Quantity, *, replace: bool = False, wait: bool = True
    ) -> Begun:
        """The micro-stage alone by a distance, from the contraction that it holds as `move_by`.

        Parameters
        ----------
        distance : Quantity
            m, or a text with a unit.
        replace : bool, optional
            As of `move_to`.
        wait : bool, optional
            Whether to return only at the end.

        Returns
        -------
        Begun
            The motion.
        """
        return self._motion("move micro by", (distance,), wait=wait, replace=replace)

    def move_point(
        self, x: Quantity, y: Quantity, *, replace: bool = False, wait: bool = True
    ) -> Begun:
        """Both axes of a machine of two, on a straight line.

        Parameters
        ----------
        x, y : Quantity
            m, or texts with a unit.
        replace : bool, optional
            As of `move_to`; what is replaced comes to rest first, on its line or path.
        wait : bool, optional
            Whether to return only at the end.

        Returns
        -------
        Begun
            The motion.
        """
        return self._motion("move point", (x, y), wait=wait, replace=replace)

    def move_point_by(
        self, x: Quantity, y: Quantity, *, replace: bool = False, wait: bool = True
    ) -> Begun:
        """Both axes of a machine of two by a distance, on a straight line.

        Parameters
        ----------
        x, y : Quantity
            m, or texts with a unit.
        replace : bool, optional
            As of `move_to`; what is replaced comes to rest first, on its line or path.
        wait : bool, optional
            Whether to return only at the end.

        Returns
        -------
        Begun
            The motion.
        """
        return self._motion("move point by", (x, y), wait=wait, replace=replace)

    def move_axis(
        self, axis: str, position: Quantity, *, replace: bool = False, wait: bool = True
    ) -> Begun:
        """One axis of a machine of two; the other one stands.

        Parameters
        ----------
        axis : str
            "x" or "y".
        position : Quantity
            m, or a text with a unit.
        replace : bool, optional
            As of `move_to`; what is replaced comes to rest first, on its line or path.
        wait : bool, optional
            Whether to return only at the end.

        Returns
        -------
        Begun
            The motion.
        """
        return self._motion("move axis", (axis, position), wait=wait, replace=replace)

    def move_axis_by(
        self, axis: str, distance: Quantity, *, replace: bool = False, wait: bool = True
    ) -> Begun:
        """One axis of a machine of two by a distance from the target that it holds.

        Parameters
        ----------
        axis : str
            "x" or "y".
        distance : Quantity
            m, or a text with a unit.
        replace : bool, optional
            As of `move_to`; what is replaced comes to rest first, on its line or path.
        wait : bool, optional
            Whether to return only at the end.

        Returns
        -------
        Begun
            The motion.
        """
        return self._motion("move axis by", (axis, distance), wait=wait, replace=replace)

    def home(self, *, wait: bool = True) -> Begun:
        """Give the place a known coordinate; the position is trusted afterwards.

        Parameters
        ----------
        wait : bool, optional
            Whether to return only at the end.

        Returns
        -------
        Begun
            The motion.
        """
        return self._motion("home", wait=wait)

    def jog(self, stage: str, speed: Quantity) -> Begun:
        """One stage at a speed until the next jog; 0 ends it. It ends by itself, too, when this
        client is gone, and at the soft limits.

        Parameters
        ----------
        stage : str
            "macro" or "micro", or "x" or "y" of a machine of two axes.
        speed : Quantity
            m/s or rad/s, or a text with a unit.

        Returns
        -------
        Begun
            The motion, at once.
        """
        return self._motion("jog", (stage, speed), wait=False)

    def set_speed(self, stage: str, speed: Quantity) -> Told:
        """The fastest that moves of a stage go, from the next one on; of a machine of one stage
        or of two axes, and not while it moves.

        Parameters
        ----------
        stage : str
            "macro", or "x" or "y" of a machine of two axes.
        speed : Quantity
            m/s or rad/s, or a text with a unit; up to that of the machine's settings.

        Returns
        -------
        Told
            Nothing.
        """
        return self._order("set speed", (stage, speed))

    def programme(self, name: str | os.PathLike[str], *, wait: bool = True) -> Begun:
        """Run a motion programme.

        Parameters
        ----------
        name : str | os.PathLike[str]
            Of one that the server brings along, or a file here (.toml, .csv).
        wait : bool, optional
            Whether to return only at the end.

        Returns
        -------
        Begun
            The motion.
        """
        return self._programme(name, wait=wait)

    def stop(self) -> Told:
        """Decelerate. Needs no control; overtakes whatever waits.

        Returns
        -------
        Told
            Nothing.

        Raises
        ------
        StopNotConfirmed
            The server did not confirm it within a second.
        """
        return self._order("stop")

    def emergency(self) -> Told:
        """All outputs safe before the next control step. Needs no control.

        Returns
        -------
        Told
            Nothing.

        Raises
        ------
        StopNotConfirmed
            The server did not confirm it within a second: the power must be cut.
        """
        return self._order("emergency")

    def zero(self) -> Told:
        """Laser and relative reading to zero here; absolute places stay.

        Returns
        -------
        Told
            Nothing.
        """
        return self._order("zero")

    def enable(self) -> Told:
        """From disabled to ready. Nothing moves.

        Returns
        -------
        Told
            Nothing.
        """
        return self._order("enable")

    def disable(self) -> Told:
        """Both stages off at once; a motion under way ends as "stopped".

        Returns
        -------
        Told
            Nothing.
        """
        return self._order("disable")

    def fan(self, on: bool) -> Told:
        """The actuator's fan.

        Parameters
        ----------
        on : bool
            Whether it runs.

        Returns
        -------
        Told
            Nothing.
        """
        return self._order("fan", (on,))

    def clear(self) -> Told:
        """Clear a fault whose cause is gone: to disabled.

        Returns
        -------
        Told
            Nothing.
        """
        return self._order("clear")

    def gains(self, changes: Mapping[str, float | int | str]) -> Told:
        """New settings of the controller, all or none.

        Parameters
        ----------
        changes : Mapping[str, float | int | str]
            Value by path, in the units that `settings` names.

        Returns
        -------
        Told
            Nothing.
        """
        return self._gains(changes)

    def limits(self, values: Mapping[str, float] | None) -> Told:
        """New soft limits, within the machine's own.

        Parameters
        ----------
        values : Mapping[str, float] | None
            All that ``state.limits`` has, in its units; None for the machine's own.

        Returns
        -------
        Told
            Nothing.
        """
        return self._order("limits", own={"values": None if values is None else dict(values)})

    def take(self) -> Told:
        """Take control. Refused where another client has it.

        Returns
        -------
        Told
            Nothing.
        """
        return self._order("take")

    def release(self) -> Told:
        """Give control back; a jog under way ends by that.

        Returns
        -------
        Told
            Nothing.
        """
        return self._order("release")

    def record(self) -> Told:
        """Begin a recording on the server, every period, all columns.

        Returns
        -------
        Told
            Nothing; `save_recording` ends it.
        """
        return self._order("record")
