"""Settings of any machine for the server."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from macromicro.machines import compositions
from macromicro.machines.composition import ONE, STEP, TURNS
from macromicro.serve import settings
from macromicro.serve.joint import settings as joint
from macromicro.serve.joint.settings import JointSettings
from macromicro.serve.settings import LiveSettings
from macromicro.serve.stage import settings as stage
from macromicro.serve.stage.settings import StageSettings

AnySettings = LiveSettings | StageSettings | JointSettings
_BY_FAMILY: dict[str, Callable[[Any, str | None], AnySettings]] = {
    TURNS: settings.load,
    STEP: joint.load,
    ONE: stage.load,
}


def load(path: Path | None, law: str | None = None) -> AnySettings:
    """The settings of the machine that the file names; without a file the two-stage machine's."""
    whole = compositions.chosen(path)
    return _BY_FAMILY[whole.family](path, law)
