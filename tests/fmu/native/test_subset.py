"""What the translation refuses, with file and line, and what it says of a kernel's joint conditions."""

import ctypes
import math
import random
import re
import struct
import textwrap
from types import ModuleType

import pytest

from tsm_fmu.fmu.native.unit import units
from tsm_fmu.kernels.chain import chain
from tsm_fmu.kernels.kernel import Kernel
from tsm_fmu.models import MODELS
from tsm_fmu.models.contract import InputError, check_conditions, packed

from .translated import Fault, Translated

HEAD = """
import math
from typing import Annotated, NamedTuple
from tsm_fmu.models.contract import Quantity
NAME = "Tried"
SCALE = 2.5
class Params(NamedTuple):
    k: Annotated[float, Quantity("1", "gain")] = 1.0
    n: Annotated[int, Quantity("1", "count", lo=0, hi=3)] = 1
    L: Annotated[tuple[float, float, float], Quantity("m", "lengths")] = (0.1, 0.2, 0.3)
class State(NamedTuple):
    x: Annotated[float, Quantity("1", "state")]
class Inputs(NamedTuple):
    u: Annotated[float, Quantity("1", "input")]
class Outputs(NamedTuple):
    y: Annotated[float, Quantity("1", "output")]
PRESETS = {}
def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(u.u), Outputs(u.u)
def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
"""


def module(body: str) -> ModuleType:
    text = HEAD + textwrap.indent(textwrap.dedent(body), "    ")
    made = ModuleType("tried")
    made.__dict__.update(SOURCE_TEXT=text, __file__="tried.py")
    exec(compile(text, "tried.py", "exec"), made.__dict__)  # noqa: S102  our own text
    return made


@pytest.mark.parametrize(
    ("line", "what"),
    [
        ("y = [u.u]", "List expression"),
        ("y = {1: 2.0}", "Dict expression"),
        ("y = print(u.u)", "a call of print()"),
        ("y = math.gamma(u.u)", "math.gamma"),
        ("y = u.u if u.u else 0.0", "a number as a condition"),
        ("y = 'text'", "the literal 'text'"),
        ("with open('x') as f: pass", "With statement"),
        ("y = unknown", "the name 'unknown'"),
        ("y = p.missing", "the attribute 'missing'"),
        ("y = p.L[5]", "index 5 of a tuple of 3"),
        ("y = step(p, s, u, dt)", "step(), which calls itself,"),
        ("y = p.n // 2", "operator FloorDiv"),
        ("y = (lambda a: a)(u.u)", "a call of"),
        ("y = math.floor(u.u) + 1", "arithmetic on whole numbers"),
    ],
)
def test_what_is_outside_the_subset_is_refused_with_file_and_line(line, what):
    number = HEAD.count("\n") + 1
    with pytest.raises(InputError, match=rf"tried\.py:{number}: {re.escape(what)}"):
        units(module(f"{line}\nreturn State(0.0), Outputs(0.0)\n"))


TRIED = """
total = 0.0
k = 0
for i in range(p.n):
    if i == 2:
        continue
    total += p.L[i] * SCALE
before, after = s.x, u.u
before, after = after, before
while total > 10.0 or k < 3:
    k += 1
    total = total / (k + after)
    if k > 50:
        break
for way in (1.0, -1.0):
    total += way * max(before, after, 0.25) - min(0.5, dt)
return State(total), Outputs(total ** 2.0 % 0.7 + math.floor(u.u) * dt)
"""


def test_statements_of_many_kinds_are_the_same_to_the_last_bit(tmp_path):
    made = module(TRIED)
    in_c = Translated(Kernel(made), tmp_path)
    source = random.Random(5)
    outcomes = set()
    for _ in range(400):
        p = packed(made.Params, [source.gauss(1, 1), source.randint(0, 3), *(source.gauss(0, 2) for _ in range(3))])
        s, u = (
            made.State(source.choice([0.0, -1.0, source.gauss(0, 30)])),
            made.Inputs(source.choice([-2.0, 1e200, 0.7])),
        )
        expected, found = (outcome(f, p, s, u, 0.01) for f in (made.step, in_c.step))
        assert found == expected
        outcomes.add(expected if isinstance(expected, str) else "number")
    assert outcomes == {"number", "float division by zero"}


def outcome(function, *arguments):
    try:
        (state,), (y,) = function(*arguments)
    except (ValueError, ArithmeticError) as failure:
        return str(failure)
    return struct.pack("<2d", state, y)


KERNELS = [*map(Kernel, MODELS), chain("TendonDrive", ("nonlocal_memory", "stribeck"))]


@pytest.mark.parametrize("k", [k for k in KERNELS if getattr(k.module, "CONDITIONS", ())], ids=lambda k: k.name)
def test_joint_conditions_say_the_same(k, tmp_path):
    in_c = Translated(k, tmp_path)
    source, told = random.Random(11), set()
    for _ in range(300):
        values = [moved(v, source) for v in k.parameters]
        p = packed(k.module.Params, values)
        fault = Fault()
        given = ctypes.byref(in_c._put(p, "Params"))
        in_c.library.model_check(given, ctypes.byref(fault))
        refusal, expected = judged(k, p)
        assert (fault.raised, fault.text.decode()) == (bool(refusal), refusal)
        if refusal:
            told.add(refusal[:12])
            continue
        assert warnings_of(in_c, given) == expected
        told.update(text[:12] for text in expected)
    assert told


def warnings_of(in_c: Translated, parameters) -> tuple[str, ...]:
    """What the translation warns of."""
    told: list[str] = []
    note = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_char_p)(lambda _, text: told.append(text.decode()))
    in_c.library.model_warnings(parameters, note, None, ctypes.byref(Fault()))
    return tuple(told)


def judged(k: Kernel, p) -> tuple[str, tuple[str, ...]]:
    """Why Python refuses the parameters, else what it warns of."""
    try:
        return "", check_conditions(k.module.CONDITIONS, p)
    except (ValueError, ArithmeticError) as failure:
        return str(failure), ()


def moved(variable, source: random.Random) -> float:
    """A value within its bounds, often far from the default."""
    quantity, value = variable.quantity, variable.start
    if variable.kind is int:
        return source.randint(int(quantity.lo), int(min(quantity.hi, 8)))
    value = value * math.exp(source.gauss(0.0, 1.5)) if value else source.choice([0.0, abs(source.gauss(0.0, 1.0))])
    value = -value if source.random() < 0.2 else value
    return min(
        max(value, quantity.lo + (1e-9 if quantity.open_lo else 0.0)), quantity.hi - (1e-9 if quantity.open_hi else 0.0)
    )


def test_numbers_in_sentences_are_printed_as_python_prints_them(tmp_path):
    made = module(
        "if u.u < 0.0:\n"
        "    raise ValueError(f'{u.u!r} and {u.u:g}, {p.n}, 5 % of {dt:.3f}')\n"
        "return State(0.0), Outputs(0.0)\n"
    )
    in_c = Translated(Kernel(made), tmp_path)
    source = random.Random(3)
    numbers = [-1.0, -1e16, -1e15, -123456789012345680.0, -1e-4, -1e-5, -5e-324, -0.1, -1e22, -1.7976931348623157e308]
    numbers += [-abs(source.gauss(0.0, 1.0)) * 10.0 ** source.randint(-30, 30) for _ in range(2000)]
    for number in numbers:
        arguments = made.Params(), made.State(0.0), made.Inputs(number), 0.25
        assert outcome(in_c.step, *arguments) == outcome(made.step, *arguments)
