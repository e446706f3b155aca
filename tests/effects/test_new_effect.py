"""A new effect is one file and one line of the registry: found where it is, with words, ranges and an FMU that runs."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from importlib import import_module, invalidate_caches
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tsm_fmu
import tsm_fmu.effects
from tsm_fmu.cli.app import run
from tsm_fmu.cosim.replay import replay
from tsm_fmu.logs.record import read_record

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")

FILE = '''\
"""An end stop: beyond a position the drive pushes against a spring.

::

    F <- F + k max(0, x - x_s)                                                          (1)

Limits: k = 0 changes nothing; below x_s there is no force. Source: the review of the architecture.
"""

from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from .about import Effect, Shape, Size

NAME = "end_stop"
ABOUT = Effect(
    words="an end stop",
    signature="a spring beyond a position",
    shown_by="strokes up to the end of the range of motion",
    places=("friction",),
    family="position",
    looks_like=("stiffness_hardening",),
)


class Params(NamedTuple):
    k: Annotated[float, Quantity("{F}/({x})", "stiffness of the stop, Eq (1)", lo=0.0), Size()] = 0.0
    x_s: Annotated[float, Quantity("{x}", "position where it begins, Eq (1)"), Shape("position", 0.0, 1.0)] = 0.0


NEUTRAL = Params()


class State(NamedTuple):
    pass


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "what this effect changes, before it")]
    x: Annotated[float, Quantity("{x}", "input position")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "the same with this effect")]


PRESETS = {}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(), Outputs(u.y + p.k * max(0.0, u.x - p.x_s))


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    return s, Outputs(u.y + p.k * max(0.0, u.x - p.x_s))  # (1)
'''
STOP, STIFFNESS, DT = -0.64, 0.31, 0.01
DRIVE = {
    "c": 0.97, "beta": -0.45, "alpha": 9.3, "ratio": 1.03, "sigma0": 5.4, "sigma1": 0.0, "sigma2": 0.011,
    "tau_c": 0.104, "tau_s": 0.104, "v_s": 0.3, "tau_v": 0.0,
}  # fmt: skip


@pytest.fixture(scope="module")
def end_stop(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The file beside the effects of the package, and in its registry."""
    folder = tmp_path_factory.mktemp("effects")
    (folder / "end_stop.py").write_text(FILE, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tsm_fmu.effects, "__path__", [*tsm_fmu.effects.__path__, str(folder)])
        invalidate_caches()
        module = import_module("tsm_fmu.effects.end_stop")
        registry = tsm_fmu.effects.EFFECTS
        for holder in [m for m in sys.modules.values() if getattr(m, "EFFECTS", None) is registry]:
            patch.setattr(holder, "EFFECTS", (*registry, module))
        yield module
    sys.modules.pop("tsm_fmu.effects.end_stop", None)


def presliding(x: np.ndarray, reach: float) -> np.ndarray:
    z = np.zeros(x.size)
    for k in range(1, x.size):
        s, d = np.sign(x[k] - x[k - 1]), abs(x[k] - x[k - 1]) / reach
        z[k] = s + (z[k - 1] - s) * np.exp(-d)
    return z


def log(path: Path, seed: int) -> Path:
    """A drive that runs against a spring from x = -0.64 rad on, all about a centre of -1.1 rad."""
    rng = np.random.default_rng(seed)
    t = np.arange(1500) * DT
    phases = rng.random(3) * 6.0
    x = np.full(t.size, -1.1)
    x += sum(
        a * np.sin(2 * np.pi * f * t + p) for a, f, p in zip((0.6, 0.4, 0.15), (0.13, 0.37, 1.1), phases, strict=True)
    )
    load = 0.31 * np.sin(2 * np.pi * 0.19 * t + phases[0]) + 0.1
    x_out = 0.97 * x - 0.45 / 9.3 * presliding(x, 1.0 / 9.3)
    torque = 1.03 * load + 0.104 * presliding(x, 0.104 / 5.4) + 0.011 * np.gradient(x, DT)
    torque += STIFFNESS * np.maximum(0.0, x - STOP)
    columns = [t, x, load, x_out + 0.001 * rng.normal(size=t.size), torque + 0.001 * rng.normal(size=t.size)]
    header = "time [s],x_in [rad],tau_out [N.m],x_out [rad],tau_in [N.m]"
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=header, comments="", fmt="%.10g")
    return path


@pytest.fixture(scope="module")
def found(end_stop: Any, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    folder = tmp_path_factory.mktemp("stop")
    runs = [log(folder / "a.csv", 3), log(folder / "b.csv", 4)]
    words = ["diagnose", "TendonDrive", "--measured", str(runs[0]), "--holdout", str(runs[1])]
    words += [w for name, value in DRIVE.items() for w in ("--set", f"{name}={value}")]
    assert run([*words, "--out", str(folder / "out"), "--json"]) == 0
    return json.loads((folder / "out" / "diagnosis.json").read_text(encoding="utf-8")) | {"run": runs[1]}


def test_it_is_named_where_it_is(found: dict[str, Any]) -> None:
    assert (found["verdict"], found["effects"]) == ("named", ["end_stop"])
    # a law of many more parameters may leave a little less
    best = next(c for c in found["candidates"] if c["effect"] == "end_stop")
    assert best["parameters"]["x_s"] == pytest.approx(STOP, abs=0.02)
    assert best["parameters"]["k"] == pytest.approx(STIFFNESS, rel=0.05)
    assert "end_stop" not in found["not_excited"]


def test_it_is_said_in_its_words(found: dict[str, Any]) -> None:
    assert "an end stop explains" in found["answer"]
    assert "end stop" in Path(found["report"]).read_text(encoding="utf-8")


def test_its_fmu_runs_and_leaves_only_noise(found: dict[str, Any]) -> None:
    record = read_record(found["run"])
    simulated = replay(Path(found["fmu"]), record).columns["tau_in"]
    error = (record.columns["tau_in"] - simulated)[300:]
    assert np.sqrt(np.mean(error**2)) < 0.0025
    plain = record.columns["tau_in"] - STIFFNESS * np.maximum(0.0, record.columns["x_in"] - STOP)
    assert np.sqrt(np.mean((plain - simulated)[300:] ** 2)) > 0.02  # without it the FMU is wrong


def test_one_line_of_the_registry_is_enough(tmp_path: Path) -> None:
    """In a copy of the package, as a user would add it."""
    package = tmp_path / "tsm_fmu"
    shutil.copytree(Path(tsm_fmu.__file__).parent, package, ignore=shutil.ignore_patterns("__pycache__"))
    (package / "effects" / "end_stop.py").write_text(FILE, encoding="utf-8")
    registry = package / "effects" / "__init__.py"
    lines = registry.read_text(encoding="utf-8").splitlines(keepends=True)
    last = max(n for n, line in enumerate(lines) if line.strip() == '"quantisation",')
    lines.insert(last + 1, '        "end_stop",\n')
    registry.write_text("".join(lines), encoding="utf-8")
    told = subprocess.run(
        [sys.executable, "-m", "tsm_fmu", "list", "end_stop", "--json"], capture_output=True, text=True, check=True,
        env={**os.environ, "PYTHONPATH": str(tmp_path)}, cwd=tmp_path,
    )  # fmt: skip
    effect = json.loads(told.stdout)["effects"]["end_stop"]
    assert effect["places"] == ["friction"]
    assert [p["name"] for p in effect["parameters"]] == ["k", "x_s"]
