"""Dead-zone inverse (Section 4.2.3, Figure 4.9): lifts an effort over the friction."""

from __future__ import annotations

from macromicro.kernel import kernel


@kernel
def inverse(width: float, effort: float) -> float:
    """Effort [V] lifted by `width` [V] in its own direction; zero stays zero."""
    if effort > 0.0:
        return effort + width
    if effort < 0.0:
        return effort - width
    return 0.0
