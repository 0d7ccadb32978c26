"""``macromicro config show``: the settings of any machine."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import typer

from macromicro.commands.options import command
from macromicro.errors import InputError, ProblemError

app = typer.Typer(
    name="config", help="Settings of bench, sensors, controller and guard.", no_args_is_help=True
)


@command(app)
def show(
    key: str | None = None,
    machine: str | None = None,
    law: str | None = None,
    axis: str | None = None,
    config: Path | None = None,
) -> None:
    """Print settings as TOML with units, meaning and source.

    Without a file they are the defaults. With --law MODULE:LAW the gains of that law are included
    as `controller.own`. The tables of the live machine are printed by their names, `live` and
    `serve`.
    """
    if axis is not None:
        for name, value in (("KEY", key), ("--machine", machine), ("--law", law)):
            if value is not None:
                raise ProblemError(name, "not allowed with --axis, which prints a whole axis of xy")
        _show_axis(config, axis)
        return
    if key is not None and key.endswith(".toml"):
        from macromicro.schema.text import printable

        file = printable(key)
        raise ProblemError(file, "a file, not a key", f"Name it with --config {file}.")
    if machine is None and key is not None and key.partition(".")[0] in ("live", "serve"):
        from macromicro.serve.settings import load

        print(load(config, law).tables(key), end="")
        return
    _show(machine, key, law, config)


def _show(name: str | None, key: str | None, law: str | None, config: Path | None) -> None:
    """Print a machine's default settings, or those of a file with the values derived from them."""
    from macromicro.machines import compositions

    if config is None:
        machine = compositions.by_name(name or compositions.TWO_STAGE.name, "--machine")
        _print(machine, compositions.by_default(machine, law), key)
        return
    if name is not None:
        raise ProblemError("--machine", "not allowed with --config, whose file names the machine")
    _print(compositions.of_file(config), compositions.settings_of(config, law), key)


def _print(machine: Any, settings: Any, key: str | None) -> None:
    from macromicro.machines.machine import as_toml

    text = as_toml(machine, settings, key)
    _warn(settings, key)
    print(text, end="")


def _warn(settings: Any, key: str | None = None) -> None:
    from macromicro.machines import doubts

    for each in doubts.find_doubts(settings):
        if key is None or f"{each.path}.".startswith(f"{key}."):
            print(f"# warning: {each.text}")


def _show_axis(config: Path | None, axis: str) -> None:
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
