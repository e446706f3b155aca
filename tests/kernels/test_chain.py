"""Chains: a model with effects is one pure step, and neutral effects leave it alone."""

import numpy as np
import pytest

from tsm_fmu import InputError
from tsm_fmu.effects import EFFECTS, nonlocal_memory
from tsm_fmu.kernels.chain import attach, chain
from tsm_fmu.kernels.drives import ANGLE
from tsm_fmu.kernels.kernel import Kernel, kernel
from tsm_fmu.models import MODELS
from tsm_fmu.models.contract import Condition

CARRIERS = [module.NAME for module in MODELS if Kernel(module).roles.friction]
MOTION = ["offset_drift@x_out", "backlash@x_out", "delay@x_in", "tendon_elasticity@x_out", "sensor_lag@tau_in"]


def excitation(k: Kernel, seed: int, rows: int = 1200) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    grid = np.linspace(0.0, 24.0, rows)
    columns = [np.interp(grid, np.arange(25), rng.normal(size=25)) for _ in k.inputs]
    return np.arange(rows) * 1.3e-3, np.column_stack(columns)


def possible(name: str) -> tuple[str, ...]:
    """Every effect that the model can carry, at its first place; what adds an input apart."""
    found = []
    for module in EFFECTS:
        if {"bend", "temperature"} & set(module.Inputs._fields):
            continue
        try:
            found.append(attach(kernel(name), module.NAME).spec)
        except InputError:
            continue
    return tuple(found)


@pytest.mark.parametrize("name", CARRIERS)
def test_with_its_defaults_a_chain_of_everything_is_the_model_bit_for_bit(name):
    model = kernel(name)
    extended = chain(name, possible(name))
    time, inputs = excitation(model, seed=11)
    alone = model.simulate(model.params(), time, inputs)
    assert np.array_equal(extended.simulate(extended.params(), time, inputs, compiled=False), alone)


def test_compiled_and_plain_chains_agree_bit_for_bit():
    k = chain("TendonDrive", ("load_dependence", "stribeck", *MOTION))
    values = {
        "load_dependence.k": 0.37,
        "stribeck.dF": 0.013,
        "x_out.backlash.w": 0.021,
        "x_in.delay.T_d": 0.0113,
        "x_out.tendon_elasticity.compliance": 0.31,
    }
    time, inputs = excitation(k, seed=12)
    p = k.params(None, values)
    assert np.array_equal(k.simulate(p, time, inputs), k.simulate(p, time, inputs, compiled=False))


def test_the_estimator_inverts_the_drive_with_load_dependent_friction():
    """The load that the friction depends on is itself estimated: an implicit equation, solved to rounding."""
    effects = ("load_dependence", "tendon_elasticity@x_out")
    values = {"ratio": 0.92, "load_dependence.k": 0.37, "x_out.tendon_elasticity.compliance": 0.31}
    drive, estimator = chain("TendonDrive", effects), chain("DistalEstimator", effects)
    time = np.arange(6000) * 1.1e-3
    x, tau = 0.7 * np.sin(2.3 * time), 0.05 + 0.11 * np.sin(3.1 * time)
    out = drive.simulate(drive.params(None, values), time, np.column_stack([x, tau]))
    back = estimator.simulate(estimator.params(None, values), time, np.column_stack([x, out[:, 2]]))
    assert np.abs(back[:, 1] - tau).max() < 1e-14
    assert np.abs(back[:, 0] - out[:, 0]).max() < 1e-14


def test_friction_that_outgrows_the_load_is_refused_with_the_reason():
    k = chain("DistalEstimator", ("load_dependence",))
    time = np.arange(3000) * 1e-3
    inputs = np.column_stack([np.sin(3.0 * time), 0.3 * np.cos(time)])
    with pytest.raises(InputError, match="no load fits: the friction grows faster than the load"):
        k.simulate(k.params(None, {"load_dependence.k": 2.7}), time, inputs)


def test_load_dependence_widens_the_loop_by_twice_k_times_the_load():
    plain, loaded = kernel("TendonDrive"), chain("TendonDrive", ("load_dependence",))
    time = np.arange(20_000) * 1e-3
    x = np.sin(2.0 * np.pi * 0.2 * time)
    inputs = np.column_stack([x, np.full_like(x, 0.13)])
    narrow = plain.simulate(plain.params(), time, inputs)[:, 2]
    wide = loaded.simulate(loaded.params(None, {"load_dependence.k": 0.37}), time, inputs)[:, 2]
    last = time > 10.0
    middle = last & (np.abs(x) < 0.3)
    up = middle & (np.gradient(x) > 0)
    down = middle & (np.gradient(x) < 0)
    growth = (wide[up].mean() - wide[down].mean()) - (narrow[up].mean() - narrow[down].mean())
    assert growth == pytest.approx(2 * 0.37 * 0.13, rel=1e-6)


