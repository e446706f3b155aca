"""The verbs of the Python API and of the command line: one file each; what they take, and what they return.

Each verb takes paths, records or DataFrames and returns a result object with ``summary()`` (text), ``to_frame()``
(a DataFrame) and ``figure()`` (a `tsm_fmu.report.Figure`). The command line parses, calls one of these, and prints.
"""

TIME_LIMIT = 300.0
"""Longest time of one call of an FMU in a process of its own [s]."""
