"""Blind cases for the diagnosis: made by plants that share nothing with `tsm_fmu`, judged by what was hidden in them.

The generator (`motions`, `operators`, `plants`, `hidden`, `outside`, `instruments`, `catalogue`, `generate`) imports
numpy, numba, scipy and pandas only. `judge` runs ``tsm-fmu diagnose``, `score` compares its answer with the truth,
which lies outside the folders with the logs. See ``python -m benchmarks.blind --help``.
"""
