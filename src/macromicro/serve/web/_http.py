"""The page's files over HTTP, and the check of host name and origin (DNS rebinding)."""

from __future__ import annotations

import re
from collections.abc import Iterable
from http import HTTPStatus
from pathlib import Path

from websockets.datastructures import Headers, MultipleValuesError
from websockets.http11 import Request, Response

from macromicro import drawing
from macromicro.serve.hosts import is_address

_HOST = re.compile(r"(?:\[([0-9a-f:.]{2,45})\]|([a-z0-9.-]{1,253}))(?::[0-9]{1,5})?")
_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; "
    "connect-src 'self' ws://{0} wss://{0}; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'; require-trusted-types-for 'script'"
)

FOLDER = Path(__file__).parent / "static"
UPLOT = Path(drawing.__file__).parent / "uplot"  # which draws the curves
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


class Gate:
    """Checks hosts; `names` are accepted beside "localhost" and addresses."""

    def __init__(self, names: Iterable[str] = ()) -> None:
        self._names = {"localhost"}
        for name in names:
            self.answer_to(name)

    def answer_to(self, name: str) -> None:
        """Accept one more host name."""
        self._names.add(name.strip().rstrip(".").lower())

    def host(self, request: Request) -> str | None:
        """The request's Host, lower case, if it is accepted."""
        host = _one(request.headers, "Host").lower()
        match = _HOST.fullmatch(host)
        if match is None:
            return None
        name = match[1] or match[2]
        return host if name in self._names or is_address(name) else None

    def same_origin(self, request: Request) -> bool:
        host = self.host(request)
        origin = _one(request.headers, "Origin").lower()
        return host is not None and origin in (f"http://{host}", f"https://{host}")


def answer(status: HTTPStatus, host: str, kind: str, body: bytes) -> Response:
    """A response with strict security headers."""
    headers = Headers(
        {
            "Content-Type": kind,
            "Content-Length": str(len(body)),
            "Connection": "close",
            "Cache-Control": "no-cache",
            "Content-Security-Policy": _POLICY.format(host),
            "X-Content-Type-Options": "nosniff",
            "X-Frame-Options": "DENY",
            "Referrer-Policy": "no-referrer",
            "Cross-Origin-Resource-Policy": "same-origin",
            "Cross-Origin-Opener-Policy": "same-origin",
        }
    )
    return Response(status.value, status.phrase, headers, body)


def refusal(status: HTTPStatus, text: str) -> Response:
    return answer(status, "localhost", "text/plain; charset=utf-8", text.encode())


def _one(headers: Headers, name: str) -> str:
    try:
        return str(headers.get(name, ""))
    except MultipleValuesError:
        return ""


class Files:
    """Serves the listed files from memory."""

    def __init__(self, gate: Gate) -> None:
        self._gate = gate
        self._files = {
            f"/{path.name}": (_KINDS[path.suffix], path.read_bytes())
            for path in sorted([*FOLDER.iterdir(), *UPLOT.iterdir()])
            if path.suffix in _KINDS
        }
        self._files["/"] = self._files["/index.html"]

    def respond(self, request: Request) -> Response | None:
        """The response; None for a WebSocket."""
        host = self._gate.host(request)
        if host is None:
            return refusal(HTTPStatus.MISDIRECTED_REQUEST, _NO_NAME)
        if request.method != "GET":
            return refusal(HTTPStatus.METHOD_NOT_ALLOWED, "only GET\n")
        path = request.path.partition("?")[0]
        if path == SOCKET:
            if self._gate.same_origin(request):
                return None
            return refusal(HTTPStatus.FORBIDDEN, "only this server's own page may do that\n")
        found = self._files.get(path)
        if found is None:
            return refusal(HTTPStatus.NOT_FOUND, "no such page\n")
        return answer(HTTPStatus.OK, host, *found)
