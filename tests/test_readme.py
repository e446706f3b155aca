"""The README's Python lines, run as they are printed, on logs of a drive whose friction grows with its load."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tsm_fmu as tsm
from tsm_fmu.kernels.kernel import kernel

ROOT = Path(__file__).parents[1]
RIG = {"c": 0.97, "beta": -0.45, "alpha": 9.3, "ratio": 1.03, "sigma0": 5.4, "sigma1": 0.0, "sigma2": 0.011,
       "tau_c": 0.104, "tau_s": 0.104, "v_s": 0.3, "tau_v": 0.0}  # fmt: skip


def lines() -> str:
    (block,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    return block


def log(seed: int, load: float) -> tsm.Record:
    """Three sines under a load that swings; 31 % of it goes into the friction."""
    rng, time = np.random.default_rng(seed), np.arange(2000) * 0.01
    phases = rng.uniform(0.0, 6.28, 4)
    x = sum(a * np.sin(w * time + p) for a, w, p in zip((0.6, 0.34, 0.21), (1.1, 2.7, 6.7), phases, strict=False))
    x = np.minimum(time / 0.5, 1.0) ** 2 * np.asarray(x)
    torque = load * (0.3 + np.sin(1.19 * time + phases[3]))
    drive = kernel("TendonDrive")
    out = drive.simulate(drive.params(None, RIG), time, np.column_stack([x, torque]))
    columns = {"x_in": x, "tau_out": torque} | {v.name: out[:, j] for j, v in enumerate(drive.outputs)}
    travel, slip = np.diff(x, prepend=x[0]), np.zeros(time.size)
    for k in range(1, time.size):  # a slip element of our own, not the effect's file
        slip[k] = min(max(slip[k - 1] + travel[k] / 0.019, -1.0), 1.0)
    columns["tau_in"] = columns["tau_in"] + 0.31 * np.abs(torque) * slip
    used = {n: columns[n] for n in ("x_in", "tau_out", "x_out", "tau_in")}
    noisy = {n: y + (n in ("x_out", "tau_in")) * 0.003 * y.std() * rng.normal(size=y.size) for n, y in used.items()}
    return tsm.Record(f"log{seed}", time, noisy, dict(zip(used, ("rad", "N.m", "rad", "N.m"), strict=True)))


def test_logs_to_fmu_in_the_lines_that_are_printed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {
        "runs": [log(1, 0.02)], "others": [log(2, 0.03)], "loaded": [log(3, 0.47)], "more": [log(4, 0.53)],
    }  # fmt: skip
    exec(lines(), names)  # noqa: S102  our own text
    found = names["found"]
    assert (found.verdict, found.effects) == ("named", ("load_dependence",))
    assert found.gap["tau_in"].closure > 0.9
    assert found.figure().panels
    assert (tmp_path / "MyDrive.fmu").is_file()
    assert "<table" in names["model"]._repr_html_()
