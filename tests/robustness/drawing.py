"""Machines that differ from a nominal one, under its law."""

from collections.abc import Sequence
from typing import Any

from macromicro.arrays import Array
from macromicro.machines.composite import AnyMachine
from macromicro.uncertainty.machines import draw, settings_at
from macromicro.uncertainty.stages import keep_settings
from macromicro.uncertainty.table import Uncertain


def drawn(
    machine: AnyMachine, settings: Any, rows: Sequence[Uncertain], n: int, seed: int
) -> tuple[Array, list[Any]]:
    """What was drawn, and the settings."""
    amounts = draw(settings, rows, n, seed).amounts
    trees = [settings_at(settings, rows, each) for each in amounts]
    return amounts, [keep_settings(machine, settings, tree) for tree in trees]
