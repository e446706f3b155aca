"""A sheath's angle in the log becomes an input of the model, if all runs have it."""

from __future__ import annotations

import numpy as np

from tsm_fmu.diagnosis.runs.sheath_angle import with_sheath_angle
from tsm_fmu.kernels.chain import chain
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import Record

T = np.arange(9) * 0.1
WITH = Record("with", T, {"x_in": T, "Theta": T}, {"x_in": "rad", "Theta": "rad"})
WITHOUT = Record("without", T, {"x_in": T}, {"x_in": "rad"})


def test_a_model_listens_only_if_every_run_has_the_angle_and_it_has_a_load() -> None:
    drive = kernel("TendonDrive")
    model, said = with_sheath_angle(drive, [WITH, WITH])
    assert ([v.name for v in model.inputs], said) == (["x_in", "tau_out", "Theta"], ())
    assert with_sheath_angle(drive, [WITHOUT]) == (drive, ())
    assert with_sheath_angle(drive, [WITH, WITHOUT]) == (drive, ("Theta is not in without: bend_angle is not tried",))
    backlash = kernel("PairedTsmBacklash")
    assert with_sheath_angle(backlash, [WITH]) == (backlash, ())


def test_a_model_keeps_its_effects() -> None:
    model, _ = with_sheath_angle(chain("TendonDrive", ("inertia",)), [WITH])
    assert "Theta" in [v.name for v in model.inputs]
    assert model.module.EFFECTS == ("inertia",)
