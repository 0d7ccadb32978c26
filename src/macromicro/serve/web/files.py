"""The page's files, which travel with the package."""

from __future__ import annotations

from http import HTTPStatus
from pathlib import Path

from websockets.http11 import Request, Response

from macromicro.serve.web.gate import Gate, answer, refused

FOLDER = Path(__file__).parent / "static"
SOCKET = "/live"
_NO_NAME = (
    "this server does not answer to that name: open the page by its address, or start the server\n"
    "with it: macromicro serve --name NAME\n"
)
_KINDS = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
}


class Files:
    """Answers requests by plain HTTP from memory; only listed files can be had."""

    def __init__(self, gate: Gate) -> None:
        self._gate = gate
        self._files = {
            f"/{path.name}": (_KINDS[path.suffix], path.read_bytes())
            for path in sorted(FOLDER.iterdir())
            if path.suffix in _KINDS
        }
        self._files["/"] = self._files["/index.html"]

    def respond(self, request: Request) -> Response | None:
        """The answer; None where a WebSocket may be opened."""
        host = self._gate.host(request)
        if host is None:
            return refused(HTTPStatus.MISDIRECTED_REQUEST, _NO_NAME)
        if request.method != "GET":
            return refused(HTTPStatus.METHOD_NOT_ALLOWED, "only GET\n")
        path = request.path.partition("?")[0]
        if path == SOCKET:
            if self._gate.same_origin(request):
                return None
            return refused(HTTPStatus.FORBIDDEN, "only this server's own page may do that\n")
        found = self._files.get(path)
        if found is None:
            return refused(HTTPStatus.NOT_FOUND, "no such page\n")
        return answer(HTTPStatus.OK, host, *found)
