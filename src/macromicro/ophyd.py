"""A positioner for Bluesky and ophyd without EPICS: the twin, or a served machine."""

from __future__ import annotations

import math
import threading
import time
from functools import partial
from typing import Any

from ophyd.positioner import PositionerBase
from ophyd.status import MoveStatus
from ophyd.utils import LimitError

from macromicro.control.live.messages import SUPERSEDED
from macromicro.errors import InputError, MacromicroError
from macromicro.remote import gathering
from macromicro.remote.failures import MotionFailed, RequestRefused
from macromicro.remote.machine import Machine, Motion, connect
from macromicro.serve.hosts import HOST, WEB_PORT
from macromicro.serve.snapshot import AxisNow
from macromicro.units import quantity

TWIN = "twin"
LOCK_S = 0.2  # longest time that a stop waits for a move to be asked for


class _Move(MoveStatus):  # type: ignore[misc]
    """A move's status. A failure under way stops the machine, unless the move was superseded."""

    ended = False

    def _handle_failure(self) -> None:
        if not self.ended:
            super()._handle_failure()


def _is_superseded(error: MacromicroError) -> bool:
    return isinstance(error, MotionFailed) and error.outcome == SUPERSEDED


class Positioner(PositionerBase):  # type: ignore[misc]
    """A machine as a device that Bluesky moves and reads, in mm (deg of one that turns).

    Places are numbers in that unit, or texts with a unit: ``"42.123 mm"``. The client `connect`,
    whose numbers are m and rad, takes the same texts.

    Creating one takes control and moves nothing. `ready` enables the machine and homes it if its
    position is not trusted; a plan that stages the device does the same. The status of a failed
    move has the reason. `close` releases everything.

    Parameters
    ----------
    host : str, optional
        Where `macromicro serve` runs; "twin" starts a virtual machine for this device alone.
    port : int, optional
        Of the server's page.
    name : str, optional
        Of the device; its readings have it.
    axis : str, optional
        Name of one of several stages, such as "x"; "" for the whole position.
    token : str | None, optional
        The server's token.
    config : str | None, optional
        Settings file of the virtual machine.
    machine : Machine | None, optional
        A client that is connected already: the stages of one machine share it.
    """

    def __init__(
        self,
        host: str = TWIN,
        port: int = WEB_PORT,
        *,
        name: str = "stage",
        axis: str = "",
        token: str | None = None,
        config: str | None = None,
        machine: Machine | None = None,
    ) -> None:
        self._twin: Any = None
        self._stops = 0
        self._own = machine is None
        if machine is None and host == TWIN:
            from macromicro.serve.alone import Alone

            self._twin = Alone(config)
            host, port, token = HOST, self._twin.start(), self._twin.token
        try:
            self.machine = machine or connect(host, port, token=token)
            known = [each["name"] for each in self.machine.about["axes"]]
            if axis and axis not in known:
                accepted = ", ".join(known) or "none: this machine has one position"
                raise InputError("axis", axis, accepted)
            self._axis = axis
            self._gathering = gathering.of(self.machine)
            self._lock = self._gathering.lock
            self._per = self.machine.place.per
            super().__init__(name=name)
        except BaseException:
            self.close()
            raise

    def ready(self) -> None:
        """Enable the machine where it is disabled, and home it where its position is not trusted:
        it moves. Does nothing where it is ready.

        Raises
        ------
        RequestRefused
            The machine refuses, as in a fault.
        MotionFailed
            Homing fails.
        """
        self.machine.ready()

    def stage(self) -> list[Any]:
        """As `ready`; plans such as `scan` call it first.

        Returns
        -------
        list[Any]
            This device.
        """
        self.ready()
        return [self]

    def unstage(self) -> list[Any]:
        """Leave the machine as it is, enabled; plans call it last.

        Returns
        -------
        list[Any]
            This device.
        """
        return [self]

    def close(self) -> None:
        """Stop what moves, give control back, and end the virtual machine."""
        try:
            if self._own and hasattr(self, "machine"):
                self.machine.close()
        finally:
            if self._twin is not None:
                self._twin.stop()

    @property
    def egu(self) -> str:
        """Unit of its places."""
        return self.machine.place.unit

    @property
    def position(self) -> float:
        """Where it is now."""
        return self._place(self.machine.state)

    def _place(self, state: Any) -> float:
        own = self._stage_now(state)
        return (state.position if own is None else own.position_m) * self._per

    def _stage_now(self, state: Any) -> AxisNow | None:
        """Its own one of several stages."""
        return next((axis for axis in state.axes if axis.name == self._axis), None)

    def locate(self) -> dict[str, float]:
        """Set point, where relative moves of plans start, and readback.

        Returns
        -------
        dict[str, float]
            "setpoint": target of the last move, else the position; "readback"; mm or deg.
        """
        state = self.machine.state
        own, here = self._stage_now(state), self._place(state)
        target = (state.target if own is None else own.target_m) * self._per
        return {"setpoint": here if math.isnan(target) else target, "readback": here}

    @property
    def limits(self) -> tuple[float, float]:
        """The soft limits in force."""
        state = self.machine.state
        own = self._stage_now(state)
        if own is not None:
            return own.low_m * self._per, own.high_m * self._per
        return state.limits["whole_low"] * self._per, state.limits["whole_high"] * self._per

    @property
    def moving(self) -> bool:
        """Does the machine move?"""
        return bool(self.machine.state.motion)

    def _number(self, place: float | str) -> float:
        """A place in `egu`."""
        if not isinstance(place, str):
            return place
        own = self.machine.place
        return quantity(place, own.base, self.name, own.unit) * self._per

    def check_value(self, value: float | str) -> None:
        """Check that a position is within the limits.

        Parameters
        ----------
        value : float | str
            mm, deg of a machine that turns, or a text with a unit.

        Raises
        ------
        LimitError
            It is not.
        InputError
            A text that is not a position.
        """
        (low, high), value = self.limits, self._number(value)
        if not low <= value <= high:
            raise LimitError(f"{self.name}: {value:g} is not within {low:g} to {high:g} {self.egu}")

    def move(self, position: float | str, wait: bool = True, **kwargs: Any) -> Any:
        """Move to a place.

        Parameters
        ----------
        position : float | str
            mm, deg of a machine that turns, or a text with a unit.
        wait : bool, optional
            Whether to return only at the end.
        **kwargs : Any
            Of ophyd: `moved_cb`, `timeout`.

        Returns
        -------
        Any
            The status, which fails with the reason where the move is refused or not done.
        """
        position = self._number(position)
        self.check_value(position)
        moved_cb = kwargs.pop("moved_cb", None)
        status = _Move(self, position, settle_time=self._settle_time, **kwargs)
        if moved_cb is not None:
            status.add_callback(partial(moved_cb, obj=self))
        given = position / self._per, status, self._stops
        threading.Thread(target=self._go, args=given, daemon=True).start()
        if wait:
            status.wait()
        return status

    def _go(self, target: float, status: Any, stops: int) -> None:
        try:
            self._begin(target, stops).wait()
        except MacromicroError as error:
            status.ended = isinstance(error, RequestRefused) or _is_superseded(error)
            if not status.done:
                status.set_exception(error)
            return
        self._set_position(self.position)
        if not status.done:
            status.set_finished()
        self._run_subs(sub_type=self.SUB_DONE)

    def _begin(self, target: float, stops: int) -> Motion:
        """Begin the move, unless a stop came since; that of one of several stages once nothing
        else moves, with those of others that are asked for at the same time."""

        def check() -> None:
            if self._stops != stops:
                raise MotionFailed(f"{self.name}", "stopped", "", {})

        if self._axis:
            return self._gathering.begin(self._axis, target, check)
        with self._lock:
            check()
            return self.machine.move_to(target, replace=True, wait=False)

    def stop(self, *, success: bool = False) -> None:
        """Decelerate; moves under way or waiting fail.

        Parameters
        ----------
        success : bool, optional
            Of ophyd; a stopped move fails in any case.
        """
        self._stops += 1
        # Behind it nothing begins. Who holds the lock for longer waits for the server; what it
        # asks for was sent before the stop, or is not asked for any more.
        held = self._lock.acquire(timeout=LOCK_S)
        try:
            self.machine.stop()
        finally:
            if held:
                self._lock.release()

    # What Bluesky reads

    def read(self) -> dict[str, dict[str, Any]]:
        """Where it is.

        Returns
        -------
        dict[str, dict[str, Any]]
            Value and time by the device's name, and the uncertainty (half width).
        """
        now, state = time.time(), self.machine.state
        return {
            self.name: {"value": self._place(state), "timestamp": now},
            f"{self.name}_uncertainty": {"value": state.uncertainty * self._per, "timestamp": now},
        }

    def describe(self) -> dict[str, dict[str, Any]]:
        """What `read` gives.

        Returns
        -------
        dict[str, dict[str, Any]]
            Source, type, shape and unit by name.
        """
        low, high = self.limits
        about = {"source": "macromicro", "dtype": "number", "shape": [], "units": self.egu}
        ends = {"lower_ctrl_limit": low, "upper_ctrl_limit": high}
        return {self.name: about | ends, f"{self.name}_uncertainty": dict(about)}

    def read_configuration(self) -> dict[str, dict[str, Any]]:
        """The controller's settings that are numbers.

        Returns
        -------
        dict[str, dict[str, Any]]
            Value and time by name.
        """
        now = time.time()
        return {key: {"value": s["value"], "timestamp": now} for key, s in self._gains().items()}

    def describe_configuration(self) -> dict[str, dict[str, Any]]:
        """What `read_configuration` gives.

        Returns
        -------
        dict[str, dict[str, Any]]
            Source, type, shape and unit by name.
        """
        about = {"dtype": "number", "shape": []}
        return {
            key: about | {"source": f"macromicro {s['path']}", "units": s["unit"]}
            for key, s in self._gains().items()
        }

    def _gains(self) -> dict[str, dict[str, Any]]:
        found = self.machine.settings
        return {
            f"{self.name}_{s['path'].replace('.', '_')}": s
            for s in found
            if isinstance(s["value"], int | float)
        }

    @property
    def hints(self) -> dict[str, list[str]]:
        """What is plotted."""
        return {"fields": [self.name]}
