"""The declaration of variables and the checks that hold for every model."""

import math
from typing import Annotated, NamedTuple

import pytest

from tsm_fmu import InputError
from tsm_fmu.models.contract import Quantity, check_bounds, variables


class Declared(NamedTuple):
    lambda_: Annotated[float, Quantity("rad/s", "lead of the reversal")] = 0.156
    count: Annotated[int, Quantity("1", "number of layers", lo=1, hi=8)] = 2
    share: Annotated[float, Quantity("1", "share of power", lo=0.0, hi=1.0, open_lo=True)] = 0.5
    slope: Annotated[float, Quantity("1/rad", "slope", hi=0.0, open_hi=True)] = -2.0
    creep__tau: Annotated[float, Quantity("s", "time constant of an effect", lo=0.0)] = 1.0


class Undeclared(NamedTuple):
    sigma: float = 1.0


class WithoutDefault(NamedTuple):
    x: Annotated[float, Quantity("m", "position")]
    n: Annotated[int, Quantity("1", "count")]


def test_variables_keep_order_and_public_names() -> None:
    assert [(v.name, v.field, v.kind, v.start) for v in variables(Declared)] == [
        ("lambda", "lambda_", float, 0.156),
        ("count", "count", int, 2),
        ("share", "share", float, 0.5),
        ("slope", "slope", float, -2.0),
        ("creep.tau", "creep__tau", float, 1.0),
    ]
    assert variables(Declared)[2].quantity == Quantity("1", "share of power", 0.0, 1.0, True, False, "")


def test_a_field_without_default_starts_at_zero() -> None:
    starts = [v.start for v in variables(WithoutDefault)]
    assert starts == [0.0, 0]
    assert [type(start) for start in starts] == [float, int]


def test_a_field_without_quantity_is_a_defect() -> None:
    with pytest.raises(TypeError, match=r"Undeclared\.sigma is not Annotated"):
        variables(Undeclared)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"share": 0.0}, r"parameter share = 0\.0 \(share of power\) -- expected a value in \(0, 1\] -- "),
        ({"share": 1.0000001}, r"parameter share = 1\.0000001 .* expected a value in \(0, 1\]"),
        ({"slope": 0.0}, r"parameter slope = 0\.0 1/rad \(slope\) -- expected a value in \(-inf, 0\) -- "),
        ({"count": 9}, r"parameter count = 9 \(number of layers\) -- expected a value in \[1, 8\] -- "),
        ({"lambda_": math.inf}, r"parameter lambda = inf rad/s .* expected a finite number -- "),
        ({"lambda_": math.nan}, r"parameter lambda = nan rad/s .* expected a finite number -- "),
        ({"creep__tau": -1e-300}, r"parameter creep\.tau = -1e-300 s .* expected a value in \[0, inf\)? -- "),
    ],
)
def test_a_value_outside_is_named_with_its_bounds(values, message) -> None:
    with pytest.raises(InputError, match=message) as raised:
        check_bounds(variables(Declared), Declared(**values))
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("values", [{}, {"share": 1.0}, {"share": 5e-324}, {"count": 1}, {"creep__tau": 0.0}])
def test_closed_bounds_belong_to_the_interval(values) -> None:
    check_bounds(variables(Declared), Declared(**values))
