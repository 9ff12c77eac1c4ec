"""Who may ask the application for anything: the person's own browser, from the application's own pages.

The server listens on loopback, where other programs and web pages of this computer can reach it too. So every request
needs the cookie that the first address was exchanged for, and names the application as its host; every change comes
from one of its own pages. A page of somebody else, or one whose name was bound to 127.0.0.1 later (DNS rebinding),
has neither. The policy for content keeps a page from loading or running anything else.
"""

import hmac
import secrets
from typing import Final
from urllib.parse import parse_qs

from starlette.datastructures import MutableHeaders
from starlette.requests import HTTPConnection
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

LARGEST_FORM: Final = 64 * 2**10  # bytes
LARGEST_UPLOAD: Final = 256 * 2**20
UPLOADS: Final = "/files"  # the end of paths that take a file
ENTRANCE: Final = "/enter"
_UNCHANGING: Final = ("GET", "HEAD")

POLICY: Final = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
    "frame-src 'self'; form-action 'self'; base-uri 'none'; frame-ancestors 'none'"
)
# Of a report page, which has scripts and styles of its own: it runs as a page of nobody, and reaches nothing.
REPORT_POLICY: Final = (
    "sandbox allow-scripts allow-modals; default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
    "img-src data: blob:; form-action 'none'; base-uri 'none'; frame-ancestors 'self'"
)
_HEADERS: Final = {
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "same-origin",  # with no-referrer a form states no origin
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}


class Guard:
    """Lets only the person's own requests through to the application."""

    def __init__(self, app: ASGIApp, port: int, token: str) -> None:
        self._app, self._token = app, token
        self._session = secrets.token_urlsafe(32)
        self._cookie = f"stepdiag-{port}"  # a browser does not tell ports apart
        self._hosts = {f"127.0.0.1:{port}", f"localhost:{port}"}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        connection = HTTPConnection(scope)
        refusal = self._refusal(connection)
        if scope["type"] == "websocket" and refusal is not None:
            await send({"type": "websocket.close", "code": 1008})
            return
        answering = _with_headers(send)
        if refusal is not None:
            await refusal(scope, receive, answering)
            return
        await self._app(scope, _limited(receive, _largest(connection)), answering)

    def _refusal(self, connection: HTTPConnection) -> Response | None:
        """What to answer instead of the application; None: the request is the person's own."""
        headers, method = connection.headers, connection.scope.get("method", "GET")
        if headers.getlist("host") != [headers.get("host", "")] or headers["host"] not in self._hosts:
            return PlainTextResponse("This address is not that of the application.", 421)
        if connection.scope["type"] == "websocket" or method not in _UNCHANGING:
            if not self._is_own(headers.get("origin")):
                return PlainTextResponse("A change comes from a page of the application only.", 403)
            if int(headers.get("content-length", "0") or 0) > _largest(connection):
                return PlainTextResponse("The file is too large.", 413)
        if method == "GET" and connection.scope["path"] == ENTRANCE:
            return self._enter(connection)
        if not hmac.compare_digest(connection.cookies.get(self._cookie, "").encode(), self._session.encode()):
            return PlainTextResponse("Open the address that `stepdiag app` printed.", 401)
        return None

    def _enter(self, connection: HTTPConnection) -> Response:
        given = parse_qs(connection.scope.get("query_string", b"").decode("latin-1")).get("token", [""])
        if not hmac.compare_digest(given[0].encode(), self._token.encode()):
            return PlainTextResponse("This is not the address that `stepdiag app` printed.", 401)
        answer = RedirectResponse("/", 303)
        answer.set_cookie(self._cookie, self._session, httponly=True, samesite="strict", path="/")
        return answer

    def _is_own(self, origin: str | None) -> bool:
        return origin is not None and origin.removeprefix("http://") in self._hosts and origin.startswith("http://")


class TooLarge(Exception):
    """A body has more bytes than it may have."""


def _largest(connection: HTTPConnection) -> int:
    return LARGEST_UPLOAD if connection.scope["path"].endswith(UPLOADS) else LARGEST_FORM


def _limited(receive: Receive, largest: int) -> Receive:
    """Counts the bytes of a body, which may have no length or a wrong one."""
    came = 0

    async def counted() -> Message:
        nonlocal came
        message = await receive()
        came += len(message.get("body", b""))
        if came > largest:
            raise TooLarge
        return message

    return counted


def _with_headers(send: Send) -> Send:
    async def answering(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in _HEADERS.items():
                headers.setdefault(name, value)
        await send(message)

    return answering
