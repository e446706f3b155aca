"""Derivatives of a translated step: of each operation in closed form, of whole models by differences."""

from __future__ import annotations

import ctypes
import math
import random
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from tsm_fmu.fmu.native.model_source import model_files
from tsm_fmu.kernels.kernel import Kernel, kernel

from .translated import Fault, Translated

LAWS = (
    ("a + b", lambda a, b: (1.0, 1.0)),
    ("a - b", lambda a, b: (1.0, -1.0)),
    ("a * b", lambda a, b: (b, a)),
    ("a / b", lambda a, b: (1.0 / b, -a / b**2)),
    ("a % 0.3", lambda a, b: (1.0, 0.0)),
    ("a % b", lambda a, b: (1.0, -math.floor(a / b))),
    ("abs(a) ** b", lambda a, b: (b * abs(a) ** (b - 1.0) * math.copysign(1.0, a), abs(a) ** b * math.log(abs(a)))),
    ("-a", lambda a, b: (-1.0, 0.0)),
    ("abs(a)", lambda a, b: (math.copysign(1.0, a), 0.0)),
    ("min(a, b)", lambda a, b: (1.0, 0.0) if a < b else (0.0, 1.0)),
    ("max(a, b)", lambda a, b: (1.0, 0.0) if a > b else (0.0, 1.0)),
    ("math.sin(a)", lambda a, b: (math.cos(a), 0.0)),
    ("math.cos(a)", lambda a, b: (-math.sin(a), 0.0)),
    ("math.tan(a)", lambda a, b: (1.0 / math.cos(a) ** 2, 0.0)),
    ("math.asin(a)", lambda a, b: (1.0 / math.sqrt(1.0 - a * a), 0.0)),
    ("math.acos(a)", lambda a, b: (-1.0 / math.sqrt(1.0 - a * a), 0.0)),
    ("math.atan(a)", lambda a, b: (1.0 / (1.0 + a * a), 0.0)),
    ("math.atan2(a, b)", lambda a, b: (b / (a * a + b * b), -a / (a * a + b * b))),
    ("math.sinh(a)", lambda a, b: (math.cosh(a), 0.0)),
    ("math.cosh(a)", lambda a, b: (math.sinh(a), 0.0)),
    ("math.tanh(a)", lambda a, b: (1.0 / math.cosh(a) ** 2, 0.0)),
    ("math.asinh(a)", lambda a, b: (1.0 / math.sqrt(1.0 + a * a), 0.0)),
    ("math.atanh(a)", lambda a, b: (1.0 / (1.0 - a * a), 0.0)),
    ("math.exp(a)", lambda a, b: (math.exp(a), 0.0)),
    ("math.expm1(a)", lambda a, b: (math.exp(a), 0.0)),
    ("math.log(b)", lambda a, b: (0.0, 1.0 / b)),
    ("math.log1p(b)", lambda a, b: (0.0, 1.0 / (1.0 + b))),
    ("math.sqrt(b)", lambda a, b: (0.0, 0.5 / math.sqrt(b))),
    ("math.copysign(a, -b)", lambda a, b: (-math.copysign(1.0, a), 0.0)),
    ("math.degrees(a)", lambda a, b: (180.0 / math.pi, 0.0)),
    ("math.radians(a)", lambda a, b: (math.pi / 180.0, 0.0)),
    ("math.floor(8.0 * a) * b", lambda a, b: (0.0, math.floor(8.0 * a))),
    ("int(8.0 * a) * b", lambda a, b: (0.0, int(8.0 * a))),
    ("p.n * a", lambda a, b: (3.0, 0.0)),
    ("a if a < b else -b", lambda a, b: (1.0, 0.0) if a < b else (0.0, -1.0)),
    ("p.k * a + p.L[1] * b", lambda a, b: (1.5, -0.25)),
    ("p.L[p.n - 3] * a", lambda a, b: (0.75, 0.0)),
    ("0.5 if a > -0.25 else 2.0", lambda a, b: (0.0, 0.0)),
    ("(s.h[0] + s.h[1]) * 2.0", lambda a, b: (0.0, 0.0)),
)
"""Of a in -1 to 1 and b in 0 to 2: the expression, and its slopes."""

HEAD = """
import math
from typing import Annotated, NamedTuple
from tsm_fmu.models.contract import Quantity
NAME = "Tried"
class Params(NamedTuple):
    k: Annotated[float, Quantity("1", "gain")] = 1.0
    n: Annotated[int, Quantity("1", "count", lo=0, hi=3)] = 1
    L: Annotated[tuple[float, float, float], Quantity("m", "lengths")] = (0.1, 0.2, 0.3)
class State(NamedTuple):
    x: Annotated[float, Quantity("1", "state")]
    m: Annotated[int, Quantity("1", "count")]
    h: Annotated[tuple[float, float], Quantity("1", "memory")]
class Inputs(NamedTuple):
    u: Annotated[float, Quantity("1", "input")]
class Outputs(NamedTuple):
OUTPUTS
PRESETS = {}
def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(p.k * u.u, p.n, (u.u, p.L[2] * u.u)), Outputs(ZEROS)
def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    a, b = u.u, s.x
"""


