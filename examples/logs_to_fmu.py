"""Logs to an FMU in a few lines: ``python examples/logs_to_fmu.py [FOLDER]``, on the sample logs."""

import sys
from pathlib import Path

import tsm_fmu as tsm

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
model = tsm.identify("PairedTsmBacklash", tsm.sample("sine").window(0.5), holdout=tsm.sample("multisine"))
print(model.summary())
print(tsm.export(model, folder / "MyDrive.fmu"))
