"""Preisach hysteresis (Section 2.4.1): an Everett table and a stack of reversals.

Relays are weighted by their thresholds; the output is the fraction of the weight that is
up, 0 to 1. `everett` holds the weights, `memory` the past, `relays` the slow reference.
"""

from macromicro.hysteresis.everett import Everett, from_density, lookup
from macromicro.hysteresis.memory import Memory, advance, fresh, peek, slope

__all__ = ["Everett", "Memory", "advance", "fresh", "from_density", "lookup", "peek", "slope"]
