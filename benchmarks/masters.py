"""One system in several masters, each in a process of its own: time, and the values at the end.

The masters are ours, libcosim, ecos, FMPy's SSP simulation, and the container FMU of fmu-manipulation-toolbox (which
FMPy drives here); all exchange as Jacobi does. ``python -m benchmarks.masters SSP MASTER STEPS STEP`` runs one.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from types import SimpleNamespace
from typing import Any

import fmpy

from tsm_fmu.cosim import master
from tsm_fmu.cosim.description import describe
from tsm_fmu.cosim.ssp import open_ssp
from tsm_fmu.cosim.system import Component, Connection, System, check_system

Values = dict[str, float]
"""Real outputs at the end by ``component.variable``."""


@dataclass(frozen=True)
class MasterRun:
    """A run of a system in a master; ``missing`` says why there is none.

    Attributes
    ----------
    seconds : float
        From the file to the last value.
    stepping : float
        The steps alone; NaN where the master does not let them be timed apart.
    values : dict
        Real outputs at the end.
    """

    seconds: float = float("nan")
    stepping: float = float("nan")
    values: Mapping[str, float] | None = None
    missing: str = ""


@contextmanager
def stepping() -> Iterator[list[float]]:
    """Seconds that our compiled loop spends in steps, one entry for each of its calls."""
    spent: list[float] = []
    run_of = master.Program.run

    def timed(self: master.Program, *arguments: Any) -> int:
        begin = perf_counter()
        try:
            return run_of(self, *arguments)
        finally:
            spent.append(perf_counter() - begin)

    program: Any = master.Program
    program.run = timed
    try:
        yield spent
    finally:
        program.run = run_of


def ours(ssp: Path, steps: int, step: float) -> tuple[float, Values]:
    with open_ssp(ssp) as cases, stepping() as spent:
        ((system, _),) = cases.values()
        run = master.simulate_system(system, steps * step, step, method="jacobi", loops="delay", compiled=True)
    return sum(spent), {name: float(values[-1]) for name, values in run.columns.items()}


def libcosim(ssp: Path, steps: int, step: float) -> tuple[float, Values]:
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimObserver import CosimObserver

    execution = CosimExecution.from_ssp_file(str(ssp), round(step * 1e9))
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    begin = perf_counter()
    if not execution.step(steps):
        raise RuntimeError("libcosim did not step")
    spent = perf_counter() - begin
    found: Values = {}
    for name, outputs in real_outputs(ssp).items():
        slave: Any = execution.slave_index_from_instance_name(name)
        values = observer.last_real_values(slave, list(outputs.values()))
        found |= {f"{name}.{variable}": value for variable, value in zip(outputs, values, strict=True)}
    return spent, found


def ecos(ssp: Path, steps: int, step: float) -> tuple[float, Values]:
    from ecospy import EcosSimulation

    simulation = EcosSimulation(ssp_path=str(ssp), step_size=step)
    simulation.init(parameter_set="initialValues")
    begin = perf_counter()
    simulation.step(steps)
    spent = perf_counter() - begin
    found = {
        f"{name}.{variable}": simulation.get_real(f"{name}::{variable}")
        for name, outputs in real_outputs(ssp).items()
        for variable in outputs
    }
    simulation.terminate()
    return spent, found


def fmpy_ssp(ssp: Path, steps: int, step: float) -> tuple[float, Values]:
    from fmpy.ssp.simulation import simulate_ssp

    with open_ssp(ssp) as cases:
        ((system, _),) = cases.values()
        names = [(f"{c.name}.{n}", v) for c in system.components for n, v in c.parameters.items()]
    table = SimpleNamespace(parameters=[SimpleNamespace(name=name, value=value) for name, value in names])
    # it adds steps up: half a step less, and rounding makes none more
    rows = simulate_ssp(str(ssp), stop_time=(steps - 0.5) * step, step_size=step, parameter_set=table)
    found = {f"{c}.{v}": float(rows[f"{c}.{v}"][-1]) for c, outputs in real_outputs(ssp).items() for v in outputs}
    return float("nan"), found


def container(ssp: Path, steps: int, step: float) -> tuple[float, Values]:
    with open_ssp(ssp) as cases, TemporaryDirectory() as folder:
        ((system, _),) = cases.values()
        fmu = container_fmu(system, step, Path(folder))
        begin = perf_counter()
        rows = fmpy.simulate_fmu(str(fmu), stop_time=steps * step, step_size=step, output_interval=step, validate=False)
        spent = perf_counter() - begin
    return spent, {name.replace("::", "."): float(rows[name][-1]) for name in rows.dtype.names or () if "::" in name}


def container_fmu(system: System, step: float, folder: Path) -> Path:
    """The system as one FMU of fmu-manipulation-toolbox."""
    from fmu_manipulation_toolbox.assembly import Assembly

    files = {c.name: f"{c.name}.fmu" for c in system.components}
    for component in system.components:
        (folder / files[component.name]).symlink_to(component.fmu.resolve())
    links = [(*c.source.split("."), *c.target.split(".")) for c in system.connections]
    assert all((c.factor, c.offset) == (1.0, 0.0) for c in system.connections), "factors: `with_gains`"
    plan = {
        "name": "system", "step_size": step, "auto_link": False, "auto_input": False, "auto_output": False,
        "auto_parameter": False, "auto_local": False, "fmu": list(files.values()),
        "link": [[files[a], x, files[b], y] for a, x, b, y in links],
        "output": [
            [files[c.name], p.name, f"{c.name}::{p.name}"]
            for c in system.components for p in describe(c.fmu).outputs if p.kind == "Real"
        ],
        "start": [[files[c.name], name, value] for c in system.components for name, value in c.parameters.items()],
    }  # fmt: skip
    (folder / "system.json").write_text(json.dumps(plan), encoding="utf-8")
    Assembly("system.json", fmu_directory=folder).make_fmu(filename="system.fmu")
    return folder / "system.fmu"


def with_gains(system: System, gain: Path) -> System:
    """The same with a `Sum` in each connection that has a factor, for masters whose connections have none."""
    components, connections = list(system.components), []
    for number, (c, link) in enumerate(zip(system.connections, check_system(system).links, strict=True)):
        if (c.factor, c.offset) == (1.0, 0.0):
            connections.append(c)
            continue
        assert link.offset == 0.0
        name = f"gain_{number}"
        components.append(Component(name, gain, {"k1": link.gain, "u2": 0.0, "u3": 0.0}))
        connections += [Connection(c.source, f"{name}.u1"), Connection(f"{name}.y", c.target)]
    return replace(system, components=tuple(components), connections=tuple(connections))


def real_outputs(ssp: Path) -> dict[str, dict[str, int]]:
    """Value references of the Real outputs by component and name."""
    with open_ssp(ssp) as cases:
        ((system, _),) = cases.values()
        return {
            c.name: {p.name: p.reference for p in describe(c.fmu).outputs if p.kind == "Real"}
            for c in system.components
        }


MASTERS: dict[str, Callable[[Path, int, float], tuple[float, Values]]] = {
    "ours": ours,
    "libcosim": libcosim,
    "ecos": ecos,
    "fmpy.ssp": fmpy_ssp,
    "container": container,
}


def run(ssp: Path, name: str, steps: int, step: float) -> MasterRun:
    """Run a system in a master; a master whose library does not load here is ``missing``.

    Raises
    ------
    RuntimeError
        If it fails otherwise.
    """
    command = [sys.executable, "-m", "benchmarks.masters", str(ssp), name, str(steps), repr(step)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=Path(__file__).parents[1], env=os.environ)
    if done.returncode != 0:
        last = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
        if "libtbb" in last or "ModuleNotFoundError" in last:
            return MasterRun(missing=last)
        raise RuntimeError(f"{name}: {done.stderr}")
    return MasterRun(**json.loads(done.stdout.splitlines()[-1]))


def main(arguments: list[str]) -> None:
    """Run one; prints a JSON object last."""
    ssp, name, steps, step = arguments
    begin = perf_counter()
    spent, values = MASTERS[name](Path(ssp), int(steps), float(step))
    result = MasterRun(perf_counter() - begin, spent)
    print(json.dumps(vars(replace(result, values=values))), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
