"""FMUs built once in a session, and what several system tests need to drive them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Protocol

import fmpy
import fmpy.fmi2
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Slave

from tsm_fmu.cosim.unpack import unpacked
from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.fmu.native.zig import loaded_here
from tsm_fmu.kernels.kernel import Kernel, kernel

Fmus = Callable[[str], Path]


@pytest.fixture(scope="session")
def fmus(tmp_path_factory) -> Fmus:
    """``fmus(name)``: path of a model's FMU, built at its first use."""
    folder = tmp_path_factory.mktemp("fmus")

    def built(name: str) -> Path:
        path = folder / f"{name}.fmu"
        return path if path.exists() else build_fmu(kernel(name), path)

    return built


class NativeFmus(Protocol):
    def __call__(self, name: str, fmi: int = 2) -> Path: ...


@pytest.fixture(scope="session")
def native_fmus(tmp_path_factory) -> NativeFmus:
    """``native_fmus(name, fmi)``: a model's FMU in C for this machine alone, built once by all workers of a run."""
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "native_fmus"

    def built(name: str, fmi: int = 2) -> Path:
        path = folder / str(fmi) / f"{name}.fmu"  # two workers at once write the same bytes, each file whole
        if not path.exists():
            build_fmu(kernel(name), path, flavour="native", fmi=fmi, platforms=loaded_here(fmi))
        return path

    return built


@pytest.fixture(scope="session")
def bare_packages(tmp_path_factory) -> Path:
    """A folder with all that is installed here but this project and PythonFMU: what a foreign host has."""
    folder = tmp_path_factory.mktemp("packages")
    for entry in Path(fmpy.__file__).parents[1].iterdir():
        if "tsm_fmu" not in entry.name and "pythonfmu" not in entry.name and entry.suffix != ".pth":
            (folder / entry.name).symlink_to(entry)
    return folder


class Instance:
    """An FMU instance that keeps the log; thin, over FMPy's binding."""

    def __init__(self, slave: FMU2Slave, references: dict[str, int], log: list[str]) -> None:
        self.slave, self.references, self.log = slave, references, log

    def set(self, **values: float) -> None:
        for name, value in values.items():
            self.slave.setReal([self.references[name]], [value])

    def get(self, *names: str) -> list[float]:
        return self.slave.getReal([self.references[n] for n in names])

    def initialise(self, start: float = 0.0, **values: float) -> None:
        self.slave.setupExperiment(startTime=start)
        self.set(**values)
        self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()

    def step(self, time: float, step: float) -> None:
        self.slave.doStep(currentCommunicationPoint=time, communicationStepSize=step)


@pytest.fixture
def instance() -> Callable[..., object]:
    """``with instance(path) as i``: an instantiated FMU with its log, freed at the end."""

    @contextmanager
    def opened(path: Path) -> Iterator[Instance]:
        with unpacked(path) as folder:
            description = fmpy.read_model_description(str(folder))
            log: list[str] = []
            slave = FMU2Slave(
                guid=description.guid,
                unzipDirectory=str(folder),
                modelIdentifier=description.coSimulation.modelIdentifier,
                instanceName="one",
            )
            callbacks = fmpy.fmi2.fmi2CallbackFunctions()
            callbacks.logger = fmpy.fmi2.fmi2CallbackLoggerTYPE(
                lambda _e, _i, _s, _c, message: log.append(message.decode())
            )
            callbacks.allocateMemory = fmpy.fmi2.fmi2CallbackAllocateMemoryTYPE(fmpy.fmi2.calloc)
            callbacks.freeMemory = fmpy.fmi2.fmi2CallbackFreeMemoryTYPE(fmpy.fmi2.free)
            slave.instantiate(callbacks=callbacks, loggingOn=True)
            references = {v.name: v.valueReference for v in description.modelVariables}
            try:
                yield Instance(slave, references, log)
            finally:
                slave.freeInstance()

    return opened


def wandering_inputs(k: Kernel, time: np.ndarray, seed: int = 20) -> np.ndarray:
    """Inputs with turns inside, forces and angles above zero; shape (len(time), number of inputs)."""
    random = np.random.default_rng(seed)
    columns = []
    for v in k.inputs:
        f1, f2, phase = random.uniform(0.23, 0.71), random.uniform(1.3, 2.9), random.uniform(0.0, 6.0)
        wave = 0.31 * np.sin(2 * np.pi * f1 * time + phase) + 0.083 * np.sin(2 * np.pi * f2 * time)
        scale, offset = {"N": (1.0, 2.3), "rad": (4.0, 1.8)}.get(v.quantity.unit, (1.0, 0.0))
        columns.append(scale * wave + offset)
    return np.stack(columns, axis=1) if columns else np.empty((time.size, 0))
