"""FMUs and co-simulations of the reproduction: built once a process, run on all processors."""

from __future__ import annotations

import atexit
import multiprocessing
import os
import re
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from shutil import rmtree
from tempfile import mkdtemp
from typing import Any, TypeVar

from ..cosim.cases import run_cases
from ..cosim.ssp import Case
from ..cosim.trajectory import SimulationStopped, Trajectory
from ..fmu.build import build_fmu
from ..fmu.native.zig import loaded_here
from ..kernels.chain import chain
from ..kernels.kernel import kernel

T = TypeVar("T")


class Fmus(Mapping[str, Path]):
    """Paths of FMUs by ``MODEL[+EFFECT[@CHANNEL]...]``, each built at its first use.

    Attributes
    ----------
    flavour : str
        Of those that are asked for; native ones are built for this machine alone.
    """

    def __init__(self) -> None:
        self.flavour = "python"

    @contextmanager
    def of(self, flavour: str) -> Iterator[None]:
        """Another flavour for a while."""
        before, self.flavour = self.flavour, flavour
        try:
            yield
        finally:
            self.flavour = before

    def __getitem__(self, spec: str) -> Path:
        return _fmu(spec, self.flavour)

    def __iter__(self) -> Iterator[str]:
        return iter(())

    def __len__(self) -> int:
        return 0


FMUS = Fmus()


@cache
def _folder() -> Path:
    kept = mkdtemp(prefix="tsm_fmu_reproduction_")
    # a TemporaryDirectory goes with its last reference, and from Python 3.13 on a forked process drops those of atexit
    atexit.register(rmtree, kept, ignore_errors=True)
    return Path(kept)


@cache
def _fmu(spec: str, flavour: str) -> Path:
    model, *effects = spec.split("+")
    built = chain(model, tuple(effects)) if effects else kernel(model)
    name = re.sub(r"\W", "_", spec)
    path = _folder() / flavour / f"{name}.fmu"
    return build_fmu(built, path, name=name, flavour=flavour, platforms=loaded_here())


def co_simulate(cases: Mapping[str, Case], record: Sequence[str] | None = None) -> dict[str, Trajectory]:
    """Run every case, as many at a time as there are processors; signals as in `run_cases`."""
    runs = side_by_side(_run, [(name, case, record) for name, case in cases.items()])
    return dict(zip(cases, runs, strict=True))


def side_by_side(function: Callable[..., T], arguments: Sequence[tuple[Any, ...]]) -> list[T]:
    """The function at every set of arguments, on all processors where processes can be forked."""
    workers = min(len(arguments), os.cpu_count() or 1)
    if workers < 2 or "fork" not in multiprocessing.get_all_start_methods():
        return [function(*given) for given in arguments]
    with ProcessPoolExecutor(workers, multiprocessing.get_context("fork"), _end_with_parent) as pool:
        return [job.result() for job in [pool.submit(function, *given) for given in arguments]]


def _end_with_parent() -> None:
    """A forked worker holds both ends of the pool's pipes: it would wait for ever for a parent that was killed."""
    parent = multiprocessing.parent_process()
    assert parent is not None

    def follow() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


def _run(name: str, case: Case, record: Sequence[str] | None) -> Trajectory:
    try:
        return run_cases({name: case}, record=record)[name]
    except SimulationStopped as stopped:  # carries its rows and does not cross processes
        raise RuntimeError(f"case {name}: {stopped}") from None