def test_units_of_an_effect_follow_what_it_acts_on():
    k = chain("TendonDrive", ("load_dependence", "viscous", "tendon_elasticity@x_out", "offset_drift@tau_in"))
    units = {v.name: v.quantity.unit for v in k.parameters}
    assert units["load_dependence.k"] == "1"
    assert units["viscous.f_v"] == "N.m.s/rad"
    assert units["x_out.tendon_elasticity.compliance"] == "rad/(N.m)"
    assert units["tau_in.offset_drift.c"] == "N.m/s"
    for model, unit in (("TendonDrive", "rad"), ("SingleTsmDahl", "m")):
        found = {v.name: v.quantity.unit for v in chain(model, ("coulomb",)).parameters}
        assert found["motion.x_pre"] == unit


def test_a_measured_sheath_angle_becomes_an_input():
    k = chain("TendonDrive", ("bend_angle",))
    assert [v.name for v in k.inputs] == ["x_in", "tau_out", "Theta"]


@pytest.mark.parametrize("effects", [(), ("coulomb",)])
def test_a_model_can_listen_to_the_sheath_angle_without_using_it(effects):
    rng = np.random.default_rng(31)
    t, inputs = np.arange(90) * 0.0113, np.cumsum(rng.normal(size=(90, 3)), axis=0)
    plain, listening = chain("TendonDrive", effects), chain("TendonDrive", effects, (ANGLE,))
    assert [v.name for v in listening.inputs] == ["x_in", "tau_out", "Theta"]
    found = listening.simulate(listening.params(None, {}), t, inputs)
    assert np.array_equal(found, plain.simulate(plain.params(None, {}), t, inputs[:, :2]))
    assert chain("TendonDrive", ("bend_angle",), (ANGLE,)).inputs == chain("TendonDrive", ("bend_angle",)).inputs


def test_parameters_that_no_effect_uses_are_not_declared():
    names = {v.name for v in chain("TendonDrive", ("offset_drift@x_out",)).parameters}
    assert not any(name.startswith("motion.") for name in names)
    assert "motion.x_pre" in {v.name for v in chain("TendonDrive", ("load_dependence",)).parameters}


def test_one_chain_is_made_once():
    assert chain("TendonDrive", ("coulomb",)) is chain("TendonDrive", ("coulomb",))
    assert chain("TendonDrive", ()) == kernel("TendonDrive")


@pytest.mark.parametrize(
    ("model", "effects", "message"),
    [
        ("TendonDrive", ("frobnicate",), r"effect 'frobnicate' -- expected one of coulomb"),
        ("TendonDrive", ("coulomb@x_out",), r"'coulomb@x_out' on TendonDrive -- it can act on the friction"),
        ("TendonDrive", ("backlash@nowhere",), r"it can act on x_out, v_in, tau_in, x_in, tau_out"),
        ("TendonDrive", ("coulomb", "coulomb"), r"expected each effect once"),
        ("PairedTsmBacklash", ("tendon_elasticity",), r"it needs a load"),
        ("PairedTsmBacklash", ("coulomb",), r"it has no place there"),
        ("Sum", ("drum_periodic",), r"it needs a motion"),
        ("Nothing", ("coulomb",), r"model 'Nothing' -- expected one of"),
    ],
)
def test_what_makes_no_sense_is_refused_with_what_would(model, effects, message):
    with pytest.raises(InputError, match=message):
        chain(model, effects)


def test_a_holding_estimator_keeps_the_load_through_a_reversal_and_finds_it_while_sliding():
    """The friction turns at once where the estimator's presliding takes its time: Eq (D2) spikes, Eq (D3) does not."""
    k = chain("DistalEstimator", ("load_dependence",))
    values = {"ratio": 0.92, "tau_c": 0.044, "tau_s": 0.044, "sigma2": 0.0, "load_dependence.k": 0.37}
    time = np.arange(8000) * 1e-3
    x = 0.5 * np.sin(2.0 * np.pi * 0.5 * time)
    load = -0.08 + 0.01 * np.sin(0.7 * time)
    side = np.sign(np.cos(2.0 * np.pi * 0.5 * time))
    tau_in = 0.92 * load + side * (0.044 + 0.37 * np.abs(load))
    errors = {}
    for hold in (0, 1):
        p = k.params(None, {**values, "hold": hold})
        estimated = k.simulate(p, time, np.column_stack([x, tau_in]))[:, 1]
        assert np.array_equal(k.simulate(p, time, np.column_stack([x, tau_in]), compiled=False)[:, 1], estimated)
        errors[hold] = np.abs(estimated - load)[time > 1.5]
    slow = 0.01 * 0.7 * 1.0  # the load's change within half a period, the longest time it is held
    assert errors[1].max() < slow
    assert errors[0].max() > 0.05