def written(text: str) -> ModuleType:
    made = ModuleType("tried")
    made.__dict__.update(SOURCE_TEXT=text, __file__="tried.py")
    exec(compile(text, "tried.py", "exec", dont_inherit=True), made.__dict__)  # noqa: S102  our own text
    return made


@pytest.fixture(scope="module")
def laws(tmp_path_factory: pytest.TempPathFactory) -> Translated:
    fields = "\n".join(f'    y{k}: Annotated[float, Quantity("1", "output")]' for k in range(len(LAWS)))
    zeros = "u.u * 4.0, " + ", ".join(["0.0"] * (len(LAWS) - 1))
    text = HEAD.replace("OUTPUTS", fields).replace("ZEROS", zeros)
    text += "".join(f"    y{k} = {law}\n" for k, (law, _) in enumerate(LAWS))
    outputs = ", ".join(f"y{k}" for k in range(len(LAWS)))
    text += f"    return State(a * b, s.m + 1, (s.h[1] * a, b)), Outputs({outputs})\n"
    return Translated(Kernel(written(text)), tmp_path_factory.mktemp("laws"))


def test_every_operation_has_its_slopes(laws: Translated) -> None:
    random_, made = random.Random(4), laws.module
    p = made.Params(1.5, 3, (0.75, -0.25, 4.0))
    for _ in range(60):
        a, b = random_.uniform(-0.95, 0.95), random_.uniform(0.05, 2.0)
        da, db, dh = (random_.choice([0.0, 1.0, random_.gauss(0.0, 1.0)]) for _ in range(3))
        s, ds = made.State(b, 2, (0.5, -1.25)), made.State(db, 0, (dh, -2.0 * dh))
        still = made.Params(0.0, 0, (0.0, 0.0, 0.0))
        after, found = laws.step_derivative(p, s, made.Inputs(a), 0.1, still, ds, made.Inputs(da))
        for y, (law, slopes) in zip(found[:-1], LAWS[:-1], strict=True):
            by_a, by_b = slopes(a, b)
            assert y == pytest.approx(by_a * da + by_b * db, rel=1e-12, abs=1e-12), law
        assert found[-1] == pytest.approx(-2.0 * dh)
        assert after == (
            pytest.approx(a * db + b * da),
            0,
            (pytest.approx(-2.0 * dh * a - 1.25 * da), pytest.approx(db)),
        )


def test_slopes_by_parameters_are_those_by_parameters(laws: Translated) -> None:
    """P.k a + p.L[1] b and p.L[0] a, where nothing else changes; a count has no slope."""
    made = laws.module
    p, s, u = made.Params(1.5, 3, (0.75, -0.25, 4.0)), made.State(0.7, 2, (0.5, -1.25)), made.Inputs(0.3)
    still = made.State(0.0, 0, (0.0, 0.0)), made.Inputs(0.0)
    _, found = laws.step_derivative(p, s, u, 0.1, made.Params(2.0, 1, (8.0, 16.0, 32.0)), *still)
    places = {law: k for k, (law, _) in enumerate(LAWS)}
    slopes = {"p.k * a + p.L[1] * b": 2.0 * 0.3 + 16.0 * 0.7, "p.L[p.n - 3] * a": 8.0 * 0.3}
    for law, k in places.items():
        assert found[k] == pytest.approx(slopes.get(law, 0.0), rel=1e-14), law


def test_the_start_has_slopes_too(laws: Translated) -> None:
    made = laws.module
    state, outputs, fault = laws._made["State"](), laws._made["Outputs"](), Fault()
    given = (
        laws._put(made.Params(1.5, 3, (0.75, -0.25, 4.0)), "Params"), laws._put(made.Inputs(0.3), "Inputs"),
        laws._put(made.Params(2.0, 1, (0.0, 0.0, 8.0)), "Params"), laws._put(made.Inputs(0.5), "Inputs"),
    )  # fmt: skip
    places = [ctypes.byref(g) for g in (*given, state, outputs, fault)]
    laws.library.model_start_derivative(*places)
    assert not fault.raised
    after = laws._got(state, "State")
    assert (after.x, after.m) == (pytest.approx(1.5 * 0.5 + 2.0 * 0.3), 0)
    assert after.h == pytest.approx((0.5, 4.0 * 0.5 + 8.0 * 0.3))
    assert laws._got(outputs, "Outputs")[:2] == (2.0, 0.0)


