"""Faults and gaps of PythonFMU 0.7.0's compiled library, and what makes up for them from inside the FMU.

Each remedy looks first whether the library is as it expects, and does nothing where it is not.
Runs inside an FMU: standard library only.
"""

import atexit
import ctypes
import os
import sys
from _thread import _local  # not threading: that takes the thread which first imports it for the main one
from typing import Any

_HELD: list[dict[str, Any]] = []
_LET_GO: set[int] = set()

FOREIGN_HOST = not sys.orig_argv
"""Python was started by PythonFMU's library in a host written in another language, without a command line."""

KEPT_THREADS = 64
"""How many threads keep their state: one that ends leaves it behind, and a host may make a new one for each step."""

_thread = _local()  # lives in the thread's state: a new state knows nothing of an earlier one that was kept
_n_kept = 0


def hold_namespace(module: str) -> None:
    """Hold the namespace of the start script once more; to be called at each execution of the script.

    At every instantiation the library executes the script again and drops a reference to its namespace that
    it does not own. A script without functions of its own would lose it while in use: the host crashes at the
    third instance.
    """
    if module in sys.modules:
        _HELD.append(vars(sys.modules[module]))


def let_go_at_exit(library: str) -> None:
    """Make PythonFMU's Linux library drop its hold on the interpreter before the process ends.

    By itself it does so twice, the second time through freed memory, which now and then aborts the host at
    its very end ("corrupted double-linked list"). Only where Python is the host: elsewhere this call would
    end the interpreter.

    Parameters
    ----------
    library : str
        Path of the library that runs this FMU.
    """
    if sys.platform != "linux" or FOREIGN_HOST:
        return
    try:
        loaded = ctypes.CDLL(library, mode=os.RTLD_NOLOAD | os.RTLD_NOW)
        finalize = loaded.finalizePythonInterpreter
    except (OSError, AttributeError):
        return  # not run by PythonFMU's library
    if loaded._handle not in _LET_GO:
        _LET_GO.add(loaded._handle)
        atexit.register(finalize)


def keep_thread_state() -> None:
    """Keep Python's state of the calling thread from one FMI call to the next; for a `FOREIGN_HOST` only.

    The library asks for the interpreter and returns it in every call. A thread that Python does not know gets a
    new state each time, which costs more than most models: asking once more and never returning it keeps the state.
    """
    global _n_kept
    if _n_kept < KEPT_THREADS and not hasattr(_thread, "kept"):
        ctypes.pythonapi.PyGILState_Ensure()
        _thread.kept = True
        _n_kept += 1


def give_back(text: str) -> None:
    """Drop the reference to a logged text that the library took and forgot, once it has passed the text on.

    The caller may hold two references: a container's and its own.
    """
    if sys.getrefcount(text) > 4:  # those two, the name here, the argument of this count: one more is forgotten
        ctypes.pythonapi.Py_DecRef(ctypes.py_object(text))


class _Callbacks(ctypes.Structure):
    """``fmi2CallbackFunctions`` as far as the log needs it."""

    _fields_ = (
        ("logger", ctypes.c_void_p),
        ("memory_and_step", ctypes.c_void_p * 3),
        ("environment", ctypes.c_void_p),
    )


class _Logger(ctypes.Structure):
    """The library's logger on x86-64 Linux: virtual table, switch, instance name, categories, callbacks."""

    _fields_ = (
        ("table", ctypes.c_void_p),
        ("on", ctypes.c_bool),
        ("name", ctypes.c_void_p),
        ("name_length", ctypes.c_size_t),
        ("name_buffer", ctypes.c_char * 16),
        ("categories", ctypes.c_void_p * 3),
        ("callbacks", ctypes.POINTER(_Callbacks)),
    )


_LOG = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p)


class HostLog:
    """The host's logger, past the library, which passes nothing on while ``loggingOn`` is false.

    FMI 2.0, 2.1.5: the switch is for debug messages; what goes wrong is told in any case.

    Parameters
    ----------
    logger : int
        Address of the library's logger, as it hands it to the slave; 0 for none.
    instance_name : str
        Name of the instance: the logger must hold the same, else it is not the one that is known here.
    """

    def __init__(self, logger: int, instance_name: str) -> None:
        self._logger, self._name = None, instance_name.encode()
        if logger and sys.platform == "linux" and sys.maxsize > 2**32:
            found = _Logger.from_address(logger)
            named = found.name_length == len(self._name) and found.name
            if named and ctypes.string_at(found.name, found.name_length) == self._name:
                self._logger = found

    def is_shut(self) -> bool:
        """Whether the library would drop a message."""
        return self._logger is not None and not self._logger.on

    def is_missing(self) -> bool:
        """Whether the host has no logger: the library would call it nevertheless, and crash."""
        return self._logger is not None and not (self._logger.callbacks and self._logger.callbacks.contents.logger)

    def tell(self, status: int, category: str, text: str) -> None:
        """Hand a message to the host's logger."""
        if self._logger is not None and not self.is_missing():
            callbacks = self._logger.callbacks.contents
            _LOG(callbacks.logger)(callbacks.environment, self._name, int(status), category.encode(), text.encode())
