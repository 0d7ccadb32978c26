"""Programmes of clients for the two-stage machine."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np

from macromicro import programme
from macromicro.control.live.parameters import SoftLimits
from macromicro.errors import InputError, ProblemError
from macromicro.programme import Limits


class Planned(NamedTuple):
    """A programme ready to run."""

    title: str
    plan: Any  # for `messages.Programme`
    moves: int


class Programmes(Protocol):
    def names(self) -> tuple[str, ...]: ...

    def named(self, name: str, soft: SoftLimits) -> Planned:
        """One of the machine's own programmes."""

    def read(self, path: Path, soft: SoftLimits) -> Planned: ...


def called(error: InputError, path: Path, name: str) -> InputError:
    """An error in a file, under the `name` that the client knows."""
    return error.at(error.where.replace(str(path), name))


class TwoStage(NamedTuple):
    """`Programmes` of the two-stage machine."""

    pitch: float  # m per count
    rates: bool = False  # the law uses speed and acceleration of the set point

    def names(self) -> tuple[str, ...]:
        return tuple(programme.shipped())

    def named(self, name: str, soft: SoftLimits) -> Planned:
        path = programme.shipped()[name]
        try:
            return self.read(path, soft)
        except InputError as error:
            raise called(error, path, path.name) from None

    def read(self, path: Path, soft: SoftLimits) -> Planned:
        """The programme in a file."""
        from macromicro.simulate import plan

        micro = 0.0, soft.micro_high  # at 0 the micro-stage is let go
        limits = Limits(soft.macro_low, soft.macro_high, *micro, 1.0 / self.pitch)
        found = programme.load(path, limits)
        if found.from_rest():
            remedy = (
                "Put [[profiles]] behind [[moves]] of their stage, which define the start, or use "
                "CSV; `macromicro run` runs this programme."
            )
            raise ProblemError(str(path), "motion profiles begin at 0", remedy)
        made = plan(found)
        if not self.rates:  # messages to the loop are short
            made = made._replace(velocity=np.empty(0), acceleration=np.empty(0))
        return Planned(found.title, made, len(found.target))
