"""Which effects can be asked about at all: each is a candidate, or is said with a reason not to apply."""

from __future__ import annotations

import numpy as np
import pytest

from tsm_fmu.diagnosis.fits.placing import not_applicable, places_of_effect, play_before_friction, possible
from tsm_fmu.effects import EFFECTS, id_of, words
from tsm_fmu.kernels.chain import attach, chain
from tsm_fmu.kernels.drives import Drive
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.models.contract import InputError

READ = {m.NAME for m in EFFECTS if m.ABOUT.role == "read"}


@pytest.mark.parametrize(
    ("model", "channels"),
    [
        ("LuGreFriction", ("F",)),
        ("PairedTsmBacklash", ("x_out",)),
        ("TendonDrive", ("x_out", "tau_in")),
        ("TendonDrive", ("x_out",)),
        ("SingleTsmDahl", ("F",)),
        ("PairedTsmFriction", ("F",)),
        ("DcMotor", ("omega",)),
    ],
)
def test_each_effect_is_a_candidate_or_has_a_reason(model: str, channels: tuple[str, ...]) -> None:
    base = kernel(model)
    candidates = {c.module.NAME for c in possible(model, channels, ())}
    reasons = not_applicable(base, channels)
    assert candidates.isdisjoint(reasons)
    assert candidates | set(reasons) | READ == {m.NAME for m in EFFECTS}
    assert all(len(why.split()) > 3 for why in reasons.values())


def test_friction_that_no_measured_channel_holds_is_no_place() -> None:
    base = kernel("TendonDrive")
    (coulomb,) = [m for m in EFFECTS if m.NAME == "coulomb"]
    assert [a.spec for a in places_of_effect(base, coulomb, ("x_out", "tau_in"))] == ["coulomb"]
    assert places_of_effect(base, coulomb, ("x_out",)) == []


@pytest.mark.parametrize(
    ("model", "channels", "there"),
    [
        ("LuGreFriction", ("F",), True),  # driven by a speed
        ("SingleTsmBoucWen", ("F",), True),
        ("TendonDrive", ("tau_in",), True),
        ("TendonDrive", ("x_out", "tau_in"), False),  # play shows in what else moves
        ("TendonDrive", ("x_out",), False),  # no friction is measured
        ("PairedTsmBacklash", ("x_out",), False),  # nor is there any
    ],
)
def test_play_may_stand_before_a_friction_that_alone_is_measured(
    model: str, channels: tuple[str, ...], there: bool
) -> None:
    base = kernel(model)
    plays = play_before_friction(base, channels)
    assert set(plays) == ({"backlash", "smooth_backlash"} if there else set())
    candidates = {c.spec for c in possible(model, channels, ())}
    before = {f"{one}@{base.motion}" for one in ("backlash", "smooth_backlash")}
    assert before & candidates == (before if there else set())
    assert set(plays).isdisjoint(not_applicable(base, channels))
    assert all(words(spec).endswith("backlash before the friction") for spec in before)


def test_what_the_model_was_given_with_is_said_to_be_there() -> None:
    base = chain("TendonDrive", ("inertia", "backlash@x_out"))
    reasons = not_applicable(base, ("x_out", "tau_in"))
    assert reasons["inertia"] == reasons["backlash"] == "it is in the model as given"
    assert set(map(id_of, ("inertia", "backlash@x_out"))) <= set(reasons)
    assert np.count_nonzero([why == "it is in the model as given" for why in reasons.values()]) == 2


def test_a_law_that_adds_the_load_to_the_friction_wants_one_unit_of_both() -> None:
    """The load of PairedTsmFriction is a torque and its friction a force; a tension in the log is a force."""
    base = kernel("PairedTsmFriction")
    with pytest.raises(InputError, match=r"adds the load to the friction, and N\.m is not N -- name a column"):
        attach(base, "drive_direction")
    # which side drives is asked of a model that has a drive's side
    missing = "it needs a torque or a tension at the drive's side"
    assert not_applicable(base, ("F",))["drive_direction"].startswith(missing)
    with_tension = Drive("load", "T", "N")
    assert "drive_direction" not in {c.module.NAME for c in possible(base.name, ("F",), (), [with_tension])}
    assert attach(base, "drive_direction~T[N]").spec == "drive_direction~T[N]"
    assert attach(kernel("TendonDrive"), "drive_direction").spec == "drive_direction"
    assert "load_dependence" not in not_applicable(base, ("F",))
