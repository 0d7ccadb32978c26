"""The web page: one page, one WebSocket."""

from __future__ import annotations

from macromicro.serve.web.server import WebServer

__all__ = ["WebServer"]
