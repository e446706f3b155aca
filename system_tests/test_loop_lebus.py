"""LeBus drive there and back from its FMUs: closed forms of elastic error, lost motion and what compensators leave."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tsm_fmu.cosim.cases import run_cases, with_values
from tsm_fmu.scenarios import lebus_drive as scenario

MU, L, T_0, EA, R = 0.16, 1.5, 1.1, 6786.0, 0.0125
LOAD = {"m05_180": (0.5, 180.0, 0.154), "m05_540": (0.5, 540.0, 0.183), "m10_180": (1.0, 180.0, 0.198)}
LOAD["m10_540"] = (1.0, 540.0, 0.198)


@pytest.fixture(scope="module")
def cases(native_fmus):
    """All cases, and those of an ideal drive under names that end in ``.ideal``: they have closed forms."""
    units = {name: native_fmus(name) for name in scenario.FMUS}
    ideal = {
        f"{condition}.{name}.ideal": (
            scenario.loop(
                units, condition, replace(scenario.VARIANTS[name], stepper=False, lead=0.0), f"{condition}.{name}"
            ),
            scenario.EXPERIMENT,
        )
        for condition in LOAD
        for name in ("uncompensated", "hanging", "layers", "compensated", "compensated_path_only", "compensated_lugre")
    }
    return {**scenario.cases(units), **ideal}


def found(cases, name, stop=None, **values):
    """Quantities [mm] and run of one case, with values set as on the command line."""
    system, experiment = cases[name]
    case = {name: (system, experiment if stop is None else replace(experiment, stop=stop))}
    case = with_values(case, {k.replace("__", "."): str(v) for k, v in values.items()})
    (run,) = run_cases(case, record=scenario.RECORD).values()
    return {quantity: metric.value for quantity, metric in scenario.quantities(name, run).items()}, run


def pulled(condition):
    """Weight, lam, tension at the driver and stretch beyond preload [N, 1, N, mm] of a uniform bend, AME Eq (23)."""
    mass, angle, _ = LOAD[condition]
    weight, lam = mass * 9.81, MU * math.radians(angle)
    at_driver = weight * math.exp(lam)
    return weight, lam, at_driver, 1e3 * (at_driver * L * (1 - math.exp(-lam)) / lam - T_0 * L) / EA


@pytest.mark.parametrize("condition", LOAD)
def test_without_winding_strain_error_and_lost_motion_are_closed_forms(cases, condition):
    _, _, at_driver, stretch = pulled(condition)
    q, run = found(cases, f"{condition}.uncompensated.ideal", transmission__winding_strain=0)
    slack = 1e3 * LOAD[condition][2]
    assert q["forward_max"] == pytest.approx(stretch, abs=1e-9)
    assert q["reverse_max"] == pytest.approx(slack + stretch, abs=1e-9)
    assert q["lost_motion"] == pytest.approx(slack + 2 * stretch, abs=1e-9)
    assert run.columns["transmission.T_a"][780] == pytest.approx(at_driver, rel=1e-12)
    assert run.columns["transmission.T_b"][-1] == pytest.approx(at_driver, rel=1e-12)
    assert run.columns["transmission.T_a"][-1] == 0.0  # tendon a is loose on the way back


@pytest.mark.parametrize("condition", ["m05_180", "m10_540"])
def test_a_hanging_weight_needs_no_slack(cases, condition):
    weight, lam, _, _ = pulled(condition)
    q, run = found(cases, f"{condition}.hanging.ideal", transmission__winding_strain=0)
    assert q["lost_motion"] == pytest.approx(1e3 * 2 * weight * L / EA * (math.cosh(lam) - 1) / lam, abs=1e-9)
    assert np.max(run.columns["transmission.T_b"]) == 0.0
    assert run.columns["transmission.slack_b"].min() > 0.9 * LOAD[condition][2]


def test_winding_strain_and_the_reported_forward_errors(cases):
    reported = {"m05_180": 1.77, "m05_540": 3.21, "m10_180": 4.808, "m10_540": 10.37}
    ours = {}
    for condition in LOAD:
        _, _, at_driver, stretch = pulled(condition)
        q, run = found(cases, f"{condition}.uncompensated.ideal", stop=scenario.TURN)
        ours[condition] = q["forward_max"]
        follower = 1e3 * R * (run.columns["transmission.theta_out"][-1] - run.columns["transmission.theta_out"][0])
        wound = follower * (at_driver - T_0) / EA
        # the follower's first travel, before the whole tendon slides, counts in second order of the strain
        assert ours[condition] == pytest.approx(stretch + wound, rel=1e-3)
    rms = math.sqrt(np.mean([(ours[c] - reported[c]) ** 2 for c in LOAD]))
    assert rms == pytest.approx(0.85, abs=0.01)  # what one EA inside the fibre's range can do


@pytest.mark.parametrize("condition", ["m05_180", "m10_540"])
def test_compensation_leaves_what_the_compensator_does_not_know(cases, condition):
    weight, _, at_driver, _ = pulled(condition)
    perfect, _ = found(cases, f"{condition}.compensated.ideal")
    assert perfect["forward_max"] < 1e-9
    assert perfect["reverse_max"] < 1e-9
    strain = (at_driver - T_0) / EA
    path, run = found(cases, f"{condition}.compensated_path_only.ideal", stop=scenario.TURN)
    travel = 1e3 * R * (run.columns["transmission.theta_out"][-1] - run.columns["transmission.theta_out"][0])
    assert path["forward_max"] == pytest.approx(strain * travel, rel=1e-3)
    lugre, _ = found(cases, f"{condition}.compensated_lugre.ideal", stop=scenario.TURN)
    # f = mu T + sigma2 v stretches by f L/EA; the follower turns by 1/(1 + strain) of the driver while it winds
    term = 1e3 * (MU * weight + 4.3 * 0.05) * L / EA
    assert -lugre["forward_end"] == pytest.approx(term / (1 + strain), rel=1e-6)


def test_without_compensation_the_slack_shows_and_with_it_does_not(cases):
    for condition in ("m05_180", "m10_540"):
        q, _ = found(cases, f"{condition}.uncompensated")
        assert q["reverse_max"] == pytest.approx(scenario.REVERSE_MM[condition], rel=0.01)
        wrong, _ = found(cases, f"{condition}.compensated.ideal", compensator__slack=LOAD[condition][2] - 0.0015)
        assert wrong["forward_max"] < 1e-9
        assert wrong["reverse_max"] == pytest.approx(1.5, abs=1e-2)  # the driver turns back too little by that


def turned_back(run, row):
    """Angle by which the torque turns the stepper back, as tendon [mm]; a micro-step may be missing."""
    return 1e3 * R * math.asin(float(run.columns["torque.y"][row]) / 1.9) / 50.0


MICROSTEP = 1e3 * R * math.radians(1.8) / 16


@pytest.mark.parametrize("condition", ["m05_180", "m10_540"])
def test_the_stepper_adds_what_the_torque_turns_it_back(cases, condition):
    """The whole drive: stretch, and the give of the motor under load and wheel friction, there and at its turn."""
    _, _, at_driver, stretch = pulled(condition)
    q, run = found(cases, f"{condition}.uncompensated", transmission__winding_strain=0)
    turn = int(np.argmax(run.columns["reference.y"])) - 1
    assert q["forward_end"] == pytest.approx(stretch + turned_back(run, turn), abs=2 * MICROSTEP)
    # wheel friction of the layer that is wound, on the torque of the load
    slipped = 0.16 * at_driver * 2 / 0.025 * scenario.SLIP
    assert q["wheel_friction_max"] == pytest.approx(2 / math.sqrt(3) * slipped, rel=2e-3)
    radius = R + 0.305e-3 / 2 + 0.305e-3 * math.sqrt(3) / 2  # of the second layer
    expected = at_driver * R + 2 / math.sqrt(3) * slipped * radius
    assert run.columns["torque.y"][turn] == pytest.approx(expected, rel=5e-3)
    # on the way back friction on the wheel still opposes the motor, which now pulls with tendon b
    assert run.columns["torque.y"][-20] == pytest.approx(-(at_driver * R + slipped * (R + 0.305e-3 / 2)), rel=5e-3)
    assert abs(run.columns["stepper.theta"] - run.columns["reference.y"]).max() < math.tau / 50  # no step is lost


def test_under_a_hanging_weight_wheel_friction_helps_the_motor_on_the_way_back(cases):
    _, run = found(cases, "m05_180.hanging")
    there, back = 700, 1400
    assert run.columns["winding.F_w"][there] > 0.5
    assert run.columns["torque.y"][there] > run.columns["transmission.T_a"][there] * R
    assert run.columns["torque.y"][back] < run.columns["transmission.T_a"][back] * R


def test_a_stepper_loses_steps_where_a_compensator_asks_for_the_slack_at_once(cases):
    _, run = found(cases, "m05_180.compensated_jump")
    turn = int(np.argmax(run.columns["reference.y"]))
    off = run.columns["compensator.theta_ff"] - run.columns["stepper.theta"]
    assert abs(off[2:turn]).max() < math.tau / 50
    assert abs(off[-1]) > 10 * math.tau / 50  # whole tooth pitches are lost


@pytest.mark.parametrize("condition", ["m05_180", "m10_540"])
def test_with_a_highest_speed_the_stepper_takes_up_the_slack_and_gives_way_only_under_its_load(cases, condition):
    q, run = found(cases, f"{condition}.compensated")
    turn = int(np.argmax(run.columns["reference.y"]))
    assert abs(q["forward_end"] - turned_back(run, turn - 1)) < 2 * MICROSTEP
    # tendon that is wound while it waits has another strain than the compensator, which knows no motor, counts on
    strain = (pulled(condition)[2] - T_0) / EA
    assert q["reverse_settled"] < abs(turned_back(run, -20)) + 3 * MICROSTEP + strain * q["reverse_max"]
    # while the motor takes up the slack the reference goes on, and the tendon a that is let go springs back
    waited = 1e3 * LOAD[condition][2] * 0.05 / 0.25
    assert waited < q["reverse_max"] < waited + 2.0 * pulled(condition)[3]
    take_up = scenario.take_up(condition, scenario.VARIANTS["compensated"])
    assert take_up == pytest.approx(LOAD[condition][2] / (0.25 - 0.05))
    assert np.diff(run.columns["stepper.theta"]).min() / scenario.STEP > -1.1 * scenario.RATE


@pytest.mark.parametrize("variant", ["uncompensated", "compensated"])
def test_the_weight_is_lifted_by_the_work_of_its_torque(cases, variant):
    """The follower lifts it on the way there by tendon a, is at rest while it is set down, and lifts it by tendon b."""
    _, run = found(cases, f"m10_180.{variant}")
    angle, torque, lift = (run.columns[c] for c in ("transmission.theta_out", "load.tau", "load.h"))
    late = np.sum(torque[2:] * np.diff(angle)[:-1])  # the angle comes to the load one step late
    assert late == pytest.approx(9.81 * (lift[-1] - lift[0]), rel=1e-6)
    assert lift[-1] > 1.57 - 0.02 - (LOAD["m10_180"][2] if variant == "uncompensated" else 0.05)
    assert set(np.round(np.unique(torque) / (9.81 * R), 12)) == {-1.0, 0.0, 1.0}


def test_layers_alone_peak_at_two_thirds_of_the_stroke(cases):
    """Inextensible and without friction the radii decide: r_2/r_1 until the driver's layer is full, 1, then r_1/r_2."""
    rigid = {"transmission__EA": 1e12, "transmission__mu": 0, "transmission__T_0": 0}
    q, run = found(cases, "m10_540.layers.ideal", stop=scenario.TURN, **rigid)
    r_1 = 12.5 + 0.305 / 2
    r_2 = r_1 + 0.305 * math.sqrt(3) / 2
    theta = run.columns["reference.y"]
    layer = 2 * math.pi * 6.67
    wound = theta * r_1 + np.maximum(theta - layer, 0) * (r_2 - r_1)
    full = layer * r_2
    follower = np.where(wound < full, wound / r_2, layer + (wound - full) / r_1)
    expected = 12.5 * (theta - follower)
    np.testing.assert_allclose(scenario.error_mm(run), expected, atol=1e-6)
    plateau = (12.5 * layer, 12.5 * (layer + (full - layer * r_1) / r_2))  # both wheels on their second radius
    assert plateau[0] - 1.0 < q["forward_max_at"] < plateau[1] + 1.0
    assert plateau[0] == pytest.approx(785 * 2 / 3, rel=0.01)
    assert q["forward_end"] < 0.6 * q["forward_max"]
