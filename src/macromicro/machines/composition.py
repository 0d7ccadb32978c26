"""What a machine is to all who do not know it: its stages, its types, and how a file makes it.

`compositions` lists them. Which of the three ways of running one it takes is its family: one stage
under a law, several in step, or stages that take turns.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

ONE, STEP, TURNS = "one", "step", "turns"  # one stage; several on one clock; one after the other
FAMILIES = (ONE, STEP, TURNS)


class Composition(NamedTuple):
    """A machine.

    Attributes
    ----------
    name : str
        As a settings file names it.
    title : str
        For people.
    family : str
        Of `FAMILIES`.
    stages : tuple[str, ...]
        As programmes name them.
    settings : Any
        The default ones.
    sample, outputs, truth : type
        Annotated NamedTuples: what it measures, what it is driven by, what only a simulation knows.
    told : tuple[type, ...]
        What law and guard tell beside them.
    load : Callable[[Path, str | None], Any]
        From a settings file and the law of ``--law`` to its settings.
    as_toml : Callable[[Any, str | None], str]
        From settings, and one set or parameter of them, to TOML.
    """

    name: str
    title: str
    family: str
    stages: tuple[str, ...]
    settings: Any
    sample: Any
    outputs: Any
    truth: Any
    told: tuple[Any, ...]
    load: Callable[..., Any]
    as_toml: Callable[..., str]
