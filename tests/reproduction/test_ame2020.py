"""AME 2020: its loop of FMUs against closed forms, and the grooves as a calculator."""

import math

import pytest

from tsm_fmu.reproduction.ame2020.compensated import compensated_error, from_first_displacement
from tsm_fmu.reproduction.ame2020.displacement import PLAIN
from tsm_fmu.reproduction.ame2020.grooves import Grooves, faults
from tsm_fmu.reproduction.ame2020.loops import Drive, at_end, error, lost_motion, runs, travel
from tsm_fmu.reproduction.ame2020.tendon import modulus_band, solid_tex
from tsm_fmu.scenarios.lebus_drive import LEAD
from tsm_fmu.scenarios.papers import CASES

MU, L, T_0, R = 0.16, 1.5, 1.1, 0.0125


def stretch(case, EA=PLAIN):
    """Path strain of a uniform bend less that of the preload [mm], Eq. (23) with the running lambda."""
    weight = {"m05": 0.5, "m10": 1.0}[case[:3]] * 9.81
    lam = MU * math.radians(float(case[4:]))
    return 1e3 * (weight * math.exp(lam) * L * (1 - math.exp(-lam)) / lam - T_0 * L) / EA


@pytest.fixture(scope="module")
def loops():
    drives = {c: Drive(c, {"EA": PLAIN, "winding_strain": 0}, there=True) for c in CASES}
    drives["elastic"] = Drive("m05_180", {"EA": 5000.0, "winding_strain": 0, "slack": 0.0})
    drives["slip"] = Drive("m05_180", {"winding_strain": 0}, slip=5e-3, there=True)
    gain, offset = from_first_displacement("m05_180")
    drives["compensated"] = Drive("m05_180", there=True, command=(gain, offset))
    drives["eq39"] = Drive("m05_180", compensator={})
    values = {"layers": 1, "n_t": 6.67, "winding_strain": 0}
    drives["layers"] = Drive("m05_180", values, there=True, lead=LEAD)
    return runs(drives)


def turned_back(run):
    """Angle by which the load turns the stepper back, as tendon [mm]."""
    return 1e3 * R * math.asin(float(run.columns["torque.y"][-1]) / 1.9) / 50.0


@pytest.mark.parametrize("case", CASES)
def test_the_forward_error_is_the_path_strain_and_the_give_of_the_stepper(loops, case):
    microstep = 1e3 * R * math.radians(1.8) / 16
    assert at_end(loops[case]) == pytest.approx(stretch(case) + turned_back(loops[case]), abs=2 * microstep)


def test_the_stepper_follows_without_losing_a_step(loops):
    for name, run in loops.items():
        lead = abs(run.columns["stepper.theta"] - run.columns["reference.y"])
        assert lead[-1] < math.tau / 50 or name in ("compensated", "eq39")


def test_the_lost_motion_without_slack_is_twice_the_strain(loops):
    expected = 2 * stretch("m05_180", 5000.0)
    assert lost_motion(loops["elastic"]) == pytest.approx(expected, abs=0.1)


def test_wheel_friction_acts_on_the_motor(loops):
    force = loops["slip"].columns["winding.F_w"]
    assert force[-1] > 0.1
    assert turned_back(loops["slip"]) > turned_back(loops["m05_180"])


def test_the_first_displacement_compensates_all_but_a_count(loops):
    run = loops["compensated"]
    moving = travel(run) > 20.0
    count = 1e3 * R * math.radians(0.1)
    assert abs(compensated_error(run)[moving]).max() < 4 * count
    assert at_end(loops["m05_180"]) > 8 * count


def test_the_feedforward_leaves_what_the_stepper_gives_way_under_its_load(loops):
    """On the way there by the torque of tendon a, on the way back, once the slack is taken up, by that of tendon b."""
    run, microstep = loops["eq39"], 1e3 * R * math.radians(1.8) / 16
    turn = run.columns["reference.y"].argmax()
    given = [1e3 * R * math.asin(float(run.columns["torque.y"][row]) / 1.9) / 50.0 for row in (turn - 1, -20)]
    assert compensated_error(run)[[turn - 1, -20]] == pytest.approx(given, abs=2 * microstep)


def test_layers_of_6_67_turns_peak_at_two_thirds(loops):
    run = loops["layers"]
    assert travel(run)[error(run).argmax()] == pytest.approx(785 * 2 / 3, rel=0.03)  # a plateau


def test_stiffness_of_the_printed_fibre():
    assert modulus_band() == pytest.approx((4642.0, 10202.0), abs=1.0)
    assert solid_tex() == pytest.approx(71.2, abs=0.05)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, []),
        ({"pitch": 3.0e-4}, ["stacked"]),
        ({"pitch": 3.3e-4}, ["full"]),
        ({"pitch": 6.5e-4, "width": 4e-3}, ["empty"]),
        ({"distance": 0.02, "straight_deg": 90.0}, ["stacked"]),
    ],
)
def test_grooves(changes, expected):
    assert faults(Grooves(3.2e-4, 150.0, 1.6e-3, 0.1)._replace(**changes)) == expected


def test_groove_lengths_are_those_of_eq_3():
    g = Grooves(3.2e-4, 150.0, 1.6e-3, 0.1)
    assert g.straight_length + g.broken_length == pytest.approx(2 * math.pi * (0.0125 + 0.5 * 3.05e-4))
    assert 90.0 * g.straight_length / (math.pi * (0.0125 + 0.5 * 3.05e-4)) == pytest.approx(150.0)
    assert g.broken_length * math.tan(math.radians(g.groove_deg)) == pytest.approx(3.2e-4)


def test_a_groove_that_is_all_straight_is_refused():
    with pytest.raises(ValueError, match="expected above 0 and below 180"):
        faults(Grooves(3.2e-4, 180.0, 1.6e-3, 0.1))
