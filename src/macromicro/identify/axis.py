"""The axis of `macromicro.models.mass`, by the name that users of identification know."""

from macromicro.models.mass import Axis, simulate

__all__ = ["Axis", "simulate"]
