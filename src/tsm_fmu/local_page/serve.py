"""The server started on a port of this machine."""

from __future__ import annotations

import socket
from collections.abc import Callable
from pathlib import Path

import uvicorn

from ..models.contract import InputError
from .server import web_app
from .session import Session


def serve(folder: Path, port: int, ready: Callable[[str], None]) -> None:
    """Serve the page until Ctrl-C.

    Parameters
    ----------
    folder : Path
        For logs and results.
    port : int
        On 127.0.0.1; 0 takes a free one.
    ready : callable
        Told the address once it is open.

    Raises
    ------
    InputError
        The port is taken.
    """
    session = Session(folder)
    listening = socket.socket()
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind(("127.0.0.1", port))
    except OSError as failure:
        listening.close()
        reason = failure.strerror or str(failure)
        raise InputError(f"--port {port}: {reason} -- expected a free port -- choose another, or 0") from None
    listening.listen()  # from here on a browser that comes early waits
    ready(f"http://127.0.0.1:{listening.getsockname()[1]}/")
    try:
        uvicorn.Server(uvicorn.Config(web_app(session), log_level="error")).run(sockets=[listening])
    finally:
        session.close()
