"""The other side of `RemoteSlave`: a process that calls one FMU and answers."""

from __future__ import annotations

import ctypes
import pickle
import signal
from collections import deque
from typing import Any

from fmpy.fmi1 import FMICallException

from .fmi_calls import WARNING, c_type
from .fmu_library import MOST_LINES, load
from .fmu_messages import ANSWER, KINDS, RAISED, REACHED, STEP, STEPS_FOLLOW, VALUES


class _Served:
    """The FMU in its process, and the answers to requests."""

    def __init__(self) -> None:
        self._slave: Any = None
        self._fmi = 2
        self._lines: deque[str] = deque(maxlen=MOST_LINES)
        self._states: dict[int, Any] = {}
        self._asked: list[bytes] = []
        self._flags = (ctypes.c_bool * 3)()
        self._reached = ctypes.c_double()

    def answer(self, request: bytes) -> bytes:
        if request[:1] == b"C":
            status, payload = self._called(*pickle.loads(request[1:]))
        elif request[:1] == b"D":
            status, payload = self._stepped(*STEP.unpack(request)[1:])
        else:
            status, payload = self._values(request)
            if request[:1] == b"G" and request not in self._asked:
                self._asked.append(request)
        log = b""
        if self._lines:
            log = pickle.dumps(list(self._lines))
            self._lines.clear()
        return ANSWER.pack(status, len(log)) + log + payload

    def _values(self, request: bytes) -> tuple[int, bytes]:
        verb, kind, number, count = VALUES.unpack_from(request)
        at = VALUES.size + 4 * number
        references = (ctypes.c_uint32 * number).from_buffer_copy(request, VALUES.size)
        own = c_type(KINDS[kind], self._fmi == 3)
        texts = own is ctypes.c_char_p
        values = (own * count)()
        if verb == b"S":
            if texts:
                values[:] = pickle.loads(request[at:])
            else:
                ctypes.memmove(values, request[at:], ctypes.sizeof(values))
        function = self._slave._functions[f"fmi{self._fmi}{'Set' if verb == b'S' else 'Get'}{KINDS[kind]}"]
        more = (count,) if self._fmi == 3 else ()
        status = function(self._slave.component, references, number, values, *more)
        if verb == b"S":
            return status, b""
        return status, pickle.dumps([v or b"" for v in values]) if texts else bytes(values)

    def _stepped(self, time: float, dt: float, no_return: bool) -> tuple[int, bytes]:
        function, component = self._slave._functions[f"fmi{self._fmi}DoStep"], self._slave.component
        if self._fmi == 3:
            size = ctypes.sizeof(ctypes.c_bool)
            pointers = [
                ctypes.cast(ctypes.byref(self._flags, k * size), ctypes.POINTER(ctypes.c_bool)) for k in range(3)
            ]
            status = function(component, time, dt, no_return, *pointers, ctypes.byref(self._reached))
        else:
            status = function(component, time, dt, int(no_return))
        parts = [REACHED.pack(*self._flags, self._reached.value)]
        for request in self._asked if status <= WARNING else ():
            own, payload = self._values(request)
            parts += [ANSWER.pack(own, len(payload)), payload]
        return status, b"".join(parts)

    def _called(self, name: str, arguments: tuple[Any, ...]) -> tuple[int, bytes]:
        try:
            return 0, pickle.dumps(self._call(name, arguments))
        except FMICallException as refused:
            return int(refused.status), pickle.dumps(None)
        except Exception as failure:
            return RAISED, pickle.dumps((str(failure).splitlines() or [type(failure).__name__])[0])

    def _call(self, name: str, arguments: tuple[Any, ...]) -> Any:
        if name == "load":
            self._fmi, given, python = arguments
            self._states.clear()
            self._slave = load(self._fmi, given, self._lines, python)
            return None
        function = getattr(self._slave, name)
        if name == STEPS_FOLLOW:
            self._asked.clear()
        if name == "getFMUState":
            handle = max(self._states, default=0) + 1
            self._states[handle] = function()
            return handle
        if name in ("setFMUState", "freeFMUState"):
            state = self._states[arguments[0]] if name == "setFMUState" else self._states.pop(arguments[0])
            return function(state)
        return function(*arguments)


def serve(connection: Any) -> None:
    """The loop of the process; Ctrl-C is for the one that started it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    served = _Served()
    try:
        connection.send_bytes(b"ready")
        while True:
            connection.send_bytes(served.answer(connection.recv_bytes()))
    except (EOFError, ConnectionError):
        return
