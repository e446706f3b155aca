"""Expressions and statements drawn at random from the subset, and those at its edge: the same to the last bit in C."""

from __future__ import annotations

import ast
import random
import re
import struct
import textwrap
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from tsm_fmu.fmu.native.model_source import model_files
from tsm_fmu.fmu.native.scopes import declaration_places, used_outside
from tsm_fmu.fmu.native.unit import units
from tsm_fmu.kernels.kernel import Kernel
from tsm_fmu.models.contract import InputError, packed

from .translated import Translated

MANY = 40
HEAD = """
import math
from typing import Annotated, NamedTuple
from tsm_fmu.models.contract import Quantity
NAME = "Tried"
SCALE = 2.5
COUNT = 3
class Pair(NamedTuple):
    left: float
    right: float
class Params(NamedTuple):
    k: Annotated[float, Quantity("1", "gain")] = 1.0
    n: Annotated[int, Quantity("1", "count", lo=0, hi=3)] = 1
    L: Annotated[tuple[float, float, float], Quantity("m", "lengths")] = (0.1, 0.2, 0.3)
class State(NamedTuple):
    x: Annotated[float, Quantity("1", "state")]
class Inputs(NamedTuple):
    u: Annotated[float, Quantity("1", "input")]
class Outputs(NamedTuple):
OUTPUTS
PRESETS = {}
def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(u.u), Outputs(ZEROS)
def shifted(a: float, by: float = 0.75) -> float:
    if a > 1e3:  # of another function
        raise ValueError(f"a = {a!r} of {by:.3g} -- expected 1000 % at most")
    return a + by
def sorted_pair(a: float, b: float) -> Pair:
    return Pair(a, b) if a <= b else Pair(right=a, left=b)
def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
"""


def module(body: str, outputs: int) -> ModuleType:
    fields = "\n".join(f'    y{k}: Annotated[float, Quantity("1", "output")]' for k in range(outputs))
    head = HEAD.replace("OUTPUTS", fields).replace("ZEROS", ", ".join(["0.0"] * outputs))
    text = head + textwrap.indent(textwrap.dedent(body), "    ")
    made = ModuleType("tried")
    made.__dict__.update(SOURCE_TEXT=text, __file__="tried.py")
    exec(compile(text, "tried.py", "exec", dont_inherit=True), made.__dict__)  # noqa: S102  our own text
    return made


class Drawn:
    """Expressions by type, written as Python would have them without more brackets than it needs."""

    def __init__(self, seed: int) -> None:
        self.source = random.Random(seed)

    def tree(self, text: str) -> str:
        return ast.unparse(ast.parse(text, mode="eval"))

    def real(self, depth: int) -> str:
        pick = self.source.choice
        if depth == 0:
            number = pick(["0.5", "-1.25", "3.0", "1e-3", "SCALE", "math.pi", "dt", "a", "b", "p.k", "s.x", "u.u"])
            return pick([number, number, "p.L[0]", "p.L[-1]", "p.L[p.n % 3]", "w.left", "w.right", "(a, b, 2.0)[1]"])
        one, two, three = (self.real(depth - 1) for _ in range(3))
        whole = self.integer(depth - 1)
        return pick([
            f"({one}) + ({two})", f"({one}) - ({two})", f"({one}) * ({two})", f"({one}) / ({two})",
            f"({one}) - (({two}) - ({three}))", f"({one}) / (({two}) * ({three}))", f"({one}) - (({two}) + ({three}))",
            f"-({one})", f"-(({one}) + ({two}))", f"abs({one}) % 0.7", f"abs({one}) ** p.k",
            f"min({one}, {two}, {whole})",
            f"max({whole}, {one})", f"abs({one})", f"math.atan2({one}, {two})", f"math.tanh({one})",
            f"math.copysign({one}, {two})", f"({one}) * math.floor({two})", f"({one}) + ({whole})", f"({whole}) / 4",
            f"({one}) * ({whole})", f"float({whole})", f"({one}) if ({self.truth(depth - 1)}) else ({two})",
            f"(({one}) if ({self.truth(depth - 1)}) else ({whole})) - ({three})", f"shifted({one})",
            f"shifted(by={one}, a=math.tanh({two}))", f"sorted_pair({one}, {two}).left", f"math.sqrt(abs({one}))",
            f"math.sin({one})",
        ])  # fmt: skip

    def integer(self, depth: int) -> str:
        pick = self.source.choice
        if depth == 0:
            return pick(["2", "-3", "p.n", "COUNT", "len(p.L)", "j"])
        one, two = self.integer(depth - 1), self.integer(depth - 1)
        return pick([f"({one}) + ({two})", f"({one}) - (({two}) - 1)", f"({one}) * ({two})", f"({one}) % 5",
                     f"({one}) % 1",
                     f"-({one})", f"min({one}, {two})", f"max({one}, {two})", f"abs({one})",
                     f"int(math.tanh({self.real(0)}) * 5.0)"])  # fmt: skip

    def truth(self, depth: int) -> str:
        pick = self.source.choice
        one, two, three = (self.real(0) for _ in range(3))
        if depth <= 0:
            order = pick(["<", "<=", ">", ">=", "==", "!="])
            whole = f"{self.integer(0)} {order} {self.integer(0)}"
            middle = pick(["a", "b", "p.k", "0.25"])
            chained = f"{one} < {middle} <= {three}"
            return pick([f"{one} {order} {two}", whole, chained, f"math.isfinite({one})", "True", "flag"])
        left, right = self.truth(depth - 1), self.truth(depth - 1)
        return pick([f"({left}) and ({right})", f"({left}) or ({right})", f"not ({left})", f"({left}) == ({right})",
                     f"({left}) and (({right}) or {one} > {two})"])  # fmt: skip


