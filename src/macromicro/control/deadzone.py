"""Dead-zone inverse (Section 4.2.3, Figure 4.9): compensates friction."""

from __future__ import annotations

import math
from typing import Annotated

from macromicro.columns import Meaning
from macromicro.kernel import kernel


@kernel
def inverse(
    width: Annotated[float, Meaning("width of the dead zone", "V")],
    effort: Annotated[float, Meaning("effort", "V")],
) -> Annotated[float, Meaning("", "V")]:
    """An effort lifted over the dead zone in its own direction; zero stays zero."""
    # One expression without a branch: many variants side by side stay in vector registers.
    return effort + math.copysign(width, effort) if abs(effort) > 0.0 else 0.0
