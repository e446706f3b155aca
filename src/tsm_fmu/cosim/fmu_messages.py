"""The messages between `RemoteSlave` and the process that serves it, a pipe of bytes.

A request begins with what is asked: ``C`` a method by name, pickled; ``S`` or ``G`` values to be set or got; ``D`` a
step. An answer is a status, what the FMU has logged since, and the result. That of a step also has the values that were
asked for after earlier steps: two messages a step.
"""

from __future__ import annotations

import struct

from .fmi_calls import C_TYPES

ANSWER = struct.Struct("<iI")
"""Status, and bytes of the log lines that follow."""
VALUES = struct.Struct("<cBII")
"""Set or get, type, variables, values."""
STEP = struct.Struct("<cdd?")
REACHED = struct.Struct("<???d")
"""What an FMI 3.0 step answers beside its status."""
KINDS = tuple(C_TYPES)
"""Types by their number in a message."""
RAISED = -1
"""Status of a method that raised something else than a status."""
STEPS_FOLLOW = "exitInitializationMode"
"""After it both sides forget what was asked for: only values that are asked for between steps are answered ahead."""
