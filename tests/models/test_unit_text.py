"""Units put together from others: one text for each, and the same quantity as before."""

import pytest

from tsm_fmu.effects import EFFECTS
from tsm_fmu.kernels.chain import chain
from tsm_fmu.kernels.kernel import Kernel
from tsm_fmu.logs.units import same_quantity, unit_to_si
from tsm_fmu.models import MODELS
from tsm_fmu.models.contract import InputError
from tsm_fmu.models.unit_text import simplified


@pytest.mark.parametrize(
    ("unit", "text"),
    [
        ("N.m/(rad/s)", "N.m.s/rad"),
        ("N/(m/s)", "N.s/m"),
        ("N/(m)", "N/m"),
        ("1/(rad)", "1/rad"),
        ("N.m/(rad3)", "N.m/rad3"),
        ("N.m/(N.m)", "1"),
        ("N/(N.rad)", "1/rad"),
        ("N/(N.m.rad)", "1/(m.rad)"),
        ("rad/(N.m)", "rad/(N.m)"),
        ("rad/s/s", "rad/s2"),
        ("rad/(rad)", "1"),
        ("N/((m/s)2)", "N.s2/m2"),
        ("rad/(m.rad/s)", "s/m"),
        ("N/(rad.N.m)", "1/(rad.m)"),
    ],
)
def test_a_unit_has_one_fraction_at_most_and_is_the_same_quantity(unit: str, text: str) -> None:
    assert simplified(unit) == text
    assert same_quantity(simplified(unit), unit)
    assert simplified(simplified(unit)) == text


def test_a_root_keeps_its_exponent() -> None:
    assert simplified("N.m/((rad/s)0.5)") == "N.m.s0.5/rad0.5"


@pytest.mark.parametrize(("unit", "text"), [("N/(m/s2)", "kg"), ("N.m/(rad/s2)", "kg.m2")])
def test_what_moves_has_a_mass_or_an_inertia(unit: str, text: str) -> None:
    assert simplified(unit) == text
    assert unit_to_si(text).factor == 1.0


@pytest.mark.parametrize("module", MODELS, ids=lambda m: m.NAME)
def test_units_of_models_are_in_that_form_already(module) -> None:
    model = Kernel(module)
    for v in (*model.parameters, *model.inputs, *model.outputs):
        assert simplified(v.quantity.unit) == v.quantity.unit


@pytest.mark.parametrize("model", ["TendonDrive", "LuGreFriction", "PairedTsmFriction", "SingleTsmDahl"])
def test_units_of_chains_are_in_that_form_and_si(model: str) -> None:
    reached = 0
    for effect in EFFECTS:
        try:
            k = chain(model, (effect.NAME,))
        except InputError:
            continue
        for v in k.parameters:
            reached += 1
            assert simplified(v.quantity.unit) == v.quantity.unit, v.name
            assert unit_to_si(v.quantity.unit).factor == 1.0, v.name
    assert reached > 100


@pytest.mark.parametrize("text", [")", "((", "//", "", ".", "m)(", "/2"])
def test_a_text_that_is_no_unit_is_no_failure(text: str) -> None:
    assert isinstance(simplified(text), str)
