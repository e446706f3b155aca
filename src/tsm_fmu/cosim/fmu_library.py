"""An FMU's library, loaded and instantiated by FMPy, with what it logs above the status OK."""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys
from collections import deque
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import fmpy.fmi2
import fmpy.fmi3

OK = 0
SCRIPT_NAME = "resources/slavemodule.txt"
"""Where a PythonFMU unit names its script."""
MOST_LINES = 20

_log: dict[str, deque[str]] = {}
"""Last lines of each live instance: FMPy's logger proxy knows one callback per process."""
_kept: list[dict[str, Any]] = []


def load(fmi: int, arguments: Mapping[str, Any], lines: deque[str], python: bool) -> Any:
    """Load and instantiate.

    Parameters
    ----------
    fmi : {2, 3}
        Version of the interface.
    arguments : mapping
        Of FMPy's ``FMU2Slave`` or ``FMU3Slave``.
    lines : deque of str
        Gets what the instance logs.
    python : bool
        Whether PythonFMU runs it.

    Raises
    ------
    Exception
        What FMPy raises if it cannot be loaded.
    """
    here = os.getcwd()
    _log[arguments["instanceName"]] = lines
    try:
        if fmi == 3:
            slave: Any = fmpy.fmi3.FMU3Slave(**arguments)
            slave.instantiate(loggingOn=True, logMessage=lambda _, status, __, text: _remember(lines, status, text))
        else:
            slave = fmpy.fmi2.FMU2Slave(**arguments)
            slave.instantiate(callbacks=_callbacks(), loggingOn=True)
    except Exception:
        forget(arguments["instanceName"])
        os.chdir(here)  # FMPy stays in the library's folder where loading fails, and that folder is removed
        raise
    if python:
        _keep_python_namespace(Path(arguments["unzipDirectory"]))
    return slave


def forget(name: str) -> None:
    """An instance that is gone logs no more."""
    _log.pop(name, None)


def _keep_python_namespace(directory: Path) -> None:
    """Guard against a defect of PythonFMU 0.7.0: each instance drops a reference to its script's namespace too many.

    Without this the namespace is freed while in use, and the process crashes some instances later.
    """
    module = sys.modules.get((directory / SCRIPT_NAME).read_text(encoding="utf-8").strip())
    if module is not None:
        _kept.append(vars(module))


def _remember(lines: deque[str], status: int, message: bytes | None) -> None:
    text = (message or b"").decode("utf-8", "replace").strip()
    if text and status != OK:  # OK: chatter of the FMU, not a reason
        lines.append(" ".join(text.split()))


def _logger(_environment: Any, name: bytes | None, status: int, _category: Any, message: bytes | None) -> None:
    lines = _log.get((name or b"").decode("utf-8", "replace"))
    if lines is not None:
        _remember(lines, status, message)
    elif status > OK + 1:
        print((message or b"").decode("utf-8", "replace"), file=sys.stderr)


_CALLBACKS = (  # kept for the life of the process: the proxy below holds on to the logger
    fmpy.fmi2.fmi2CallbackLoggerTYPE(_logger),
    fmpy.fmi2.fmi2CallbackAllocateMemoryTYPE(fmpy.calloc),
    fmpy.fmi2.fmi2CallbackFreeMemoryTYPE(fmpy.free),
)


def _callbacks() -> Any:
    callbacks = fmpy.fmi2.fmi2CallbackFunctions()
    callbacks.logger, callbacks.allocateMemory, callbacks.freeMemory = _CALLBACKS
    with contextlib.suppress(ImportError, OSError):  # formats C variadic messages; not shipped for every platform
        from fmpy.logging import addLoggerProxy

        addLoggerProxy(ctypes.byref(callbacks))
    return callbacks
