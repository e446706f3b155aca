"""A late channel and a wrong zero are found beside the model, and the card keeps them as effects."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
import rig
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from tsm_fmu.card import read_card
from tsm_fmu.cli.app import run
from tsm_fmu.identification.fit import fit
from tsm_fmu.identification.nuisance import with_limited_delays, with_nuisance
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import write_record
from tsm_fmu.models.contract import InputError
from tsm_fmu.regression.problem import FitRun
from tsm_fmu.regression.specification import per_run_fields, search_space

DELAY = 0.0137
OFFSETS = {"a": -1.2617, "b": 0.3119}
COMPLIANCE, LOAD_SHARE, X_PRE = 0.0719, 0.1373, 0.0213
DRIVE = {"c": 0.9137, "beta": -0.3871, "alpha": 13.7}


def late(data: FitRun, delay: float) -> FitRun:
    """The targets as they were ``delay`` earlier, by a spline; before the start, the first value."""
    spline = CubicSpline(data.time, data.targets, axis=0)
    return FitRun(data.name, data.time, data.inputs, spline(np.maximum(data.time - delay, data.time[0])))


def test_delay_is_recovered_and_the_model_keeps_its_parameters() -> None:
    runs = [late(rig.backlash_run(n, 40 + k, x_0=x_0), DELAY) for k, (n, x_0) in enumerate(OFFSETS.items())]
    runs = [
        FitRun(r.name, r.time, r.inputs, r.targets + rig.coloured(r.time.size, 0.002, 90 + k)[:, None])
        for k, r in enumerate(runs)
    ]
    extended = with_nuisance(kernel("PairedTsmBacklash"), (), ["delay@x_out"])
    space = search_space(extended.kernel, per_run=per_run_fields(extended.kernel))
    space = with_limited_delays(space, extended.delays, runs)
    result = fit(extended.kernel, runs, ("x_out",), space)
    for name, true in {**rig.TRUE, "x_out__delay__T_d": DELAY}.items():
        p = result.parameters[name]
        assert abs(p.value - true) < 4.0 * p.stderr, name
    assert result.parameters["x_out__delay__T_d"].stderr < 0.05 * DELAY
    without = fit(
        kernel("PairedTsmBacklash"),
        runs,
        ("x_out",),
        search_space(kernel("PairedTsmBacklash"), per_run=per_run_fields(extended.kernel)),
    )
    assert without.measured["x_out"].rmse > 2.0 * result.measured["x_out"].rmse


def test_delay_longer_than_the_effect_keeps_is_named_as_a_bound() -> None:
    data = late(rig.backlash_run("r", 44), 0.34)  # 68 steps of the log, 63 are kept
    extended = with_nuisance(kernel("PairedTsmBacklash"), (), ["delay@x_out"])
    space = search_space(
        extended.kernel, values=rig.TRUE, fixed=list(rig.TRUE), per_run=per_run_fields(extended.kernel)
    )
    space = with_limited_delays(space, extended.delays, [data])
    result = fit(extended.kernel, [data], ("x_out",), space)
    assert result.parameters["x_out__delay__T_d"].value == pytest.approx(63.0 / rig.RATE, rel=1e-3)
    assert "x_out__delay__T_d" in result.at_bound


def test_offset_beside_the_models_own_is_said_to_be_undetermined() -> None:
    extended = with_nuisance(kernel("PairedTsmBacklash"), (), ["offset@x_out"])
    result = fit(
        extended.kernel,
        [rig.backlash_run("r", 45, noise=0.001)],
        ("x_out",),
        search_space(
            extended.kernel, fixed=extended.fixed, per_run=per_run_fields(extended.kernel, offsets=extended.per_run)
        ),
    )
    assert {"x_0", "x_out__offset_drift__b"} <= set(result.undetermined)
    assert any(f.startswith("x_out.offset_drift.b") and "not determined" in f for f in result.findings)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("lag@x_out", "--nuisance lag@x_out -- expected delay@CHANNEL or offset@CHANNEL"),
        ("delay", "--nuisance delay -- expected delay@CHANNEL"),
        ("offset@", "--nuisance offset@ -- expected delay@CHANNEL or offset@CHANNEL"),
        ("delay@tau", "effect 'delay@tau' on PairedTsmBacklash -- it can act on x_out"),
    ],
)
def test_wrong_nuisance_is_one_line(text: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        with_nuisance(kernel("PairedTsmBacklash"), (), [text])
    assert message in str(caught.value)


def drive_log(path: Path, seed: int, offset: float) -> Path:
    """A loaded TendonDrive by scipy: elastic lost motion, friction that grows with the load, a torque sensor's zero.

    LuGre is integrated over the speed of the straight line between samples; the presliding state and the hysteresis
    follow that line too. The drive torque comes ``DELAY`` late.
    """
    base = rig.backlash_run("r", seed, true=DRIVE, seconds=8.0)
    t, x = base.time, base.inputs[:, 0]
    load = 0.31 * np.sin(0.71 * t + seed) + 0.17
    v = np.concatenate([[0.0], np.diff(x) * rig.RATE])
    g = 0.1037 + 0.0291 * np.exp(-((v / 0.57) ** 2))
    z, pre = np.zeros_like(t), np.zeros_like(t)
    for k in range(1, t.size):

        def rates(_: float, y: np.ndarray, k: int = k) -> list[float]:
            return [v[k] - 2.113 * abs(v[k]) * y[0] / g[k], (v[k] - abs(v[k]) * y[1]) / X_PRE]

        z[k], pre[k] = solve_ivp(rates, (0.0, 1.0 / rig.RATE), [z[k - 1], pre[k - 1]], rtol=1e-7, atol=1e-10).y[:, -1]
    rate = v - 2.113 * abs(v) * z / g
    torque = 1.0713 * load + 2.113 * z + 0.0119 * rate + 0.0317 * v + LOAD_SHARE * abs(load) * pre
    torque = CubicSpline(t, torque)(np.maximum(t - DELAY, 0.0)) + offset + rig.coloured(t.size, 0.002, seed + 7)
    x_out = base.targets[:, 0] - COMPLIANCE * load + rig.coloured(t.size, 0.001, seed + 8)
    write_record(
        path,
        t,
        {"x_in": x, "tau_out": load, "x_out": x_out, "tau_in": torque},
        {"x_in": "rad", "tau_out": "N.m", "x_out": "rad", "tau_in": "N.m"},
    )
    return path


KNOWN = {
    "tau_v": 0.0,
    "sigma0": 2.113,
    "sigma1": 0.0119,
    "tau_s": 0.1328,
    "v_s": 0.57,
    "motion.x_pre": X_PRE,
    "x_out.tendon_elasticity.compliance_drive": 0.0,
}
"""Not fitted here: the recovery of LuGre's own parameters is another test's."""


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict]:
    folder = tmp_path_factory.mktemp("drive")
    logs = [drive_log(folder / f"{name}.csv", 50 + k, 0.1 * x) for k, (name, x) in enumerate(OFFSETS.items())]
    said = identify(
        folder,
        "TendonDrive+load_dependence+tendon_elasticity@x_out",
        *(a for log in logs for a in ("--measured", str(log))),
        *("--nuisance", "delay@tau_in", "--nuisance", "offset@tau_in", "--report", str(folder / "card.html")),
        *(a for name, value in KNOWN.items() for a in ("--set", f"{name}={value}", "--fix", name)),
    )
    return folder, said


def identify(folder: Path, *arguments: str) -> dict:
    """JSON of the verb."""
    with pytest.MonkeyPatch.context() as patch, (folder / "said.json").open("w", encoding="utf-8") as stdout:
        patch.setattr("sys.stdout", stdout)
        code = run(["identify", *arguments, "--out", str(folder / "card.toml"), "--json"])
    assert code == 0
    return json.loads((folder / "said.json").read_text(encoding="utf-8"))


PLANTED = {
    **DRIVE,
    "ratio": 1.0713,
    "sigma2": 0.0317,
    "tau_c": 0.1037,
    "load_dependence.k": LOAD_SHARE,
    "x_out.tendon_elasticity.compliance": COMPLIANCE,
    "tau_in.delay.T_d": DELAY,
}


def test_model_with_effects_and_nuisance_by_the_command_line(drive: tuple[Path, dict]) -> None:
    _, said = drive
    for name, true in PLANTED.items():
        p = said["parameters"][name]
        assert abs(p["value"] - true) < 4.0 * p["stderr"], name
        assert p["stderr"] < 0.2 * true or name == "beta", name
    for name, x in OFFSETS.items():
        b = said["per_run"][name]["parameters"]["tau_in.offset_drift.b"]
        assert abs(b["value"] - 0.1 * x) < 4.0 * b["stderr"]
    assert said["parameters"]["tau_in.offset_drift.c"]["fixed"]
    assert math.isclose(said["measured"]["tau_in"]["rmse"], 0.002, rel_tol=0.05)


def test_card_holds_the_nuisance_effects_and_starts_another_fit(drive: tuple[Path, dict]) -> None:
    folder, said = drive
    card = read_card(folder / "card.toml")
    assert card.effects == ("load_dependence", "tendon_elasticity@x_out", "delay@tau_in", "offset_drift@tau_in")
    assert card.params("b") is not None
    other = folder / "again"
    other.mkdir()
    start = str(folder / "card.toml")
    again = identify(other, start, "--measured", str(folder / "a.csv"), "--nuisance", "offset@tau_in")
    assert read_card(other / "card.toml").effects == card.effects
    assert again["parameters"]["tau_in.delay.T_d"]["value"] == pytest.approx(DELAY, abs=0.001)
    assert again["measured"]["x_out"]["rmse"] <= said["per_run"]["a"]["channels"]["x_out"]["rmse"] * 1.01


def test_report_page_shows_the_fit(drive: tuple[Path, dict]) -> None:
    folder, said = drive
    page = (folder / "card.html").read_text(encoding="utf-8")
    assert said["report"] == str(folder / "card.html")
    for name in PLANTED:
        assert f">{name}</td>" in page
    assert f"{said['parameters']['ratio']['value']:.5g}" in page
    for shown in ("Loop of tau_in, run b (measured)", "over speed of x_in", "over time", "over x_in", "SHA-256"):
        assert shown in page, shown
    assert "http://" not in page.replace("http://www.w3.org", "").split("<body>")[1]


@pytest.mark.parametrize(
    ("report", "message"),
    [("page.htm", "expected a name that ends in .html"), ("no/page.html", "expected a folder that exists")],
)
def test_wrong_report_is_refused_before_the_fit(
    report: str, message: str, drive: tuple[Path, dict], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["TendonDrive", "--measured", str(drive[0] / "a.csv"), "--out", str(tmp_path / "card.toml")]
    assert run(["identify", *arguments, "--report", str(tmp_path / report)]) == 2
    assert message in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
