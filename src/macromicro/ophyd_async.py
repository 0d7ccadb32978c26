"""A motor record for ophyd-async whose failed moves raise."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from ophyd_async.core import SignalR, TimeoutCalculator
from ophyd_async.epics.core import epics_signal_r
from ophyd_async.epics.motor import Motor as _Motor
from ophyd_async.epics.motor import MotorFlyableMovableLogic

from macromicro.errors import MacromicroError


class MoveFailed(MacromicroError):
    """A move that did not arrive, was stopped or was refused."""


@dataclass
class _Checked(MotorFlyableMovableLogic):
    """Checks the position, because a failed put may end without an error."""

    violated: SignalR[int]
    near: SignalR[float]

    async def move(self, new_position: float, timeout: TimeoutCalculator) -> None:
        try:
            await super().move(new_position, timeout)
        except Exception as error:
            raise MoveFailed(f"{self.readback.name}: {error}") from error
        place = await self.readback.get_value()
        far = abs(place - new_position) > await self.near.get_value()
        if far or await self.violated.get_value():
            raise MoveFailed(
                f"{self.readback.name} is at {place:g}, not at {new_position:g}; "
                "the record's machine says why (PREFIX:failure, PREFIX:fault)"
            )


class Motor(_Motor):
    """`ophyd_async.epics.motor.Motor` of a record of `macromicro serve --epics`.

    Parameters
    ----------
    prefix : str
        Of the record, such as "LAB:STAGE:whole".
    name : str, optional
        Of the device.

    Examples
    --------
    >>> from macromicro.ophyd_async import Motor
    >>> Motor("LAB:STAGE:whole", name="stage").name
    'stage'
    """

    def __init__(self, prefix: str, name: str = "") -> None:
        self.limit_violation = epics_signal_r(int, f"{prefix}.LVIO")
        super().__init__(prefix, name)

    @cached_property
    def _logic(self) -> MotorFlyableMovableLogic:
        return _Checked(**vars(super()._logic), violated=self.limit_violation, near=self.deadband)
