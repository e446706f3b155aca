"""Native FMUs in FMPy, FMI 2.0 and 3.0 behind one interface: what a test sets, steps and reads."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import fmpy
from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.fmi3 import FMU3Slave

from tsm_fmu.cosim.unpack import unpacked


class Unit:
    """An instance that keeps its log."""

    def __init__(self, folder: str, name: str = "one", guid: str | None = None, logging: bool = True) -> None:
        described = fmpy.read_model_description(folder)
        self.fmi = 3 if described.fmiVersion.startswith("3") else 2
        self.references = {v.name: v.valueReference for v in described.modelVariables}
        self.kinds = {v.name: v.type for v in described.modelVariables}
        self.log: list[str] = []
        given: dict[str, Any] = {
            "guid": guid or described.guid,
            "unzipDirectory": folder,
            "modelIdentifier": described.coSimulation.modelIdentifier,  # type: ignore[union-attr]
            "instanceName": name,
        }
        if self.fmi == 2:
            self.slave: Any = FMU2Slave(**given)
            self._callbacks = fmi2CallbackFunctions()
            self._callbacks.logger = fmi2CallbackLoggerTYPE(lambda e, i, s, c, text: self.log.append(text.decode()))
            self.slave.instantiate(callbacks=self._callbacks, loggingOn=logging)
        else:
            self.slave = FMU3Slave(**given)
            self.slave.instantiate(loggingOn=logging, logMessage=lambda e, s, c, text: self.log.append(text.decode()))

    def initialise(self, start: float = 0.0, **values: float) -> None:
        if self.fmi == 2:
            self.slave.setupExperiment(startTime=start)
            self.set(**values)
            self.slave.enterInitializationMode()
        else:
            self.set(**values)
            self.slave.enterInitializationMode(startTime=start)
        self.slave.exitInitializationMode()

    def set(self, **values: float) -> None:
        for name, value in values.items():
            getattr(self.slave, f"set{self._kind(name)}")([self.references[name]], [value])

    def get(self, *names: str) -> list[float]:
        return [getattr(self.slave, f"get{self._kind(n)}")([self.references[n]])[0] for n in names]

    def _kind(self, name: str) -> str:
        kind = self.kinds[name]
        if kind == "Enumeration":
            return "Integer" if self.fmi == 2 else "Int64"
        return kind

    def step(self, time: float, step: float) -> None:
        self.slave.doStep(currentCommunicationPoint=time, communicationStepSize=step)

    def save(self) -> Any:
        return self.slave.getFMUstate() if self.fmi == 2 else self.slave.getFMUState()

    def restore(self, state: Any) -> None:
        (self.slave.setFMUstate if self.fmi == 2 else self.slave.setFMUState)(state)

    def derivative(self, unknowns: list[str], knowns: list[str], seed: list[float]) -> list[float]:
        """Directional derivative of outputs along a change of the knowns."""
        references = [[self.references[n] for n in names] for names in (unknowns, knowns)]
        return self.slave.getDirectionalDerivative(*references, seed)


@contextmanager
def opened(path: Path, **options: Any) -> Iterator[Unit]:
    """Unpack an FMU and instantiate it; freed at the end."""
    with unpacked(path) as folder:
        unit = Unit(str(folder), **options)
        try:
            yield unit
        finally:
            unit.slave.freeInstance()
