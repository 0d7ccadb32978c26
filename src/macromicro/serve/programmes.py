"""Programmes as clients send them to the two-stage machine, and what every machine offers."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np

from macromicro import programme
from macromicro.control.live.parameters import SoftLimits
from macromicro.errors import InputError
from macromicro.programme import Limits


class Planned(NamedTuple):
    """A programme that can be run. `title`: for people; `plan`: of `messages.Programme`; `moves`:
    how many it has."""

    title: str
    plan: Any
    moves: int


class Programmes(Protocol):
    """The programmes of a machine."""

    def names(self) -> tuple[str, ...]:
        """Those that it brings along."""

    def named(self, name: str, soft: SoftLimits) -> Planned:
        """One of them. Raises InputError where it does not fit into the soft limits."""

    def read(self, path: Path, soft: SoftLimits) -> Planned:
        """The one in a file. Raises InputError."""


def called(error: InputError, path: Path, name: str) -> InputError:
    """What is wrong in a file, which is called `name` where a person knows no path of it."""
    return InputError(error.where.replace(str(path), name), error.value, error.accepted)


class TwoStage(NamedTuple):
    """`Programmes` of the two-stage machine. `pitch`: way per count of its carriage, m; `rates`:
    whether its law looks at speed and acceleration of the set point."""

    pitch: float
    rates: bool = False

    def names(self) -> tuple[str, ...]:
        """Those of the package."""
        return tuple(programme.shipped())

    def named(self, name: str, soft: SoftLimits) -> Planned:
        """One of them. Raises InputError where it does not fit into the soft limits."""
        path = programme.shipped()[name]
        try:
            return self.read(path, soft)
        except InputError as error:
            raise called(error, path, path.name) from None

    def read(self, path: Path, soft: SoftLimits) -> Planned:
        """The programme in a file. Raises InputError, for a stage's profiles before its moves, too:
        they begin at 0, this machine wherever it stands."""
        from macromicro.simulate import plan

        micro = 0.0, soft.micro_high  # at 0 the micro-stage is let go
        limits = Limits(soft.macro_low, soft.macro_high, *micro, 1.0 / self.pitch)
        found = programme.load(path, limits)
        if found.from_rest():
            accepted = (
                "a programme whose [[profiles]] stand behind [[moves]] of their stage, which say "
                "where they begin, or CSV; `macromicro run` runs others"
            )
            raise InputError(str(path), "motion profiles that begin at 0", accepted)
        made = plan(found)
        if not self.rates:  # messages to the loop are short
            made = made._replace(velocity=np.empty(0), acceleration=np.empty(0))
        return Planned(found.title, made, len(found.target))
