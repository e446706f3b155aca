"""Requests to stop that wait for the end of a call."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

STOP_SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


class StopRequest:
    """Whether the user wants to stop; true or false.

    Attributes
    ----------
    flag : ndarray of int32, shape (1,)
        The same for compiled code.
    """

    def __init__(self) -> None:
        self.flag = np.zeros(1, np.int32)

    def __bool__(self) -> bool:
        return bool(self.flag[0])


_current: list[StopRequest] = []


def stop_asked() -> bool:
    """Whether the user wants to stop the run that is going on."""
    return any(_current)


@contextmanager
def interruptible() -> Iterator[StopRequest]:
    """Hold Ctrl-C and other requests to stop back to the end of a call.

    Inside one they would hit an FMU's Python, or be dropped by compiled code that cannot raise.

    Raises
    ------
    KeyboardInterrupt
        At the end, where nobody has acted on a request.
    """
    request = StopRequest()
    if threading.current_thread() is not threading.main_thread():
        yield request
        return

    def ask(*_: object) -> None:
        request.flag[0] = 1

    previous = {s: signal.getsignal(s) for s in STOP_SIGNALS if signal.getsignal(s) is not signal.SIG_IGN}
    for number in previous:
        signal.signal(number, ask)
    _current.append(request)
    try:
        yield request
    finally:
        _current.remove(request)
        for number, handler in previous.items():
            signal.signal(number, handler)
    if request:
        raise KeyboardInterrupt
