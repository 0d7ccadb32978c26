"""Everything a user may set, in one tree: bench, sensors, controller, guard, travel."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple, Protocol, Self, TypeVar

from macromicro import derived, rules
from macromicro.control.settings import Control
from macromicro.plant.bench import Bench, Sensors
from macromicro.programme.travel import Travel
from macromicro.rig.limits import Limits
from macromicro.schema import access, config
from macromicro.schema.par import Given

Tree = TypeVar("Tree", bound="Controlled")


class Controlled(Protocol):
    """Settings with a controller."""

    @property
    def controller(self) -> Control: ...

    def _replace(self, *, controller: Control) -> Self: ...


def choose(tree: Tree, path: Path | None, law: str | None) -> Tree:
    """Settings by the options ``--config`` and ``--law``."""

    def under(before: Tree) -> Tree:
        if law is None:
            return before
        return before._replace(controller=before.controller.joined(law, "--law"))

    return under(tree if path is None else config.load_overrides(path, under(tree)))


class Settings(NamedTuple):
    """The tree behind ``--config`` and ``macromicro config show``.

    ``settings["bench.friction.coulomb"]`` is the value at a path, in the stored unit (SI, encoder
    counts, degC); ``settings.with_("bench.friction.coulomb", "11 N")`` a changed copy.

    Examples
    --------
    >>> from macromicro import Settings
    >>> settings = Settings().with_("bench.friction.coulomb", "11 N")
    >>> settings["bench.friction.coulomb"]
    11.0
    """

    bench: Bench = Bench()
    sensors: Sensors = Sensors()
    controller: Control = Control()
    guard: Limits = Limits()
    travel: Travel = Travel()
    given: Given = Given()

    def machine(self) -> str:
        """Name of the machine that these are settings of.

        Returns
        -------
        str
            As a settings file names it.
        """
        return "two_stage"

    def derived(self) -> tuple[derived.Derivation, ...]:
        """Settings derived from others unless set.

        Returns
        -------
        tuple[derived.Derivation, ...]
            Pairs of a path and the rule that computes its value from the tree.
        """
        return derived.DERIVED + derived.of_law(self)

    def grown(self, table: Mapping[str, object], where: str) -> Self:
        """These settings with the gains of a law of another package, where a table names one.

        Parameters
        ----------
        table : Mapping[str, object]
            As a settings file has it.
        where : str
            The file, for messages.

        Returns
        -------
        Self
            A changed copy.

        Raises
        ------
        InputError
            There is no such law.
        """
        return self._replace(controller=self.controller.grown(table, where))

    def together(self) -> list[rules.Problem]:
        """Conflicts between settings.

        Returns
        -------
        list[rules.Problem]
            Path, value and what is accepted, of each conflict.
        """
        return rules.machine(self)

    def with_(self, changes: str | Mapping[str, object], value: object = None) -> Self:
        """These settings with other values, and derived ones recomputed.

        As in a settings file: a quantity is text with its unit, and all is checked.

        Parameters
        ----------
        changes : str | Mapping[str, object]
            Path of a parameter; or several paths with their values, where settings hold together
            only if they change at once.
        value : object, optional
            Of the one path: "11 N", or a plain value where the parameter has no unit.

        Returns
        -------
        Self
            A changed copy.

        Raises
        ------
        InputError
            An unknown path (with the nearest), a value that is not accepted, or settings that
            cannot work together; names path, value and what is accepted.
        """
        return access.change(self, changes, value)

    def __getitem__(self, key: Any) -> Any:
        """The value or the set at a dotted path; InputError names the nearest. Or, as of any
        tuple, the set at a place.
        """
        return access.at(self, key) if isinstance(key, str) else tuple.__getitem__(self, key)

    def __repr__(self) -> str:
        """What differs from the defaults, with units."""
        return f"<Settings: {access.describe_changes(self, Settings())}>"
