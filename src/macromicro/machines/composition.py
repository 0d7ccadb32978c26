"""The description of a machine: its stages, its types and how a file makes it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

ONE, STEP, TURNS = "one", "step", "turns"  # one stage; several on one clock; one after the other
FAMILIES = (ONE, STEP, TURNS)


class Composition(NamedTuple):
    name: str  # as a settings file names it
    title: str
    family: str  # of `FAMILIES`
    stages: tuple[str, ...]  # as programmes name them
    settings: Any
    # sample, outputs, truth: annotated NamedTuples: what it measures, what it is driven by, what
    # only a simulation knows
    sample: Any
    outputs: Any
    truth: Any
    told: tuple[Any, ...]  # what law and guard tell beside them
    load: Callable[..., Any]  # from a settings file and the law of ``--law`` to its settings
    as_toml: Callable[..., str]  # from settings, and one set or parameter of them, to TOML
