"""The thesis' machine as a composition: a carriage and a micro-stage on it, which take turns.

Its parts are those of `plant.bench`, its law is the supervisor with a law for each stage, its guard
is that of `rig`; here is what a settings file makes of them.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from macromicro.control.supervisor import Progress
from macromicro.machines.composition import TURNS, Composition
from macromicro.plant.bench import Truth
from macromicro.rig.guard import Watch
from macromicro.schema import config
from macromicro.settings import Settings, chosen
from macromicro.types import Command, Outputs, Sample

NAME = Settings().machine()
TITLE = "a friction-ridden carriage for the way, a shape-memory stage on it for the last 4 mm"


def load(path: Path, law: str | None = None) -> Settings:
    """Its settings from a file.

    Parameters
    ----------
    path : Path
        A settings file that names it, or no machine.
    law : str | None, optional
        Of the carriage, or of each stage with a comma, in place of the file's.

    Returns
    -------
    Settings
        With what follows from the file.

    Raises
    ------
    InputError
        As `settings.chosen`.
    """
    return chosen(Settings(), path, law)


def by_default(law: str) -> Settings:
    """Its default settings under another law.

    Parameters
    ----------
    law : str
        As for `load`.

    Returns
    -------
    Settings
        With the law's gains.

    Raises
    ------
    InputError
        There is no such law.
    """
    return chosen(Settings(), None, law)


def as_toml(settings: Any, only: str | None = None) -> str:
    """Its settings as TOML that `load` reads back.

    Parameters
    ----------
    settings : Any
        Of it.
    only : str | None, optional
        One set or one parameter; None for all.

    Returns
    -------
    str
        TOML.

    Raises
    ------
    InputError
        `only` is no path of the tree.
    """
    return config.as_toml(settings, only)


COMPOSITION = Composition(
    name=NAME,
    title=TITLE,
    family=TURNS,
    stages=("macro", "micro"),
    settings=Settings(),
    sample=Sample,
    outputs=Outputs,
    truth=Truth,
    told=(Command, Progress, Watch),
    load=load,
    as_toml=as_toml,
)
