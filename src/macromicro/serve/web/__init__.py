"""The positioner in a browser: one page, one WebSocket, nothing from elsewhere."""

from __future__ import annotations

from macromicro.serve.web.server import WebServer

__all__ = ["WebServer"]
