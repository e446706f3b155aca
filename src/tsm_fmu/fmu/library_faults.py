"""Two faults of PythonFMU 0.7.0's compiled library that would crash the host, and what makes up for them.

Runs inside an FMU: standard library only.
"""

import atexit
import ctypes
import os
import sys
from typing import Any

_HELD: list[dict[str, Any]] = []
_LET_GO: set[int] = set()


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
    if sys.platform != "linux" or not sys.orig_argv:
        return
    try:
        loaded = ctypes.CDLL(library, mode=os.RTLD_NOLOAD | os.RTLD_NOW)
        finalize = loaded.finalizePythonInterpreter
    except (OSError, AttributeError):
        return  # not run by PythonFMU's library
    if loaded._handle not in _LET_GO:
        _LET_GO.add(loaded._handle)
        atexit.register(finalize)
