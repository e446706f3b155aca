"""What outputs of chains follow at once: what is derived from the places, against the steps on random histories."""

import pytest

from tests.effects.test_all_effects import UGLY
from tests.histories import moved
from tsm_fmu import InputError
from tsm_fmu.effects import EFFECTS
from tsm_fmu.kernels.chain import attach, chain
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.models.contract import SIGNALS

OTHERS = [
    ("PairedTsmBacklash", "load_dependence@x_out~T_2[N]"),
    ("PairedTsmFriction", "load_dependence~T_2[N]"),
    ("TendonDrive", "backlash@x_in"),
    ("SingleTsmBoucWen", "gain_error@T_in"),
    ("DistalEstimator", "delay@tau_in"),
    ("TendonDrive", "tendon_elasticity@x_out"),
    ("TendonDrive", "slack@x_out"),
    ("DistalEstimator", "wear"),
    ("LebusTransmission", "backlash@theta_out"),
]


def places():
    found = []
    for model in ("TendonDrive", "SingleTsmDahl"):
        for module in EFFECTS:
            try:
                found.append((model, attach(kernel(model), module.NAME).spec))
            except InputError:
                continue
    return [*found, *OTHERS]


def strong(model, extended):
    """Values with which the effect does something; the model keeps its own."""
    own = {v.name for v in kernel(model).parameters}
    return {
        v.name: UGLY.get(v.name.rpartition(".")[2], 0.317) if v.start in (0.0, 1.0) else v.start * 1.37
        for v in extended.parameters
        if v.name not in own and "." in v.name and not v.name.startswith("motion.") and v.kind is not int
    }


@pytest.mark.parametrize(("model", "spec"), places())
def test_an_output_that_moves_at_once_is_told_to_follow(model, spec):
    extended = chain(model, (spec,))
    inputs = [v.name for v in extended.inputs]
    assert set(extended.roles.depends) == {v.name for v in extended.outputs}
    assert {name for names in extended.roles.depends.values() for name in names} <= set(inputs)
    declared = {(o.name, i) for o in extended.outputs for i in extended.roles.depends[o.name]}
    _, at_once = moved(extended, 53, strong(model, extended))
    assert at_once - declared == set()


def test_the_natural_loop_stays_open_with_effects_that_read_no_load():
    """A drive on an inertia: its motion does not follow the torque at once, whatever wears, creeps or drifts in it."""
    load_like = {name for name in SIGNALS if name in ("load", "drive", "bend", "temperature")}
    for module in EFFECTS:
        if not load_like & set(module.Inputs._fields):
            try:
                extended = chain("TendonDrive", (module.NAME,))
            except InputError:
                continue
            assert extended.roles.depends["x_out"] == ("x_in",), module.NAME
    assert set(chain("TendonDrive", ("tendon_elasticity@x_out",)).roles.depends["x_out"]) == {"x_in", "tau_out"}
