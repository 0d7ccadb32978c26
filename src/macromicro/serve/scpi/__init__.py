"""The positioner as an SCPI instrument on a TCP socket (IEEE 488.2, SCPI-99)."""

from __future__ import annotations

from macromicro.serve.door._connection import Bounds
from macromicro.serve.scpi.server import Server

__all__ = ["Bounds", "Server"]
