"""Cost of set + doStep + get of each FMU, against a PythonFMU FMU with the same interface and an empty do_step.

Both are called through the C interface with buffers made beforehand, as a compiled host would, and both get the
signals of the reference experiment: all inputs move, turn and rest.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import fmpy
from fmpy.fmi2 import FMU2Slave
from pythonfmu.builder import FmuBuilder

from tsm_fmu.cosim.unpack import unpacked
from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.fmu.stimuli import stimuli
from tsm_fmu.kernels.kernel import Kernel
from tsm_fmu.models import MODELS

from .ratio import Ratio, compare

LIMIT = 2.0
STEP = 2.0**-10
"""About the step of the default experiment [s]."""

REASONS = {
    "LebusTransmission": "solves the tension profiles of two tendons in each step",
    "LebusCompensator": "solves the transmission for its driver angle in each step",
}
"""Why a limit is missed, where that is known; it stays missed."""

EMPTY = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real


class {name}(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        for name, kind, causality in {variables!r}:
            setattr(self, name, 0.0 if kind == "Real" else 0)
            variable = {{"Real": Real, "Integer": Integer}}[kind]
            more = {{}} if kind == "Real" else {{"variability": Fmi2Variability.discrete}}
            self.register_variable(variable(name, causality=getattr(Fmi2Causality, causality), **more))

    def do_step(self, current_time, step_size):
        return True
"""


def ratios() -> Iterator[Ratio]:
    """One ratio per model."""
    with TemporaryDirectory(prefix="tsm_fmu_bench_") as folder:
        for module in MODELS:
            k = Kernel(module)
            with ExitStack() as stack:
                ours = stack.enter_context(loop(build_fmu(k, Path(folder)), k))
                empty = stack.enter_context(loop(empty_fmu(k, Path(folder)), k))
                found = compare(f"{k.name}: set + doStep + get", ours, empty, len(stimuli(k, step=STEP)), LIMIT)
                yield found._replace(reason=REASONS.get(k.name, ""))


def empty_fmu(k: Kernel, folder: Path) -> Path:
    """A PythonFMU FMU with the inputs and outputs of a kernel and nothing behind them."""
    name = f"Empty{k.name}"
    variables = [
        (v.name, {float: "Real", int: "Integer"}[v.kind], causality)
        for causality, group in (("input", k.inputs), ("output", k.outputs))
        for v in group
    ]
    script = folder / f"{name}.py"
    script.write_text(EMPTY.format(name=name, variables=variables))
    return Path(FmuBuilder.build_FMU(script, dest=folder))


@contextmanager
def loop(fmu: Path, k: Kernel) -> Iterator[Callable[[], None]]:
    """A function that does the experiment, on from where the last call ended."""
    with unpacked(fmu) as folder:
        description = fmpy.read_model_description(str(folder))
        model = description.coSimulation.modelIdentifier
        slave = FMU2Slave(guid=description.guid, unzipDirectory=str(folder), modelIdentifier=model, instanceName="one")
        slave.instantiate(loggingOn=False)
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        slave.exitInitializationMode()
        references = {v.name: v.valueReference for v in description.modelVariables}
        library, component = slave.dll, ctypes.c_void_p(slave.component)
        set_values, values = _access(library, component, "Set", k.inputs, references)
        get_values, _ = _access(library, component, "Get", k.outputs, references)
        do_step = library.fmi2DoStep
        do_step.argtypes = [ctypes.c_void_p, ctypes.c_double, ctypes.c_double, ctypes.c_int]
        rows = stimuli(k, step=STEP)
        done = 0

        def run() -> None:
            nonlocal done
            for row in rows:
                for buffer in values:
                    buffer[:] = row
                worst = do_step(component, done * STEP, STEP, 1)
                for call, arguments in set_values:
                    worst = max(worst, call(*arguments))
                for call, arguments in get_values:
                    worst = max(worst, call(*arguments))
                done += 1
                if worst > 1:
                    raise RuntimeError(f"{model} returned status {worst} at step {done}")

        try:
            yield run
        finally:
            slave.terminate()
            slave.freeInstance()


def _access(
    library: Any, component: ctypes.c_void_p, verb: str, variables: Any, references: dict[str, int]
) -> tuple[list[Any], list[Any]]:
    calls, buffers = [], []
    for kind, name, c_type in ((float, "Real", ctypes.c_double), (int, "Integer", ctypes.c_int)):
        wanted = [references[v.name] for v in variables if v.kind is kind]
        if wanted:
            buffer = (c_type * len(wanted))()
            listed = (ctypes.c_uint * len(wanted))(*wanted)
            calls.append((library[f"fmi2{verb}{name}"], (component, listed, ctypes.c_size_t(len(wanted)), buffer)))
            buffers += [buffer] if kind is float else []
    return calls, buffers
