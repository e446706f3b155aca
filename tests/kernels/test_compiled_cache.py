"""Compiled kernels on disk: found by the next process, never stale, never in the way."""

from __future__ import annotations

import importlib
import json
import os
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

import tsm_fmu
from tsm_fmu import models
from tsm_fmu.kernels import compiled_cache
from tsm_fmu.kernels import kernel as kernel_module
from tsm_fmu.kernels.kernel import is_kept, kernel

PROGRAM = """
import numpy as np
from numba.core import event
from tsm_fmu.kernels.chain import chain
compiled = []
class Heard(event.Listener):
    def on_start(self, e): compiled.append(e)
    def on_end(self, e): pass
event.register("numba:compile", Heard())
k = chain("TendonDrive", ("load_dependence", "sensor_lag@tau_in"))
t = np.arange(300) * 0.0173
u = np.column_stack([np.sin(1.3 * t + j) for j in range(len(k.inputs))])
p = k.params(None, {"load_dependence.k": 0.137, "tau_in.sensor_lag.tau": 0.021})
y = k.simulate(p, t, u)
print(len(compiled), y.tobytes().hex()[:4000], np.array_equal(y, k.simulate(p, t, u, compiled=False)))
"""


def ran(folder: str) -> list[str]:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], env={**os.environ, compiled_cache.VARIABLE: folder}, text=True,
        capture_output=True, check=True, timeout=300,
    )  # fmt: skip
    return done.stdout.split()


def test_the_second_process_compiles_nothing_and_gives_the_same_bits(tmp_path: Path) -> None:
    first, second, without = ran(str(tmp_path)), ran(str(tmp_path)), ran("")
    assert int(first[0]) > 0
    assert int(second[0]) == 0
    assert int(without[0]) > 0
    assert first[1:] == second[1:] == without[1:]
    assert first[2] == "True"


def test_a_change_in_any_kernel_starts_anew(tmp_path: Path) -> None:
    package = Path(tsm_fmu.__file__).parent
    for name in (*compiled_cache.PACKAGES, "kernels"):
        shutil.copytree(package / name, tmp_path / name)
    before = compiled_cache.kernels_state(tmp_path)
    assert before == compiled_cache.kernels_state(package)
    called = tmp_path / "models" / "laws" / "signs.py"  # called by others, has no kernel of its own
    called.write_text(called.read_text(encoding="utf-8") + "\n", encoding="utf-8")
    assert compiled_cache.kernels_state(tmp_path) != before


def test_no_folder_to_write_to_is_no_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    in_the_way = tmp_path / "file"
    in_the_way.write_text("", encoding="utf-8")
    monkeypatch.setenv(compiled_cache.VARIABLE, str(in_the_way))
    monkeypatch.setattr(compiled_cache, "folder", compiled_cache.folder.__wrapped__)
    assert compiled_cache.folder() is None
    assert compiled_cache.written("loop", "pass") == "<loop>"
    with compiled_cache.kept("tsm_fmu.models.lugre_friction") as kept:
        assert not kept


OTHER = """
import sys
from types import ModuleType
import numpy as np
from tsm_fmu.kernels.kernel import Kernel
from tsm_fmu.models.laws import signs
module = ModuleType("mine")
exec(compile(open(sys.argv[1]).read(), sys.argv[1], "exec"), module.__dict__)
k = Kernel(module)
print(k.simulate(k.params(), [0.0, 0.1, 0.3], [[1.3], [2.0], [-1.0]])[:, 0].tolist())
"""
MINE = """
from typing import Annotated, NamedTuple
from tsm_fmu.models.contract import Quantity
from tsm_fmu.models.laws.signs import sign
NAME, PRESETS = "Mine", {}
class Params(NamedTuple):
    gain: Annotated[float, Quantity("m", "gain")] = 1.0
class State(NamedTuple):
    x: Annotated[float, Quantity("m", "position")]
class Inputs(NamedTuple):
    v: Annotated[float, Quantity("m/s", "speed")]
class Outputs(NamedTuple):
    x: Annotated[float, Quantity("m", "position")]
def start(p, u):
    return State(0.0), Outputs(0.0)
def step(p, s, u, dt):
    x = s.x + helped(u.v, dt)
    return State(x), Outputs(x)
def helped(v, dt):
    return v * dt * abs(sign(v))
"""


