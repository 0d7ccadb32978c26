"""The settings of whichever machine a file is for, as the server takes them."""

from __future__ import annotations

from pathlib import Path

from macromicro.errors import InputError
from macromicro.serve import settings
from macromicro.serve.joint import settings as joint
from macromicro.serve.joint.settings import JointSettings
from macromicro.serve.settings import LiveSettings
from macromicro.serve.stage import settings as stage
from macromicro.serve.stage.settings import StageSettings

AnySettings = LiveSettings | StageSettings | JointSettings


def load(path: Path | None, law: str | None = None) -> AnySettings:
    """The settings in a file, of the machine that it names; without one the two-stage machine's.

    Raises InputError as `serve.settings.load` and `serve.stage.settings.load` do, and for another
    law than its own of a machine of one stage.
    """
    found: StageSettings | JointSettings | None = None
    if path is not None:
        found = joint.load(path) or stage.load(path)
    if found is None:
        return settings.load(path, law)
    if law is not None:
        accepted = f"no such option: the machine {found.model.partition(' ')[0]} has its own law"
        raise InputError("--law", law, accepted)
    return found