@pytest.mark.parametrize("name", ["DcMotor", "TendonDrive"])
def test_a_step_of_a_model_has_the_slopes_of_its_differences(name: str, tmp_path: Path) -> None:
    """Along random directions of state and inputs; where both sides differ there is a kink, which is left out."""
    k = kernel(name)
    in_c, made, random_ = Translated(k, tmp_path), k.module, random.Random(8)
    p, compared = k.params(), 0
    still = made.Params(*(0.0 for _ in p))
    for _ in range(60):
        u = made.Inputs(*(random_.uniform(0.1, 0.9) for _ in made.Inputs._fields))
        s, _ = made.start(p, u)
        s = made.State(*(x + random_.uniform(0.0, 0.1) for x in s))
        ds, du = (cls(*(random_.gauss(0.0, 1.0) for _ in cls._fields)) for cls in (made.State, made.Inputs))

        def at(h: float, s: Any = s, u: Any = u, ds: Any = ds, du: Any = du) -> list[float]:
            state, outputs = made.step(
                p, made.State(*(x + h * d for x, d in zip(s, ds, strict=True))),
                made.Inputs(*(x + h * d for x, d in zip(u, du, strict=True))), 1e-3,
            )  # fmt: skip
            return [*state, *outputs]

        h = 1e-6
        low, middle, high = at(-h), at(0.0), at(h)
        state, outputs = in_c.step_derivative(p, s, u, 1e-3, still, ds, du)
        for a, b, c, slope in zip(low, middle, high, [*state, *outputs], strict=True):
            if abs((c - b) - (b - a)) < 1e-3 * abs(c - a):
                assert slope == pytest.approx((c - a) / (2.0 * h), rel=1e-3)
                compared += 1
    assert compared > 60


COUNTED = """
from typing import Annotated, NamedTuple
from tsm_fmu.models.contract import Quantity
NAME = "Counted"
class Params(NamedTuple):
PARAMS
class State(NamedTuple):
STATE
class Inputs(NamedTuple):
    j: Annotated[int, Quantity("1", "number", lo=0, hi=9)]
class Outputs(NamedTuple):
    y: Annotated[int, Quantity("1", "number", lo=0, hi=99)]
PRESETS = {}
def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(STARTED), Outputs(u.j)
def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    return State(AFTER), Outputs(u.j * FACTOR + ADDED)
"""


@pytest.mark.parametrize(
    ("params", "state", "started", "after", "factor", "added"),
    [
        ("    pass", "    pass", "", "", "2", "1"),
        ('    n: Annotated[int, Quantity("1", "number", lo=0, hi=9)] = 3',
         '    m: Annotated[int, Quantity("1", "number")]\n    c: Annotated[tuple[int, int], Quantity("1", "numbers")]',
         "u.j, (u.j, 2)", "s.m + 1, (s.c[1], s.c[0])", "p.n", "s.c[1]"),
    ],
)  # fmt: skip
def test_a_kernel_of_whole_numbers_or_of_nothing_at_all_compiles_and_has_no_slopes(
    params: str, state: str, started: str, after: str, factor: str, added: str, tmp_path: Path
) -> None:
    """With every warning an error: no argument is left unused."""
    text = COUNTED
    for mark, own in (("PARAMS", params), ("STATE", state), ("STARTED", started), ("AFTER", after),
                      ("FACTOR", factor), ("ADDED", added)):  # fmt: skip
        text = text.replace(mark, own)
    made = written(text)
    in_c = Translated(Kernel(made), tmp_path)
    p, u = made.Params(), made.Inputs(4)
    s, y = in_c.start(p, u)
    assert (s, y) == made.start(p, u)
    expected = made.step(p, s, u, 0.1)
    assert in_c.step(p, s, u, 0.1) == expected
    slopes = in_c.step_derivative(p, s, u, 0.1, p, s, u)
    numbers = [x for part in slopes for field in part for x in (field if isinstance(field, tuple) else (field,))]
    assert numbers == [0] * (1 if state.strip() == "pass" else 4)


def test_the_header_declares_each_struct_once_and_what_a_host_may_call() -> None:
    text = model_files(kernel("LebusTransmission"))["model.h"]
    for name in ("Params", "State", "Inputs", "Outputs"):
        assert text.count(f"}} {name};") == 1
    for call in ("model_start(", "model_step(", "model_check(", "model_warnings(", "model_start_derivative(",
                 "model_step_derivative("):  # fmt: skip
        assert text.count(call) == 1
    assert text.count("typedef struct { double item[") == len({line for line in text.splitlines() if "item[" in line})
    assert text.endswith("#endif\n")
