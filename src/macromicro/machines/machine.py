"""The machines: shipped ones in `MACHINES`, and those of other packages as "module:machine"."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from macromicro.arrays import Array
from macromicro.control.live.leading import Touch
from macromicro.control.outside import find
from macromicro.control.stage_law import StageLaw
from macromicro.errors import InputError
from macromicro.machines import axis, equipped, homing, piezo, rotary, sheets, wire
from macromicro.machines.stage import Kind
from macromicro.machines.tree import LAW, is_corrected, is_own, with_law
from macromicro.schema import config, plugins
from macromicro.schema.text import printable, read_toml

TWO_STAGE = "two_stage"  # a carriage and a stage on it (`machines.two_stage`)
JOINT = "xy"  # two axes (`machines.joint`); all of them: `machines.compositions`
KEY = config.MACHINE
GROUP = "macromicro.machines"
FORM = "MODULE:MACHINE, a machine of your own (docs/own-machines.md)"
_TABLES = Path(__file__).parents[1] / "uncertainty"


class Machine(NamedTuple):
    """A machine of one stage.

    Examples
    --------
    >>> from macromicro.machines import axis
    >>> from macromicro.machines.machine import Machine
    >>> Machine("mine", "an axis of mine", axis.DEFAULT, axis.KIND, axis.LAW).law.name
    'cascade'
    """

    name: str  #: as a settings file names it
    title: str  #: for people
    #: its default settings: a tree with `derived`, `together` and `machine`, and the sets encoder
    #: (with pitch), timing (with period), travel, motion, arrival, controller and guard
    settings: Any
    kind: Kind  #: the kernels of its stage
    law: StageLaw  #: whose gains are the set `controller`
    #: from settings and frequencies (Hz) to the linear plant there, complex, m/V; None: there is
    #: none, and no `response`
    model: Callable[[Any, Array], Any] | None = None
    #: from settings to how the stage finds its place live; None: its encoder is absolute
    touch: Callable[[Any], Touch | None] | None = None
    #: the table of what is not known exactly about such a machine (`uncertainty.table`); None:
    #: there is none, and no `robust`
    spread: Path | None = None
    #: from settings to the kernels of a stage with the lines that they name (`types.Lines`); None:
    #: it has none
    equip: Callable[[Any], Kind] | None = None

    @property
    def stages(self) -> tuple[tuple[str, Machine], ...]:
        """Its only stage, which needs no name."""
        return (("", self),)

    @property
    def written(self) -> str:
        """How a settings file names it, as TOML."""
        return f'"{self.name}"'

    def trees(self, settings: Any) -> tuple[Any, ...]:
        """The settings of each stage.

        Parameters
        ----------
        settings : Any
            Of the machine.

        Returns
        -------
        tuple[Any, ...]
            Of its only stage.

        Examples
        --------
        >>> from macromicro.machines.machine import named
        >>> axis = named("axis", "machine")
        >>> axis.trees(axis.settings) == (axis.settings,)
        True
        """
        return (settings,)


def _shipped(
    part: Any,
    model: Callable[[Any, Array], Any] | None = None,
    touch: Callable[[Any], Touch | None] | None = None,
    equip: Callable[[Any], Kind] | None = None,
) -> Machine:
    table = _TABLES / f"{part.NAME}.toml"
    made = Machine(part.NAME, part.TITLE, part.DEFAULT, part.KIND, part.LAW, model, touch, table)
    return made._replace(equip=equip)


MACHINES: tuple[Machine, ...] = (
    _shipped(axis, sheets.plant, homing.touch, equipped.kind),
    _shipped(piezo),
    _shipped(wire),
    _shipped(rotary, sheets.plant, homing.touch, rotary.kind),
)
NAMES = (TWO_STAGE, JOINT, *(m.name for m in MACHINES))
_ONE = (
    "a single-stage machine; `macromicro config show --config FILE --axis x` prints the file of "
    "one axis"
)

_found: dict[str, Machine] = {}  # of other packages


def named(name: object, where: str) -> Machine:
    """The machine of one stage of a name.

    Parameters
    ----------
    name : object
        As written: one of `NAMES`, "module:object", or the name of an installed entry point of the
        group `GROUP`.
    where : str
        File and key, or option, for the message.

    Returns
    -------
    Machine
        The machine.

    Raises
    ------
    InputError
        There is none, with the nearest and all; or it has several stages or axes.

    Examples
    --------
    >>> from macromicro.machines.machine import named
    >>> named("axis", "machine").title
    'one motor-driven axis'
    """
    if name == TWO_STAGE:
        others = ", ".join(repr(m.name) for m in MACHINES)
        raise InputError(where, TWO_STAGE, f"one of {others} here")
    if name == JOINT or isinstance(name, dict):
        raise InputError(where, JOINT if name == JOINT else "several stages", _ONE)
    for machine in MACHINES:
        if machine.name == name:
            return machine
    key = str(name)
    if key not in _found:
        group = plugins.Group(GROUP, "a machine", Machine, FORM, NAMES)
        _found[key] = group.find(name, where)._replace(name=key)
    return _found[key]


def chosen(path: Path) -> Machine:
    """The machine of one stage that a settings file names.

    Parameters
    ----------
    path : Path
        The file; only its key `machine` is looked at.

    Returns
    -------
    Machine
        The machine.

    Raises
    ------
    InputError
        The file cannot be read, names no such machine, or none: it is the two-stage machine's.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from macromicro.machines.machine import chosen
    >>> with TemporaryDirectory() as folder:
    ...     _ = Path(folder, "mine.toml").write_text('machine = "piezo"')
    ...     machine = chosen(Path(folder, "mine.toml"))
    >>> machine.name
    'piezo'
    """
    name = read_toml(path, config.WHAT).get(KEY, TWO_STAGE)
    return named(name, f"{printable(path, 300)}, {KEY}")


def load(path: Path, law: str | None = None) -> tuple[Machine, Any]:
    """A machine and its settings.

    Parameters
    ----------
    path : Path
        A settings file that names a machine of one stage.
    law : str | None, optional
        Instead of the law that the file names.

    Returns
    -------
    machine : Machine
        Whose settings and rules are used.
    settings : Any
        Its settings with the file's values, and what follows from them.

    Raises
    ------
    InputError
        As `chosen` and `config.load_overrides`; the file is for the two-stage machine; there is no
        such law.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from macromicro.machines.machine import as_toml, load, named
    >>> axis = named("axis", "machine")
    >>> with TemporaryDirectory() as folder:
    ...     _ = Path(folder, "mine.toml").write_text(as_toml(axis, axis.settings))
    ...     machine, settings = load(Path(folder, "mine.toml"))
    >>> machine.name, settings.load.mass  # kg
    ('axis', 0.5)
    """
    machine = chosen(path)
    tree = machine.settings if law is None else with_law(machine.settings, law, "--law")
    settings = config.load_overrides(path, tree, machine.name)
    if law is not None:  # the option goes before the file's word
        settings = with_law(settings, law, "--law")
    return under(machine, settings), settings


def under(machine: Machine, settings: Any) -> Machine:
    """A machine under the law that settings choose, with the lines that they name.

    Parameters
    ----------
    machine : Machine
        Whose settings and rules are used.
    settings : Any
        Of it.

    Returns
    -------
    Machine
        With the law whose gains are ``tree.gains(settings)``.

    Examples
    --------
    >>> from macromicro.machines.machine import named, under
    >>> axis = named("axis", "machine")
    >>> under(axis, axis.settings).law.name
    'cascade'
    """
    if is_own(settings):
        machine = machine._replace(law=find(settings.law, LAW))
    kind = machine.kind if machine.equip is None else machine.equip(settings)
    return machine._replace(kind=kind._replace(corrected=is_corrected(settings)))


def as_toml(machine: Machine | Any, settings: Any, only: str | None = None) -> str:
    """All settings of a machine as TOML, headed by its name.

    Parameters
    ----------
    machine : Machine | Any
        Whose settings and rules are used.
    settings : Any
        Of it.
    only : str | None, optional
        One set or one parameter; None for all.

    Returns
    -------
    str
        TOML that `load` reads back.

    Raises
    ------
    InputError
        `only` is no path of the tree.

    Examples
    --------
    >>> from macromicro.machines.machine import as_toml, named
    >>> axis = named("axis", "machine")
    >>> print(as_toml(axis, axis.settings, "load.mass"), end="")
    [load]
    mass = "0.5 kg"  # moving mass without payload, at the load (data sheet or drawing)
    """
    body = config.as_toml(settings, only)
    named = only is None and machine.written
    return f"{KEY} = {machine.written}\n{body}" if named else body
