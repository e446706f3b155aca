"""Units on their way from one FMU to another: affine, both ways, and as files define them."""

from types import SimpleNamespace

import numpy as np
import pytest

from tsm_fmu import InputError
from tsm_fmu.cosim.conversion import conversion

IN_KELVIN = {"K": (1.0, 0.0), "degC": (1.0, 273.15), "degF": (5.0 / 9.0, 459.67 * 5.0 / 9.0), "mK": (1e-3, 0.0)}
"""Factor and offset to K, from their definitions."""


@pytest.mark.parametrize("source", IN_KELVIN)
@pytest.mark.parametrize("target", IN_KELVIN)
def test_temperatures_go_by_way_of_kelvin_and_come_back(source, target):
    scale, shift = conversion(source, target, "a -> b joins", ({}, {}))
    back, behind = conversion(target, source, "b -> a joins", ({}, {}))
    values = np.array([-40.0, 0.0, 36.6, 451.0])
    kelvin = IN_KELVIN[source][0] * values + IN_KELVIN[source][1]
    there = scale * values + shift
    assert there == pytest.approx((kelvin - IN_KELVIN[target][1]) / IN_KELVIN[target][0], rel=1e-12, abs=1e-9)
    assert back * there + behind == pytest.approx(values, abs=1e-9)


def defined(factor: float, offset: float, **exponents: int) -> SimpleNamespace:
    whole = dict.fromkeys(("kg", "m", "s", "A", "K", "mol", "cd", "rad"), 0) | exponents
    return SimpleNamespace(factor=factor, offset=offset, **whole)


def test_units_that_files_define_themselves():
    """3.7 notches are a radian and 5 notches are its zero; the other file counts from 2 in steps of 0.25 rad."""
    notch = {"notch": defined(1.0 / 3.7, -5.0 / 3.7, rad=1)}
    tick = {"tick": defined(0.25, 0.5, rad=1)}
    scale, shift = conversion("notch", "tick", "a -> b joins", (notch, tick))
    radians = (12.0 - 5.0) / 3.7
    assert scale * 12.0 + shift == pytest.approx((radians - 0.5) / 0.25, rel=1e-12)
    assert conversion("notch", "rad", "a -> b joins", (notch, {})) == pytest.approx((1.0 / 3.7, -5.0 / 3.7), rel=1e-12)
    force = {"notch": defined(1.0, 0.0, kg=1, m=1, s=-2)}
    with pytest.raises(InputError, match=r"^a -> b joins \[notch\] to \[tick\] -- expected units that convert"):
        conversion("notch", "tick", "a -> b joins", (force, tick))
    without = {"notch": defined(1.0, 0.0)}  # no exponent at all: a name that its tool does not know either
    with pytest.raises(InputError, match=r"\[notch\] to \[rad\]"):
        conversion("notch", "rad", "a -> b joins", (without, {}))


def test_one_takes_and_gives_anything_only_where_that_is_allowed():
    assert conversion("1", "N.m", "a -> b joins", ({}, {})) == (1.0, 0.0)
    assert conversion("degC", "1", "a -> b joins", ({}, {})) == (1.0, 0.0)
    assert conversion("furlong_per_x", "furlong_per_x", "a -> b joins", ({}, {}), any_to_one=False) == (1.0, 0.0)
    with pytest.raises(InputError, match=r"\[1\] to \[N.m\]"):
        conversion("1", "N.m", "a -> b joins", ({}, {}), any_to_one=False)
