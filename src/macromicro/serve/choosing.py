"""Settings of any machine for the server."""

from __future__ import annotations

from pathlib import Path

from macromicro.machines import compositions
from macromicro.serve import settings
from macromicro.serve.settings import LiveSettings
from macromicro.serve.stage import settings as stage
from macromicro.serve.stage.settings import StageSettings

AnySettings = LiveSettings | StageSettings


def load(path: Path | None, law: str | None = None) -> AnySettings:
    """The settings of the machine that the file names; without a file the two-stage machine's."""
    if path is None or compositions.is_two_stage(path):
        return settings.load(path, law)
    return stage.load(path, law)
