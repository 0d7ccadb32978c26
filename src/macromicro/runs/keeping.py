"""What the laws of a run have learned, as settings that the next run begins with."""

from __future__ import annotations

from typing import Any

from macromicro.control import micro, outside
from macromicro.recording import Recording
from macromicro.schema.config import changed_toml
from macromicro.settings import Settings

_STAGES = (("own", outside.PREFIX), ("fine", micro.PREFIX))  # gains, and prefix of their columns


def taught(recording: Recording, settings: Settings) -> Settings:
    """The settings of a run with what its laws have learned.

    Parameters
    ----------
    recording : Recording
        Of the run.
    settings : Settings
        Under which it was made.

    Returns
    -------
    Settings
        The same where no law keeps anything.
    """
    new: dict[str, Any] = {}
    for field, prefix in _STAGES:
        gains = getattr(settings.controller, field)
        if not outside.of(gains) or (kept := outside.having(gains).kept) is None:
            continue
        names = [c.name for c in recording.columns if c.name.startswith(prefix)]
        new[field] = kept(gains, {n.removeprefix(prefix): recording[n] for n in names})
    return settings._replace(controller=settings.controller._replace(**new))


def text(recording: Recording, settings: Settings) -> str | None:
    """A settings file for `--config`: what the run was made with, and what was learned.

    Parameters
    ----------
    recording : Recording
        Of the run.
    settings : Settings
        Under which it was made.

    Returns
    -------
    str | None
        TOML; None where nothing was learned.
    """
    found = taught(recording, settings)
    if found == settings:
        return None
    head = (
        "# What the laws of a run have learned: begin the next one with --config and this file.\n"
    )
    return head + changed_toml(found, Settings())
