"""ICINCO 2013: the closed loop of its rig against the model on the imposed motion, and closed forms."""

import math

import numpy as np
import pytest

from tsm_fmu.reproduction.icinco2013.loop import GEAR, R, followed_mm, runs
from tsm_fmu.reproduction.motions import friction


@pytest.fixture(scope="module")
def loops():
    return runs(quick=True)


def test_the_friction_in_the_loop_is_the_model_on_the_motion_of_the_motor(loops):
    run = loops["Fig. 6.5"]
    x = R * run.columns["motor.phi"]
    v = R * run.columns["motor.omega"]
    step = run.time[1] - run.time[0]

    class Played:
        time, a = run.time, np.gradient(v, step)

    Played.x, Played.v = x, v
    # the FMU's acceleration is the motor's own; a difference of samples is near enough away from reversals
    apart = np.abs(friction("SingleTsmDahl", Played) - run.columns["plant.F"])
    assert np.median(apart[run.time > 1.0]) < 0.05


def test_the_drive_follows_five_millimetres_and_ends_with_its_voltage(loops):
    assert followed_mm(loops["Fig. 6.5"]) == pytest.approx(5.0, rel=0.03)
    assert np.abs(loops["reach"].columns["controller.u"]).max() == 24.0
    # speed without load and friction bounds it: u/(k_e N) over 2 pi f, a square wave of speed makes pi/2 of a sine's
    bound = 1e3 * R * 24.0 / (0.0349 * GEAR) / (2 * math.pi) * math.pi / 2
    assert followed_mm(loops["reach"]) < bound