def same(made: ModuleType, in_c: Translated, cases: int, seed: int) -> set[str]:
    """Compare step by step; what came out: "number", or the texts of what was raised."""
    source, told = random.Random(seed), set()
    for _ in range(cases):
        numbers = [source.choice([0.0, -0.0, 1.0, -2.5, source.gauss(0, 1), source.gauss(0, 30)]) for _ in range(6)]
        p = packed(made.Params, [numbers[0], source.randint(0, 3), *numbers[1:4]])
        s, u = made.State(numbers[4]), made.Inputs(source.choice([numbers[5], 1e5, 1e200]))
        expected, found = (outcome(f, p, s, u, 0.01) for f in (made.step, in_c.step))
        assert found == expected
        told.add(expected if isinstance(expected, str) else "number")
    return told


def outcome(function: Any, *arguments: Any) -> bytes | str:
    try:
        (state,), outputs = function(*arguments)
    except (ValueError, ArithmeticError) as failure:
        return str(failure)
    return struct.pack(f"<{1 + len(outputs)}d", state, *(y + 0.0 for y in outputs))


@pytest.mark.parametrize("seed", range(5))
def test_random_expressions_have_the_same_bits(seed: int, tmp_path: Path) -> None:
    """Each in a statement of its own: what one raises ends the step, so that most are about harmless numbers."""
    drawn = Drawn(seed)
    lines = ["a = u.u * 0.125 - s.x", "b: float = math.tanh(a) + 0.25", "j = p.n + 1", "flag = a > b",
             "w = sorted_pair(a, b)"]  # fmt: skip
    kinds = [
        drawn.real,
        drawn.real,
        lambda d: f"float({drawn.integer(d)})",
        lambda d: f"1.0 if {drawn.truth(d)} else -2.0",
    ]
    for k in range(MANY):
        lines.append(f"r{k} = 0.0")
        lines.append(f"if p.n != {k % 4}:")
        lines.append(f"    r{k} = {drawn.tree(kinds[k % 4](1 + k % 3))}")
    lines.append(f"return State(a), Outputs({', '.join(f'r{k}' for k in range(MANY))})")
    made = module("\n".join(lines), MANY)
    told = same(made, Translated(Kernel(made), tmp_path, flags=("-Wno-error", "-w")), 150, seed)
    assert "number" in told


