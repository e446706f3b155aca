"""Other Pythons of this machine as hosts of FMUs: a program of the standard library alone, and who can run it."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import fmpy

HOST = r"""
import ctypes, json, sys
from ctypes import CFUNCTYPE, POINTER, Structure, c_char_p, c_double, c_int, c_size_t, c_uint, c_void_p
Logger = CFUNCTYPE(None, c_void_p, c_char_p, c_int, c_char_p, c_char_p)
class Callbacks(Structure):
    _fields_ = [("logger", Logger), ("allocate", c_void_p), ("free", c_void_p), ("finished", c_void_p),
                ("environment", c_void_p)]
log = []
callbacks = Callbacks(Logger(lambda _e, name, status, category, text: log.append(text.decode())))
before, units, found = set(sys.modules), json.loads(sys.argv[1]), []
for folder, guid, model, references in units:
    library = ctypes.CDLL("%s/binaries/linux64/%s.so" % (folder, model))
    instantiate = library.fmi2Instantiate
    instantiate.restype = c_void_p
    instantiate.argtypes = [c_char_p, c_int, c_char_p, c_char_p, POINTER(Callbacks), c_int, c_int]
    uri = "file://%s/resources" % folder
    found.append((library, instantiate(model.encode(), 1, guid.encode(), uri.encode(), callbacks, 0, 1), references))
if all(component for _, component, _ in found):
    for library, component, _ in found:
        component = c_void_p(component)
        assert library.fmi2SetupExperiment(component, 0, c_double(0), c_double(0), 0, c_double(0)) == 0
        assert library.fmi2EnterInitializationMode(component) == 0
        assert library.fmi2ExitInitializationMode(component) == 0
    for n in range(5):
        for library, component, _ in found:
            assert library.fmi2DoStep(c_void_p(component), c_double(n * 0.01), c_double(0.01), 1) == 0, log
values = []
for library, component, references in found:
    if component:
        row = (c_double * len(references))()
        listed = (c_uint * len(references))(*references)
        assert library.fmi2GetReal(c_void_p(component), listed, c_size_t(len(references)), row) == 0
        values.append(list(row))
        library.fmi2Terminate(c_void_p(component))
        library.fmi2FreeInstance(c_void_p(component))
modules = sorted(set(sys.modules) - before)
print(json.dumps({"python": sys.version.split()[0], "values": values, "log": log, "modules": modules}))
"""

Version = tuple[int, int, int]


def hosts() -> dict[Version, str]:
    """Programs of the Pythons that are here, by version: this one, the distribution's own, others on the path."""
    this: str = sys._base_executable  # type: ignore[attr-defined]
    names = [this, "/usr/bin/python3", *(f"python3.{minor}" for minor in range(9, 15))]
    names += sorted(map(str, Path(this).resolve().parents[2].glob("*/bin/python3")))  # pyenv keeps them side by side
    found: dict[Version, str] = {}
    for name in names:
        program = shutil.which(name)
        if program:
            command = [program, "-I", "-S", "-c", "import sys; print(*sys.version_info[:3])"]
            asked = subprocess.run(command, capture_output=True, text=True)
            numbers = tuple(map(int, asked.stdout.split()))
            if asked.returncode == 0 and len(numbers) == 3:  # a shim of a Python that is not there fails
                found.setdefault(numbers, program)
    return found


def host_run(program: str, fmus: Sequence[Path], folder: Path) -> dict[str, Any]:
    """All FMUs in one process of a Python: outputs after five steps, log and the modules that were loaded."""
    units = []
    for fmu in fmus:
        unpacked = fmpy.extract(str(fmu), str(folder / fmu.stem))
        described = fmpy.read_model_description(str(unpacked))
        outputs = [v.valueReference for v in described.modelVariables if v.causality == "output" and v.type == "Real"]
        units.append([str(unpacked), described.guid, described.coSimulation.modelIdentifier, outputs])  # type: ignore[union-attr]
    done = subprocess.run([program, "-I", "-S", "-c", HOST, json.dumps(units)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])
