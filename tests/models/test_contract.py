"""The declaration of variables and the checks that hold for every model."""

import math
from typing import Annotated, NamedTuple

import pytest

from tsm_fmu import InputError
from tsm_fmu.models.contract import (
    Condition,
    Quantity,
    check_bounds,
    check_conditions,
    flat,
    named,
    packed,
    sizes,
    variables,
)


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


class Ring(NamedTuple):
    r_in: Annotated[float, Quantity("m", "inner radius", lo=0.0)] = 0.31
    r_out: Annotated[float, Quantity("m", "outer radius", lo=0.0)] = 0.47
    lambda_: Annotated[float, Quantity("1", "shape")] = 1.7


def gap(p: Ring) -> float:
    return p.r_out - p.r_in


def middle(p: Ring) -> float:
    return 0.5 * (p.r_in + p.r_out)


RING = Condition(
    "r_out > {r_in:.2f} m",
    gap,
    "r_out = {r_out!r} m with lambda = {lambda!r} leaves {margin:.3f} m about {middle:.4g} m",
    "raise r_out",
    numbers={"middle": middle},
)


def test_values_by_public_name() -> None:
    assert named(Ring()) == {"r_in": 0.31, "r_out": 0.47, "lambda": 1.7}
    assert list(named(Declared())) == ["lambda", "count", "share", "slope", "creep.tau"]


def test_a_condition_that_is_not_met_is_one_line_with_its_numbers() -> None:
    wrong = Ring(r_in=0.5214)
    assert not RING.met(wrong)
    with pytest.raises(InputError) as raised:
        check_conditions((RING,), wrong)
    assert str(raised.value) == (
        "r_out = 0.47 m with lambda = 1.7 leaves -0.051 m about 0.4957 m -- expected r_out > 0.52 m -- raise r_out"
    )
    assert RING.expectation(wrong) == "r_out > 0.52 m"
    assert check_conditions((RING,), Ring()) == ()


@pytest.mark.parametrize(("closed", "met"), [(False, False), (True, True)])
def test_the_edge_belongs_to_a_closed_condition(closed, met) -> None:
    assert RING._replace(closed=closed).met(Ring(r_in=0.47)) is met
    assert not RING._replace(closed=closed).met(Ring(r_in=math.nextafter(0.47, 1.0)))
    assert RING.met(Ring(r_in=math.nextafter(0.47, 0.0)))


def test_a_margin_that_is_no_number_is_not_met() -> None:
    assert not RING._replace(closed=True).met(Ring(r_in=math.nan))


def test_a_condition_with_a_consequence_warns_where_another_one_refuses() -> None:
    warns = RING._replace(consequence="the ring is {middle:.2f} m wide")
    wrong = Ring(r_in=0.5214)
    line = "r_out = 0.47 m with lambda = 1.7 leaves -0.051 m about 0.4957 m -- the ring is 0.50 m wide -- raise r_out"
    assert check_conditions((warns,), wrong) == (line,)
    with pytest.raises(InputError, match="expected r_out"):
        check_conditions((warns, RING), wrong)


def test_a_choice_out_of_bounds_is_told_with_the_names_of_all() -> None:
    class Chosen(NamedTuple):
        law: Annotated[int, Quantity("1", "law", lo=1, hi=3, choices=("plain", "exact", "mixed"))] = 1

    with pytest.raises(InputError, match=r"expected 1 \(plain\) or 2 \(exact\) or 3 \(mixed\) -- choose"):
        check_bounds(variables(Chosen), (4,))


Two = tuple[float, float]


class Bent(NamedTuple):
    n: Annotated[int, Quantity("1", "pieces", lo=1, hi=3)] = 2
    L: Annotated[Two, Quantity("m", "length of a piece", lo=0.0, open_lo=True, display="mm")] = (0.7, 0.013)
    load__r_: Annotated[tuple[float, float, float], Quantity("m", "radius")] = (0.1, 0.2, 0.3)
    mu: Annotated[float, Quantity("1", "friction coefficient")] = 0.17


class Memory(NamedTuple):
    line: Annotated[tuple[float, float, float], Quantity("N", "what was")]


def test_a_tuple_is_its_items_numbered_from_one() -> None:
    assert [(v.name, v.field, v.kind, v.start) for v in variables(Bent)] == [
        ("n", "n", int, 2),
        ("L_1", "L_1", float, 0.7),
        ("L_2", "L_2", float, 0.013),
        ("load.r_1", "load__r__1", float, 0.1),
        ("load.r_2", "load__r__2", float, 0.2),
        ("load.r_3", "load__r__3", float, 0.3),
        ("mu", "mu", float, 0.17),
    ]
    assert variables(Bent)[2].quantity == Quantity("m", "length of a piece", lo=0.0, open_lo=True, display="mm")
    assert [v.start for v in variables(Memory)] == [0.0, 0.0, 0.0]
    assert sizes(Bent) == (0, 2, 3, 0)


def test_numbers_flat_and_packed_are_inverse() -> None:
    numbers = (3, 0.11, 0.23, 0.31, 0.43, 0.57, 0.61)
    p = packed(Bent, list(numbers))
    assert p == Bent(3, (0.11, 0.23), (0.31, 0.43, 0.57), 0.61)
    assert flat(p) == numbers
    assert packed(Bent, flat(Bent())) == Bent()
    assert named(p) == dict(zip((v.name for v in variables(Bent)), numbers, strict=True))


@pytest.mark.parametrize("count", [0, 1, 2, 6, 8])
def test_too_few_or_too_many_numbers_are_a_defect(count) -> None:
    with pytest.raises(TypeError, match=rf"{count} numbers for Bent -- expected 7"):
        packed(Bent, [1.0] * count)


def test_a_value_outside_in_a_tuple_is_named_by_its_item() -> None:
    with pytest.raises(InputError, match=r"parameter L_2 = 0\.0 m \(length of a piece\) -- expected a value in \(0, "):
        check_bounds(variables(Bent), Bent(L=(0.1, 0.0)))


class Unsized(NamedTuple):
    L: Annotated[tuple[float, ...], Quantity("m", "length")]


class Whole(NamedTuple):
    n: Annotated[tuple[int, int], Quantity("1", "counts")]


class Words(NamedTuple):
    name: Annotated[str, Quantity("1", "name")]


@pytest.mark.parametrize("fields", [Unsized, Whole, Words])
def test_another_type_is_a_defect(fields) -> None:
    with pytest.raises(TypeError, match=rf"{fields.__name__}\.\w+ is no float, int or tuple of floats of known length"):
        variables(fields)