STATEMENTS = """
total, turns = 0.0, 0
x = abs(s.x) + 0.5
if x / p.k > 3.0:
    total += 1.0
elif 1.0 / (u.u - 1.0) > 0.0:
    total -= 2.0
elif p.n > 1:
    total *= 0.5
    total = total - 0.25
else:
    total = 4.0
while 8.0 / x > 1.5:
    x *= 1.5
    turns += 1
while turns < 9:
    turns += 2
    if turns == 5:
        continue
    total -= 0.125
while True:
    turns -= 3
    if turns < 0:
        break
for i in range(2, -1, -1):
    total += p.L[i] * i
    for i_2 in range(i):
        total -= i_2
last = p.n
for i in range(1, last):
    last = 0
    total += i * 10.0
for way in (0.75,):
    total -= way
for way in (1.0, -2.0, 0.5):
    total = total * 0.5 + way
for count in (1, 4):
    total += count
first, second = total, x
first, second = second, first
third, *rest = 1.0, first  # UNPACKED
mixed = (first, p.n, second)
low, number, high = mixed
pair = sorted_pair(low, high)
left, right = pair
total /= right - left + 1.0
total **= 2.0
turns *= 2
joined = (left, right) + p.L
total += joined[-1] + joined[1:3][0] + len(joined)
if turns > 1:
    late = 3.0
else:
    late = -3.0
return State(total), Outputs(total, x, float(turns), pair.right, late * number)
"""


def test_statements_of_all_kinds_are_the_same_to_the_last_bit(tmp_path: Path) -> None:
    """Conditions that fail in the middle of a chain, loops whose test or end changes, tuples taken apart and joined."""
    made = module(STATEMENTS.replace("third, *rest = 1.0, first  # UNPACKED\n", ""), 5)
    told = same(made, Translated(Kernel(made), tmp_path), 600, 3)
    assert {"number", "float division by zero"} <= told


def test_a_raised_sentence_has_its_numbers_as_python_prints_them(tmp_path: Path) -> None:
    body = """
    if u.u > 10.0:
        raise ValueError(f"u = {u.u!r} 100 % of {p.n} in {s.x:.3g} -- {s.x:e}")
    return State(shifted(abs(s.x) * 500.0)), Outputs(0.0)
    """
    made = module(body, 1)
    told = same(made, Translated(Kernel(made), tmp_path), 300, 9)
    assert any(re.fullmatch(r"u = 1e\+200 100 % of [0-3] in .* -- .*e[+-]\d\d", t) for t in told)
    assert any(t.startswith("a = ") and t.endswith(" of 0.75 -- expected 1000 % at most") for t in told)
    assert "number" in told


@pytest.mark.parametrize(
    ("lines", "what"),
    [
        ("for i in range(3):\n    pass\nelse:\n    pass", "else of a loop"),
        ("while u.u > 0.0:\n    pass\nelse:\n    pass", "else of a loop"),
        ("for a, b in ((1.0, 2.0), (3.0, 4.0)):\n    pass", "a loop over several names"),
        ("for i in range(3):\n    pass\ny = i", "a loop variable 'i' that is used outside the loop"),
        ("for i in p.L:\n    pass", "a loop over other than range() or a tuple"),
        ("for i in range(0, 4, 2):\n    pass", "a range of other than integers with step 1 or -1"),
        ("for i in range(u.u):\n    pass", "a range of other than integers with step 1 or -1"),
        ("for i in (1.0, 2):\n    pass", "a loop over values of several types"),
        ("for i in range(3):\n    i = 2", "a change of the loop's own variable 'i'"),
        ("a = b = 1.0", "an assignment to several names at once"),
        ("a: float", "a variable without a value"),
        ("s.x = 1.0", "an assignment to a part of a value"),
        ("a, b = 1.0, 2.0, 3.0", "an assignment of 3 values to 2 names"),
        ("raise ValueError", "raise without a sentence"),
        ("raise ValueError(NAME)", "a sentence that is not written out"),
        ("raise ValueError(f'{u.u:>8}')", "the format"),
        ("a = 1.0\na = (1.0, 2.0)", "a tuple of 2 where another type is expected"),
        ("a = 1\na = 2.5", "a value of type float where int is expected"),
        ("a, b = u.u", "a number where a tuple is expected"),
        ("a = u.u[0]", "an index into a number"),
        ("a = p.L[3]", "index 3 of a tuple of 3"),
        ("a = p.L[-4]", "index -4 of a tuple of 3"),
        ("a = (1.0 / u.u, 2.0)[0]", "an index into a tuple whose items may fail"),
        ("a = (1.0, 2)[p.n]", "a computed index into items of several types"),
        ("a = p.L + 1.0", "+ between tuple and float"),
        ("a = p.n ** 2", "** between integers"),
        ("a = p.n % p.n", "% between integers"),
        ("a = p.n % 0", "% between integers"),
        ("a = not u.u", "a number as a condition"),
        ("a = +u.u", "operator UAdd on a float"),
        ("a = -p.L", "operator USub on a tuple"),
        ("a = 0.0 < 1.0 / u.u < 2.0", "a chained comparison whose middle may fail"),
        ("a = u.u in p.L", "comparison In"),
        ("a = p.L == u.u", "a comparison of tuple and float"),
        ("a = math.floor(u.u, ndigits=1)", "keywords in a call of a built-in function"),
        ("a = shifted(1.0, 2.0, 3.0)", "a call that does not fit"),
        ("a = Pair(1.0)", "a call that does not fit"),
        ("a = abs(p.L)", "abs() of other than numbers"),
        ("a = max()", "max() of other than numbers"),
        ("a = round(u.u)", "a call of round()"),
        ("a = math.erf(u.u)", "math.erf"),
        ("a = u.v", "the attribute 'v' of a tuple"),
        ("a = math.nothing", "math.nothing"),
        ("a = u.u @ u.u", "operator MatMult"),
        ("del dt", "Delete statement"),
    ],
)
def test_what_cannot_be_translated_is_refused_at_its_line(lines: str, what: str) -> None:
    first = HEAD.replace("OUTPUTS\n", "y0\n").count("\n") + 1
    with pytest.raises(InputError, match=rf"tried\.py:\d+: .*{re.escape(what)}") as wrong:
        units(module(f"{lines}\nreturn State(0.0), Outputs(0.0)\n", 1))
    line = int(re.findall(r"tried\.py:(\d+)", str(wrong.value))[0])
    assert first <= line <= first + lines.count("\n")


