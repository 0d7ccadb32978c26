"""The thesis' machine as a composition: a carriage and a micro-stage that take turns."""

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
    return chosen(Settings(), path, law)


def by_default(law: str) -> Settings:
    return chosen(Settings(), None, law)


def as_toml(settings: Any, only: str | None = None) -> str:
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
