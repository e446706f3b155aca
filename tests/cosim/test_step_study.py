"""Observed orders and the cost of the order of exchange where both are known."""

import math

import numpy as np
import pytest

from tsm_fmu import InputError
from tsm_fmu import step_study as step_study_of
from tsm_fmu.cosim.ssp import write_ssp
from tsm_fmu.cosim.step_study import step_study
from tsm_fmu.cosim.system import Component, Connection, Experiment, System


def oscillator(foreign, w=3.1):
    x, v = Component("x", foreign["integrator"], {"x_0": 0.7}), Component("v", foreign["integrator"])
    return System((x, v), (Connection("v.x", "x.u"), Connection("x.x", "v.u", factor=-w * w)))


def test_an_oscillator_shows_first_order_and_what_jacobi_costs(foreign):
    """Jacobi gains (1 + w^2 h^2)^(1/2) a step: the amplitude at the end is 0.7 exp(w^2 h T / 2).

    Gauss-Seidel is the symplectic Euler method: one signal, the one that begins at zero, is of second order.
    """
    h, w, stop = 0.002, 3.1, 2.0
    found = {s.signal: s for s in step_study((oscillator(foreign, w), Experiment(stop, h)), 3)}
    for signal in found.values():
        assert signal.order("jacobi") == pytest.approx(1.0, abs=0.05)
        assert [math.log2(a / b) for a, b in zip(signal.exchange, signal.exchange[1:], strict=False)] == pytest.approx(
            [1.0] * 3, abs=0.1
        )
    assert {n: round(s.order("gauss-seidel"), 1) for n, s in found.items()} == {"x.x": 1.0, "v.x": 2.0}
    assert 0.1 * w * w * h * stop < found["x.x"].share < w * w * h * stop


def test_the_verb_says_whether_the_order_matters(foreign, tmp_path):
    path = write_ssp(tmp_path / "o.ssp", (oscillator(foreign), Experiment(1.0, 0.02)))
    coarse = step_study_of(path)
    assert coarse.sentence.startswith("The order of exchange matters: with Jacobi ")
    lines = {line.name: line for line in coarse.figure().lines}
    for signal in coarse.signals:  # in percent of the size, over all steps but the last, which has no half
        line = lines[f"{signal.signal}, jacobi"]
        assert tuple(line.x) == coarse.steps[:-1]
        assert np.array(line.y) * signal.size / 100.0 == pytest.approx(signal.halved["jacobi"])
    assert "iframe" in coarse._repr_html_()
    fine = step_study_of(path, step=1e-4, stop=0.1, halvings=1)
    assert fine.sentence.startswith("The order of exchange does not matter: at most ")
    assert fine.steps == (1e-4, 5e-5)
    assert len(fine.to_frame()) == 2
    with pytest.raises(InputError, match="halvings 11 -- expected 1 to 10"):
        step_study_of(path, halvings=11)
