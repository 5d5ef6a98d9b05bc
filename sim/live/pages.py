"""The page's files, and who may have them: browsers of this machine, others only where that was asked for."""

from http import HTTPStatus
from ipaddress import ip_address
from pathlib import Path
from urllib.parse import urlsplit

from websockets.datastructures import Headers
from websockets.http11 import Request, Response

FEED = "/feed"
"""Where the page finds its WebSocket."""
PAGE = Path(__file__).parent / "page"
_TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}
_POLICY = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src 'self'"


def answer(request: Request, bound: str) -> Response | None:
    """The answer to a request; None lets the WebSocket open.

    Args:
        request: Of a browser.
        bound: The address that the page is served on.
    """
    host = request.headers.get("Host", "")
    # names of other places that lead here, and pages of other places, are no business of ours
    if is_loopback(bound) and not is_loopback(urlsplit(f"//{host}").hostname or ""):
        return _reply(HTTPStatus.FORBIDDEN, b"ask for localhost\n", "text/plain")
    path = urlsplit(request.path).path
    if path == FEED:
        origin = request.headers.get("Origin")
        if origin is None or urlsplit(origin).netloc == host:
            return None
        return _reply(HTTPStatus.FORBIDDEN, b"this feed is for its own page\n", "text/plain")
    files = {f"/{file.name}": file for file in PAGE.iterdir() if file.suffix in _TYPES}
    file = files.get("/index.html" if path == "/" else path)
    if file is None:
        return _reply(HTTPStatus.NOT_FOUND, b"there is no such page\n", "text/plain")
    return _reply(HTTPStatus.OK, file.read_bytes(), _TYPES[file.suffix])


def is_loopback(host: str) -> bool:
    """Whether a name or address is of this machine only."""
    if host == "localhost":
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False


def _reply(status: HTTPStatus, body: bytes, kind: str) -> Response:
    headers = Headers(
        {
            "Content-Type": f"{kind}; charset=utf-8",
            "Content-Length": str(len(body)),
            "Content-Security-Policy": _POLICY,
            "X-Content-Type-Options": "nosniff",
            "Cache-Control": "no-store",
            "Connection": "close",
        }
    )
    return Response(status.value, status.phrase, headers, body)
