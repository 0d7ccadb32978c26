"""Parameters that the laws have learned in a run, as settings for the next."""

from __future__ import annotations

from typing import Any

from macromicro.control import micro, outside
from macromicro.recording import Recording
from macromicro.schema.config import changed_toml
from macromicro.settings import Settings

_STAGES = (("own", outside.PREFIX), ("fine", micro.PREFIX))  # gains, and prefix of their columns


def with_learned(recording: Recording, settings: Settings) -> Settings:
    """The settings of a run with the parameters that its laws have learned."""
    new: dict[str, Any] = {}
    for field, prefix in _STAGES:
        gains = getattr(settings.controller, field)
        if not outside.of(gains) or (kept := outside.law_of_gains(gains).kept) is None:
            continue
        names = [c.name for c in recording.columns if c.name.startswith(prefix)]
        new[field] = kept(gains, {n.removeprefix(prefix): recording[n] for n in names})
    return settings._replace(controller=settings.controller._replace(**new))


def text(recording: Recording, settings: Settings) -> str | None:
    """A settings file for `--config`: the run's settings and the learned parameters."""
    found = with_learned(recording, settings)
    if found == settings:
        return None
    head = "# Learned by the laws of a run: start the next one with --config and this file.\n"
    return head + changed_toml(found, Settings())