def test_a_kernel_from_elsewhere_is_never_taken_from_disk(tmp_path: Path) -> None:
    """The next process could not import what it is made of, and the folder would not see its text change."""
    mine = tmp_path / "mine.py"

    def moved() -> list[float]:
        done = subprocess.run(
            [sys.executable, "-c", OTHER, str(mine)], env={**os.environ, compiled_cache.VARIABLE: str(tmp_path / "c")},
            text=True, capture_output=True, check=True, timeout=300,
        )  # fmt: skip
        return json.loads(done.stdout)

    mine.write_text(MINE, encoding="utf-8")
    expected = [0.0, 0.2, 0.2 - (0.3 - 0.1)]
    assert moved() == expected
    assert moved() == expected
    stamp = mine.stat()
    mine.write_text(MINE.replace("v * dt *", "9 * dt *"), encoding="utf-8")
    os.utime(mine, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))
    assert moved() == [0.0, 9 * 0.1, 9 * 0.1 + 9 * (0.3 - 0.1)]
    assert not list(tmp_path.rglob("loop_*.py"))  # nor written there, where its name may be that of one of ours


def test_old_forms_go_and_used_ones_stay(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    old, recent = tmp_path / "0123", tmp_path / "4567"
    for path, days in ((old, 31.0), (recent, 29.0)):
        path.mkdir()
        os.utime(path, (time.time() - days * 86400.0,) * 2)
    monkeypatch.setenv(compiled_cache.VARIABLE, str(tmp_path))
    monkeypatch.setattr(compiled_cache, "folder", compiled_cache.folder.__wrapped__)
    made = compiled_cache.folder()
    assert made is not None
    assert made.is_dir()
    assert not old.exists()
    assert recent.is_dir()


def test_threads_that_compile_beside_each_other_leave_the_setting_as_it_was():
    """Interleaved, one would restore what another had set, and numba would write where it should not."""
    from numba import config

    before = getattr(config, compiled_cache.SETTING)

    def decorated(number):
        with compiled_cache.kept("tsm_fmu.models.laws.lugre") as on:
            seen = getattr(config, compiled_cache.SETTING)
            time.sleep(1e-3 * (number % 3))
            return not on or getattr(config, compiled_cache.SETTING) == seen != before

    with ThreadPoolExecutor(4) as pool:
        assert all(pool.map(decorated, range(40)))
    assert getattr(config, compiled_cache.SETTING) == before


def test_threads_tell_importlib_one_after_the_other_to_look_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """It deletes what has gone from its list while it goes through it: two at once raise a KeyError."""
    gone = [str(tmp_path / f"gone{k}") for k in range(3)]
    sys.path_importer_cache.update(dict.fromkeys(gone))
    inside, most, look = [], [], importlib.invalidate_caches

    def slow() -> None:
        inside.append(None)
        most.append(len(inside))
        time.sleep(2e-3)
        look()
        inside.pop()

    monkeypatch.setattr(importlib, "invalidate_caches", slow)
    texts = [f'"""Nothing, for the {k}-th time."""\n' for k in range(12)]
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda t: compiled_cache.module(models, compiled_cache.named("nothing", t), t), texts))
    assert [one.__doc__ for one in found] == [text.strip().strip('"') for text in texts]
    assert max(most) == 1
    assert not set(gone) & set(sys.path_importer_cache)
    for one in found:
        del sys.modules[one.__name__]
        Path(str(one.__file__)).unlink()


def test_loops_that_another_process_compiles_are_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    one, other = kernel("PairedTsmBacklash").module, kernel("DcMotor").module
    monkeypatch.setattr(kernel_module, "folder", lambda: tmp_path)
    (tmp_path / "loop_paired_tsm_backlash.py").write_text("")
    (tmp_path / "a").mkdir()
    looked_for = is_kept.__wrapped__  # each process asks once
    assert not looked_for(one)
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "loop_paired_tsm_backlash.run-2.py311.nbi").write_bytes(b"")
    assert looked_for(one)
    assert not looked_for(other)
    (tmp_path / "b" / "loop_dc_motor.run-2.py311.1.nbc").write_bytes(b"")  # not its index yet
    assert not looked_for(other)
    monkeypatch.setattr(kernel_module, "folder", lambda: None)
    assert not looked_for(one)
