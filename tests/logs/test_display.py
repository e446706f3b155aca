"""The one unit in which people read a quantity: what models declare for FMI hosts, and what pages and tables show."""

import math

import pytest

from tsm_fmu.effects import EFFECTS
from tsm_fmu.kernels.kernel import Kernel
from tsm_fmu.logs.display import display
from tsm_fmu.logs.units import unit_to_si
from tsm_fmu.models import MODELS


@pytest.mark.parametrize("module", [*MODELS, *EFFECTS], ids=lambda m: m.NAME)
def test_the_display_unit_that_a_variable_declares_is_the_one_that_is_shown(module) -> None:
    kernel = Kernel(module)
    for v in (*kernel.parameters, *kernel.inputs, *kernel.outputs):
        if v.quantity.display:
            assert display(v.quantity.unit).unit == v.quantity.display, v.name


@pytest.mark.parametrize(
    ("unit", "size", "shown"),
    [
        ("rad", math.inf, "deg"), ("rad/s", 3.0, "deg/s"), ("m", 0.37, "mm"), ("m", 3.7, "m"), ("m/s2", 0.1, "mm/s2"),
        ("N", 0.037, "mN"), ("N", 3.7, "N"), ("N.m", 0.037, "mN.m"), ("N.s/m", 0.037, "N.s/m"),
        ("1/rad", 0.01, "1/rad"), ("1", 0.01, "1"), ("kg.m2", 0.01, "kg.m2"),
    ],
)  # fmt: skip
def test_a_factor_is_that_of_the_unit(unit: str, size: float, shown: str) -> None:
    found = display(unit, size)
    assert found.unit == shown
    assert unit_to_si(shown).factor * found.factor == pytest.approx(unit_to_si(unit).factor, rel=1e-15)
