"""Facts about the calibrations of a machine, for its clients."""

from __future__ import annotations

from typing import Any

from macromicro.machines.tree import is_corrected
from macromicro.serve.choosing import AnySettings


def calibrations(settings: AnySettings) -> list[dict[str, Any]]:
    """Of each calibrated stage its name, when it was measured, and the temperatures [degC]."""
    corrections = ((name, own.correction) for name, own in settings.trees if is_corrected(own))
    return [
        {
            "stage": name,
            "made": p.made,
            "temperature": p.temperature,
            "cold": p.cold,
            "hot": p.hot,
        }
        for name, p in corrections
    ]