def test_a_holding_estimator_is_not_misled_by_a_run_that_begins_just_before_a_reversal():
    """The drive comes to its end within a thousandth of the way that turns its friction: this has not turned yet."""
    k = chain("DistalEstimator", ("load_dependence",))
    values = {"ratio": 1.03, "tau_c": 0.0031, "tau_s": 0.0031, "sigma0": 4257.0, "sigma1": 1e4, "sigma2": 0.0}
    values |= {"load_dependence.k": 0.41, "motion.x_pre": 0.023, "hold": 1}
    time = np.arange(4000) * 1e-3
    x = 5e-4 * np.sin(2.0 * np.pi * time) * (time < 0.5) - 0.4 * np.maximum(time - 0.5, 0.0)
    load = np.full(time.size, -0.081)
    tau_in = 1.03 * load - (0.0031 + 0.41 * 0.081)  # the friction of the motion before the run, which goes on after it
    u = np.column_stack([x, tau_in])
    estimated = k.simulate(k.params(None, values), time, u)[:, 1]
    unseen = 0.1 * 0.41 * 0.081  # held once nine tenths of the friction are there
    assert np.abs(estimated - load)[time > 0.8].max() < unseen
    unaware = k.simulate(k.params(None, {**values, "motion.x_pre": 1e-6}), time, u)[:, 1]
    assert np.abs(unaware - load)[time > 0.8].max() > 0.03, "where friction turns at once, it has"


def test_a_holding_estimator_waits_for_friction_that_is_nothing_at_the_load_of_the_moment():
    """While the drive stands its torque passes a load without this friction: nothing has slid, and no load is known."""
    k = chain("DistalEstimator", ("load_dependence",))
    values = {"ratio": 1.03, "tau_c": 0.0307, "tau_s": 0.0307, "sigma0": 4257.0, "sigma1": 0.0, "sigma2": 0.0}
    values |= {"load_dependence.k": 0.41, "load_dependence.l_0": 0.0493, "motion.x_pre": 0.023, "hold": 1}
    time = np.arange(3000) * 1e-3
    x = -5e-4 * (time > 0.01) + 0.4 * np.maximum(time - 0.5, 0.0)
    load = -0.081
    level = 0.0307 + 0.41 * (0.081 - 0.0493)
    tau_in = 1.03 * load + level * np.interp(time, [0.05, 0.45], [-1.0, 1.0])
    estimated = k.simulate(k.params(None, values), time, np.column_stack([x, tau_in]))[:, 1]
    assert np.abs(estimated[(time > 0.05) & (time < 0.45)]).min() < 0.0493, "the torque passes such a load"
    unseen = 0.1 * 0.41 * (0.081 - 0.0493) / (1.03 - 0.41)  # a larger load makes for more friction
    assert np.abs(estimated - load)[time > 0.8].max() < unseen


def test_an_effect_that_changes_nothing_does_not_change_when_a_load_is_held():
    base, k = kernel("DistalEstimator"), chain("DistalEstimator", ("load_dependence", "viscous"))
    time = np.arange(3000) * 1e-3
    x = 0.31 * np.sin(2.0 * np.pi * 0.7 * time + 1.5)
    u = np.column_stack([x, 0.07 * np.sin(1.3 * time) + 0.02 * np.sign(np.gradient(x))])
    values = {"hold": 1, "tau_c": 0.021, "tau_s": 0.03}
    expected = base.simulate(base.params(None, values), time, u)
    assert np.array_equal(k.simulate(k.params(None, values), time, u), expected)


def test_viscous_friction_does_not_keep_an_estimator_from_holding():
    """The bristles carry no viscous friction: they have their sliding deflection however fast the drive is."""
    k = kernel("DistalEstimator")
    values = {"tau_c": 1e-5, "tau_s": 0.0372, "v_s": 1.046, "sigma0": 1.725, "sigma1": 0.0, "sigma2": 0.026}
    time = np.arange(8000) * 1e-3
    x, v = 0.5 * np.sin(np.pi * time), 0.5 * np.pi * np.cos(np.pi * time)
    level = 1e-5 + 0.03719 * np.exp(-((v / 1.046) ** 2)) + 0.026 * np.abs(v)
    tau_in = -0.08 + np.sign(v) * level
    errors = {}
    for hold in (0, 1):
        p = k.params(None, {**values, "ratio": 1.0, "hold": hold, "tau_v": 1e-3})
        estimated = k.simulate(p, time, np.column_stack([x, tau_in]))[:, 1]
        errors[hold] = np.abs(estimated + 0.08)[time > 1.5].max()
    assert errors[0] > 0.05
    assert errors[1] < 1e-3


def longer(p):
    return p.x_2 - p.x_1


def test_a_condition_of_an_effect_holds_in_the_chain_under_its_name(monkeypatch):
    rule = Condition("x_1 < x_2", longer, "x_1 = {x_1!r} with x_2 = {x_2!r} leaves {margin:.3f}", "raise x_2")
    monkeypatch.setattr(nonlocal_memory, "CONDITIONS", (rule,), raising=False)
    for where in ("TendonDrive", "LuGreFriction"):
        k = chain.__wrapped__(where, ("coulomb", "nonlocal_memory"))
        assert k.params(None, {"nonlocal_memory.x_1": 0.039})
        with pytest.raises(InputError) as raised:
            k.params(None, {"nonlocal_memory.x_1": 0.0517})
        assert str(raised.value) == (
            "nonlocal_memory: x_1 = 0.0517 with x_2 = 0.04 leaves -0.012 -- expected x_1 < x_2 -- raise x_2"
        )
    with pytest.raises(InputError, match=r"^beta = -1\.7 with c = 1\.00056 gives B = "):
        chain("TendonDrive", ("coulomb",)).params(None, {"beta": -1.7})
