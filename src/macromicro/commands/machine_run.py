"""Settings of any machine, printed; which machine a file is for."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from macromicro.errors import InputError, ProblemError


def show(name: str | None, key: str | None, law: str | None, config: Path | None = None) -> None:
    """Print a machine's default settings, or those of a file with the values derived from them."""
    from macromicro.machines import compositions

    if config is None:
        made = compositions.named(name or compositions.UNNAMED, "--machine")
        _print(made, compositions.by_default(made, law), key)
        return
    if name is not None:
        raise ProblemError("--machine", "not allowed with --config, whose file names the machine")
    made = compositions.chosen(config)
    _print(made, made.load(config, law), key)


def _print(made: Any, settings: Any, key: str | None) -> None:
    text = made.as_toml(settings, key)
    _warn(settings, key)
    print(text, end="")


def _warn(settings: Any, key: str | None = None) -> None:
    from macromicro.machines import doubts

    for each in doubts.found(settings):
        if key is None or f"{each.path}.".startswith(f"{key}."):
            print(f"# warning: {each.text}")


def show_axis(config: Path | None, axis: str) -> None:
    """Print one stage of a machine of several as settings of a machine of its own."""
    from macromicro.machines import composite, compositions
    from macromicro.machines.machine import JOINT, as_toml

    if config is None:
        machine, settings = (found := compositions.machine(JOINT, "machine")), found.settings
    else:
        machine, settings = compositions.load(config)
    names = composite.names(machine)
    if axis not in names or names == ("",):
        raise InputError("--axis", axis, " or ".join(names) or "a machine of several stages")
    k = names.index(axis)
    tree, one = machine.trees(settings)[k], machine.stages[k][1]
    _warn(tree)
    print(as_toml(one, tree), end="")