COMMENTED = """
# before the first
total = 0.0  # beside it
if u.u > 0.0:  # beside the test
    # within the block
    inner = u.u * 2.0
    total += inner  # Eq (3) of A & B */ no end
else:
    late = 1.0
    total -= late
shared = total
for i in range(3):
    shared += i
    both = shared
both = 2.0
return State(total), Outputs(shared + both)  # the end
"""


def test_comments_stand_once_each_in_their_order_beside_the_same_statements() -> None:
    text = model_files(Kernel(module(COMMENTED, 1)))["Tried.c"]
    lines = [line.strip() for line in text.splitlines()]
    found = [line for line in lines if "/*" in line]
    words = [
        "before the first",
        "beside it",
        "beside the test",
        "within the block",
        "Eq (3) of A & B * / no end",
        "the end",
    ]
    places = [next(k for k, line in enumerate(found) if f"/* {word} */" in line) for word in words]
    assert places == sorted(places)
    for word in words:
        assert text.count(word) == 1
    assert "double total = 0.0;  /* beside it */" in lines
    assert lines[lines.index("/* within the block */") + 1].startswith("double inner = ")
    assert lines[lines.index("/* before the first */") + 1].startswith("double total = ")


def test_a_variable_is_declared_where_all_its_uses_are_in_reach() -> None:
    """Its first statement, unless that stands in a block beside or within which it is used again."""
    (tree,) = ast.parse("def step():" + textwrap.indent(COMMENTED, "    ")).body
    assert isinstance(tree, ast.FunctionDef)
    places = {name: ast.unparse(at) for name, at in declaration_places(tree).items()}
    assert places == {
        "total": "total = 0.0",
        "inner": "inner = u.u * 2.0",
        "late": "late = 1.0",
        "shared": "shared = total",
    }


def test_a_loop_variable_that_is_named_outside_its_loops_is_known() -> None:
    def used(text: str) -> bool:
        (tree,) = ast.parse("def step():\n" + textwrap.indent(text, "    ")).body
        assert isinstance(tree, ast.FunctionDef)
        return used_outside(tree, "i")

    assert not used("for i in range(3):\n    a = i\nfor i in range(2):\n    b = i")
    assert used("for i in range(3):\n    a = i\nb = i")
    assert used("i = 2\nfor j in range(3):\n    a = j")
