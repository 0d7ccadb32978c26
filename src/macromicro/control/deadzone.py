"""Dead-zone inverse (Section 4.2.3, Figure 4.9): lifts an effort over the friction."""

from __future__ import annotations

import math

from macromicro.kernel import kernel


@kernel
def inverse(width: float, effort: float) -> float:
    """Effort [V] lifted by `width` [V] in its own direction; zero stays zero."""
    # One expression without a branch: many variants side by side stay in vector registers.
    return effort + math.copysign(width, effort) if abs(effort) > 0.0 else 0.0
