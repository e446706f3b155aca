"""One FMU in a process of its own: what `FmuInstance` asks of FMPy, asked of the other process.

The C functions of the step loop are there as functions by address too, so that the loop in machine code calls a foreign
FMU as it calls its own. Each call waits for its answer.
"""

from __future__ import annotations

import ctypes
import pickle
from collections import deque
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from fmpy.fmi1 import FMICallException

from .fmi_calls import FATAL, WARNING, c_type
from .fmu_messages import ANSWER, KINDS, RAISED, REACHED, STEP, STEPS_FOLLOW, VALUES
from .fmu_process import FmuProcess, ProcessLost

_METHODS = frozenset(
    "setupExperiment enterInitializationMode exitInitializationMode terminate freeInstance getFMUState setFMUState "
    "freeFMUState getBooleanStatus getRealStatus getDirectionalDerivative".split()
)


class RemoteSlave:
    """The FMU of a process, as FMPy's slave is used by `FmuInstance`.

    Parameters
    ----------
    process : FmuProcess
    fmi : {2, 3}
        Version of the interface.
    arguments, lines, python
        As in `fmu_library.load`.

    Attributes
    ----------
    component : ctypes.c_void_p
        Stands for the instance, which is elsewhere.
    failure : BaseException or None
        What a call by address could not raise.

    Raises
    ------
    ProcessLost, RuntimeError
        If it cannot be loaded.
    """

    def __init__(
        self, process: FmuProcess, fmi: int, arguments: Mapping[str, Any], lines: deque[str], python: bool
    ) -> None:
        self.process, self._lines = process, lines
        self.component = ctypes.c_void_p(1)
        self.failure: BaseException | None = None
        self._ahead: dict[bytes, tuple[int, Any]] = {}
        self._asked: list[bytes] = []
        self._texts: dict[bytes, list[bytes]] = {}
        self._functions = _Functions(self, fmi)
        self._method("load", fmi, dict(arguments), python)

    def __getattr__(self, name: str) -> Callable[..., Any]:
        if name not in _METHODS:
            raise AttributeError(name)
        return partial(self._method, name)

    def _method(self, name: str, *arguments: Any) -> Any:
        status, payload = self._answer(b"C" + pickle.dumps((name, arguments)))
        value = pickle.loads(payload)
        if name == STEPS_FOLLOW:
            self._asked.clear()
        if status == RAISED:
            raise RuntimeError(value)
        if status > WARNING:
            raise FMICallException(name, status)
        return value

    def _answer(self, request: bytes) -> tuple[int, bytes]:
        self._ahead.clear()
        answer = self.process.ask(request)
        status, logged = ANSWER.unpack_from(answer)
        at = ANSWER.size
        if logged:
            self._lines.extend(pickle.loads(answer[at : at + logged]))
        return status, answer[at + logged :]

    def values(self, verb: bytes, kind: int, counted: bool, *arguments: Any) -> int:
        """Set or get values; the arguments are those of the C function."""
        _, references, number, values, *more = arguments
        count = more[0] if counted else number
        request = VALUES.pack(verb, kind, number, count) + ctypes.string_at(references, 4 * number)
        own = c_type(KINDS[kind], counted)
        size = count * ctypes.sizeof(own)
        texts = own is ctypes.c_char_p
        if verb == b"S":
            given = pickle.dumps(list((own * count).from_address(values))) if texts else ctypes.string_at(values, size)
            return self._answer(request + given)[0]
        if request in self._ahead:
            status, found = self._ahead[request]
        else:
            status, found = self._answer(request)
            if request not in self._asked:  # in the order in which the other side got them
                self._asked.append(request)
        if texts:
            self._texts[request] = kept = pickle.loads(found)  # the caller's pointers point into these
            (own * count).from_address(values)[:] = kept
        else:
            ctypes.memmove(values, found, size)
        return status

    def step(self, _: Any, time: float, dt: float, no_return: Any, *answers: int) -> int:
        """``doStep`` with the arguments of the C function."""
        status, payload = self._answer(STEP.pack(b"D", time, dt, bool(no_return)))
        *flags, reached = REACHED.unpack_from(payload)
        if answers:
            for place, flag in zip(answers[:3], flags, strict=True):
                ctypes.c_bool.from_address(place).value = flag
            ctypes.c_double.from_address(answers[3]).value = reached
        at = REACHED.size
        for request in self._asked if at < len(payload) else ():
            own, size = ANSWER.unpack_from(payload, at)
            at += ANSWER.size
            self._ahead[request] = own, payload[at : at + size]
            at += size
        return status


class _Functions(dict[str, Any]):
    """The C functions by name, made when they are asked for."""

    def __init__(self, slave: RemoteSlave, fmi: int) -> None:
        super().__init__()
        self._slave, self._prefix = slave, f"fmi{fmi}"

    def __missing__(self, name: str) -> Any:
        verb, counted = name.removeprefix(self._prefix), self._prefix == "fmi3"
        pointer, number = ctypes.c_void_p, ctypes.c_double
        if verb == "DoStep":
            answers = (ctypes.c_bool, *[pointer] * 4) if counted else (ctypes.c_int,)
            made = self._made((pointer, number, number, *answers), self._slave.step)
        else:
            types = (pointer, pointer, ctypes.c_size_t, pointer, *([ctypes.c_size_t] if counted else []))
            made = self._made(types, partial(self._slave.values, verb[:1].encode(), KINDS.index(verb[3:]), counted))
        self[name] = made
        return made

    def _made(self, types: tuple[Any, ...], function: Callable[..., int]) -> Any:
        slave = self._slave

        def call(*arguments: Any) -> int:
            try:
                return function(*arguments)
            except ProcessLost:
                return FATAL
            except BaseException as failure:  # which C code cannot hand on
                slave.failure = failure
                return FATAL

        return ctypes.CFUNCTYPE(ctypes.c_int, *types)(call)
