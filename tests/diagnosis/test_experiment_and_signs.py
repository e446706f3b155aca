"""The next motion stays within what the rig has shown; an answer that gives energy is said to."""

from __future__ import annotations

import numpy as np
import pytest

from tsm_fmu.diagnosis.answer.next_motion import menu, playable
from tsm_fmu.diagnosis.answer.passivity import returned_share, sign_notes
from tsm_fmu.diagnosis.fits.refit import Fitted, Task, refit
from tsm_fmu.kernels.drives import ANGLE
from tsm_fmu.regression.problem import FitRun


def fitted(effects: tuple[str, ...], values: dict[str, float]) -> Fitted:
    """LuGreFriction with effects on two sines, at the values given (one step of the descent from its own outputs)."""
    t = np.arange(2000) * 0.0113
    v = 0.9 * np.sin(1.7 * t) + 0.4 * np.sin(0.61 * t + 0.3)
    base = {"sigma0": 130.0, "sigma1": 0.0, "sigma2": 0.02, "F_c": 0.7, "F_s": 0.7, "v_s": 0.1}
    force = 0.7 * np.tanh(v / 0.01) + 0.02 * v
    run = FitRun("a", t, v[:, None], force[:, None])
    found = refit(Task("LuGreFriction", [run], ("F",), base), effects, values, steps=1)
    table = found.table.copy()
    for name, value in {**base, **values}.items():
        table[:, [found.problem.declared[f].name for f in found.problem.fields].index(name)] = value
    return Fitted(found.task, found.effects, found.problem, table)


def test_friction_takes_energy_and_a_wrong_sign_is_said() -> None:
    right = fitted((), {})
    assert returned_share(right) == 0.0
    assert sign_notes(right) == ()
    wrong = fitted(("acceleration_branches",), {
        "acceleration_branches.dF_p": -3.1, "acceleration_branches.dF_n": -3.3, "acceleration_branches.a_0": 0.1,
    })  # fmt: skip
    share = returned_share(wrong)
    assert share is not None
    assert share > 0.1
    assert "not physical" in sign_notes(wrong)[0]


def test_motions_of_the_menu_keep_to_speed_and_range() -> None:
    one = fitted((), {})
    t, v = one.problem.runs[0].time, one.problem.runs[0].inputs[:, 0]
    x = np.cumsum(v) * (t[1] - t[0])
    for name, time, inputs in menu(one):
        assert np.max(np.abs(inputs[:, 0])) <= 1.02 * np.max(np.abs(v)), name
        assert np.ptp(np.cumsum(inputs[:, 0]) * (time[1] - time[0])) <= 1.02 * np.ptp(x), name


def test_the_sheath_is_bent_within_what_the_runs_had() -> None:
    t = np.arange(2000) * 0.0113
    x, load = 0.7 * np.sin(1.7 * t) + 0.2 * np.sin(0.61 * t), 0.3 + 0.11 * np.sin(0.9 * t)
    bend = 2.0 + 0.9 * np.sin(0.21 * t)
    run = FitRun(
        "a", t, np.column_stack([x, load, bend]), (1.02 * load + 0.1 * np.tanh(np.gradient(x, t) / 0.01))[:, None]
    )
    menu_ = menu(refit(Task("TendonDrive", [run], ("tau_in",), {}, drives=(ANGLE,)), (), {}, steps=1))
    swept = {name: inputs for name, _, inputs in menu_ if "sheath angle swept" in name}
    assert len(swept) == len(menu_) / 3  # all constant, the load swept, the angle swept
    for name, inputs in swept.items():
        assert "load constant" in name
        assert (inputs[:, 2].min(), inputs[:, 2].max()) == (pytest.approx(1.1, abs=0.02), pytest.approx(2.9, abs=0.02))


def test_a_jump_becomes_a_ramp_with_round_corners() -> None:
    t = np.arange(0.0, 4.0, 0.01)
    played = playable(np.where(t < 1.0, -0.3, 0.4), t, fastest=0.37)
    speed = np.diff(played) / 0.01
    assert np.max(np.abs(speed)) <= 0.37 * (1.0 + 1e-9)
    assert np.max(np.abs(np.diff(speed))) <= 0.37 * 0.01 / 0.1 * (1.0 + 1e-6)
    assert played[-1] == pytest.approx(0.4, abs=1e-9)
