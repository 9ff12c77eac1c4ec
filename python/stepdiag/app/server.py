"""The server of the application. It listens on loopback only."""

import secrets
import socket
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import uvicorn

from stepdiag._core import InvalidArgument
from stepdiag.app.routes import application
from stepdiag.app.security import ENTRANCE


def serve(book: Path, port: int, opened: Callable[[str], None]) -> None:
    """Serve a book on 127.0.0.1 until the process is interrupted. port: 0 for any free one.

    `opened` is called with the first address, which has the token, once the server answers. Raises InvalidArgument."""
    with tempfile.TemporaryDirectory(prefix="stepdiag-app-") as temporary, _listening(port) as listener:
        port, token = listener.getsockname()[1], secrets.token_urlsafe(24)
        app = application(book, Path(temporary), port, token)
        config = uvicorn.Config(
            app,
            log_level="error",
            access_log=False,
            server_header=False,
            ws="none",
            proxy_headers=False,
            timeout_graceful_shutdown=1,
        )
        server = _Announcing(config, partial(opened, f"http://127.0.0.1:{port}{ENTRANCE}?token={token}"))
        server.run(sockets=[listener])


class _Announcing(uvicorn.Server):
    """Says when it answers."""

    def __init__(self, config: uvicorn.Config, begun: Callable[[], None]) -> None:
        super().__init__(config)
        self._begun = begun

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        self._begun()


def _listening(port: int) -> socket.socket:
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(("127.0.0.1", port))
    except OSError as error:
        listener.close()
        raise InvalidArgument(f"`port` {port}: cannot listen: {error.strerror}") from None
    return listener
