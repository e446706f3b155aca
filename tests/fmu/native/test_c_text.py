"""The C of expressions and statements, as one writes it by hand: brackets where C needs them and nowhere else."""

from __future__ import annotations

import textwrap
from types import ModuleType

import pytest

from tsm_fmu.fmu.native.arithmetic import Dual, Plain
from tsm_fmu.fmu.native.conditions import Conditions
from tsm_fmu.fmu.native.source import source
from tsm_fmu.fmu.native.types import C_WORDS, FLOAT, INT, Array, Mixed, Record, c_variable, items_of, member, members
from tsm_fmu.fmu.native.unit import Unit, units

from .test_expressions import module

RETURN = "return (State_and_Outputs){(State){x}, (Outputs){x}};"
CHECK = "if (RARELY(fault->raised)) return nothing_State_and_Outputs;"


def body(made: ModuleType, arithmetic: Plain | Dual, function: str = "step") -> list[str]:
    """Lines of a function in C."""
    unit = Unit(made, arithmetic)
    (law,) = (one for one in unit.laws if one.source.name == function)
    return law.lines


EXPRESSIONS = (
    ("u.u - (s.x - dt)", "u->u - (s->x - dt)", "dual_sub(u->u, dual_sub(s->x, dt))"),
    ("u.u - s.x - dt", "u->u - s->x - dt", "dual_sub(dual_sub(u->u, s->x), dt)"),
    ("u.u + (s.x + dt)", "u->u + (s->x + dt)", "dual_add(u->u, dual_add(s->x, dt))"),
    ("u.u * (s.x + dt)", "u->u * (s->x + dt)", "dual_mul(u->u, dual_add(s->x, dt))"),
    ("u.u * s.x - dt", "u->u * s->x - dt", "dual_sub(dual_mul(u->u, s->x), dt)"),
    ("u.u * (s.x * dt)", "u->u * (s->x * dt)", "dual_mul(u->u, dual_mul(s->x, dt))"),
    ("u.u * s.x / 2.0", "u->u * s->x / 2.0", "dual_div(dual_mul(u->u, s->x), dual(2.0))"),
    ("u.u * (s.x / 2.0)", "u->u * (s->x / 2.0)", "dual_mul(u->u, dual_div(s->x, dual(2.0)))"),
    ("-(u.u + s.x)", "-(u->u + s->x)", "dual_neg(dual_add(u->u, s->x))"),
    ("-u.u * s.x", "-u->u * s->x", "dual_mul(dual_neg(u->u), s->x)"),
    ("-(u.u * s.x)", "-(u->u * s->x)", "dual_neg(dual_mul(u->u, s->x))"),
    ("-(-u.u)", "-(-u->u)", "dual_neg(dual_neg(u->u))"),
    ("u.u - -s.x", "u->u - -s->x", "dual_sub(u->u, dual_neg(s->x))"),
    ("u.u * -1.25", "u->u * -1.25", "dual_mul(u->u, dual(-1.25))"),
    ("-(-1.25)", "1.25", "dual(1.25)"),
    ("u.u / s.x", "checked_div(u->u, s->x, fault)", "dual_div(u->u, s->x)"),
    ("u.u / 0.0", "checked_div(u->u, 0.0, fault)", "dual_div(u->u, dual(0.0))"),
    ("u.u % 0.7", "checked_mod(u->u, 0.7, fault)", "dual_mod(u->u, dual(0.7))"),
    ("u.u ** 2.0", "checked_power(u->u, 2.0, fault)", "dual_pow(u->u, dual(2.0))"),
    ("abs(u.u - s.x)", "fabs(u->u - s->x)", "dual_abs(dual_sub(u->u, s->x))"),
    ("min(u.u, s.x, 1.0)", "lesser(lesser(u->u, s->x), 1.0)", "dual_min(dual_min(u->u, s->x), dual(1.0))"),
    ("max(u.u, p.n)", "greater(u->u, (double)p->n)", "dual_max(u->u, dual((double)p->n))"),
    ("math.sin(u.u)", "checked_sin(u->u, fault)", "dual_sin(u->u)"),
    ("math.tanh(u.u)", "tanh(u->u)", "dual_tanh(u->u)"),
    ("math.atan2(u.u, s.x)", "atan2(u->u, s->x)", "dual_atan2(u->u, s->x)"),
    ("math.floor(u.u) * dt", "checked_floor(u->u, fault) * dt", "dual_mul(dual(checked_floor(u->u.v, fault)), dt)"),
    ("int(u.u) * 1.5", "(double)checked_int(u->u, fault) * 1.5",
     "dual_mul(dual((double)checked_int(u->u.v, fault)), dual(1.5))"),
    ("p.n + u.u", "(double)p->n + u->u", "dual_add(dual((double)p->n), u->u)"),
    ("(p.n + 1) * u.u", "(double)(p->n + 1) * u->u", "dual_mul(dual((double)(p->n + 1)), u->u)"),
    ("p.n * 2 - u.u", "(double)(p->n * 2) - u->u", "dual_sub(dual((double)(p->n * 2)), u->u)"),
    ("p.n / 4", "(double)p->n / 4.0", "dual_div(dual((double)p->n), dual(4.0))"),
    ("2 * u.u", "2.0 * u->u", "dual_mul(dual(2.0), u->u)"),
    ("math.inf", "INFINITY", "dual(INFINITY)"),
    ("-math.inf", "-INFINITY", "dual(-INFINITY)"),
    ("math.pi * u.u", "3.141592653589793 * u->u", "dual_mul(dual(3.141592653589793), u->u)"),
    ("SCALE * u.u", "SCALE * u->u", "dual_mul(dual(SCALE_dual), u->u)"),
    ("COUNT * 1.5", "(double)COUNT * 1.5", "dual_mul(dual((double)COUNT_dual), dual(1.5))"),
    ("float(-p.n)", "(double)-p->n", "dual((double)-p->n)"),
    ("float(-(p.n - 1))", "(double)-(p->n - 1)", "dual((double)-(p->n - 1))"),
    ("float(p.n - (p.n - 1))", "(double)(p->n - (p->n - 1))", "dual((double)(p->n - (p->n - 1)))"),
    ("float(-(-2))", "2.0", "dual(2.0)"),
    ("float(p.n * -2)", "(double)(p->n * -2)", "dual((double)(p->n * -2))"),
    ("float(p.n % 3)", "(double)int_mod(p->n, 3)", "dual((double)int_mod(p->n, 3))"),
    ("float(abs(p.n))", "(double)abs(p->n)", "dual((double)abs(p->n))"),
    ("float(min(p.n, 2, 1))", "(double)int_lesser(int_lesser(p->n, 2), 1)",
     "dual((double)int_lesser(int_lesser(p->n, 2), 1))"),
    ("float(max(p.n, 2))", "(double)int_greater(p->n, 2)", "dual((double)int_greater(p->n, 2))"),
    ("float(int(p.n))", "(double)p->n", "dual((double)p->n)"),
    ("float(len(p.L))", "(double)3", "dual((double)3)"),
    ("p.L[-1]", "p->L.item[2]", "p->L.item[2]"),
    ("p.L[-3]", "p->L.item[0]", "p->L.item[0]"),
    ("p.L[p.n]", "p->L.item[checked_index(p->n, 3, fault)]", "p->L.item[checked_index(p->n, 3, fault)]"),
    ("p.L[1:][0]", "p->L.item[1]", "p->L.item[1]"),
    ("p.L[:2][1]", "p->L.item[1]", "p->L.item[1]"),
    ("p.L[::-1][0]", "p->L.item[2]", "p->L.item[2]"),
    ("(p.L + (1.0, 2.0))[4]", "2.0", "dual(2.0)"),
    ("(u.u, s.x, dt)[1]", "s->x", "s->x"),
    ("(u.u, *p.L)[2]", "p->L.item[1]", "p->L.item[1]"),
    ("(u.u, s.x)[p.n]", "(Doubles2){{u->u, s->x}}.item[checked_index(p->n, 2, fault)]",
     "(Duals2){{u->u, s->x}}.item[checked_index(p->n, 2, fault)]"),
    ("shifted(u.u)", "shifted(u->u, 0.75, fault)", "shifted_dual(u->u, dual(0.75), fault)"),
    ("shifted(by=1, a=u.u)", "shifted(u->u, 1.0, fault)", "shifted_dual(u->u, dual(1.0), fault)"),
    ("sorted_pair(u.u, 2).left", "sorted_pair(u->u, 2.0).left", "sorted_pair_dual(u->u, dual(2.0)).left"),
    ("sorted_pair(u.u, s.x)[1]", "sorted_pair(u->u, s->x).right", "sorted_pair_dual(u->u, s->x).right"),
    ("Pair(u.u, right=s.x).left", "(Pair){u->u, s->x}.left", "(Pair_dual){u->u, s->x}.left"),
    ("u.u if u.u < s.x else 1", "u->u < s->x ? u->u : 1.0", "u->u.v < s->x.v ? u->u : dual(1.0)"),
    ("(u.u if u.u < 1.0 else s.x) + 1.0", "(u->u < 1.0 ? u->u : s->x) + 1.0",
     "dual_add(u->u.v < 1.0 ? u->u : s->x, dual(1.0))"),
    ("u.u if u.u < 1.0 else s.x if s.x < 2.0 else dt", "u->u < 1.0 ? u->u : s->x < 2.0 ? s->x : dt",
     "u->u.v < 1.0 ? u->u : s->x.v < 2.0 ? s->x : dt"),
    ("(u.u if u.u < 1.0 else s.x) if s.x < 2.0 else dt", "s->x < 2.0 ? (u->u < 1.0 ? u->u : s->x) : dt",
     "s->x.v < 2.0 ? (u->u.v < 1.0 ? u->u : s->x) : dt"),
)  # fmt: skip
"""In Python, in C, and in C on numbers with a derivative."""


@pytest.mark.parametrize(("text", "plain", "dual"), EXPRESSIONS)
def test_an_expression_is_the_same_operations_in_the_same_order(text: str, plain: str, dual: str) -> None:
    made = module(f"y = {text}\nreturn State(y), Outputs(y)\n", 1)
    for arithmetic, kind, expected in ((Plain(), "double", plain), (Dual(), "Dual", dual)):
        first, second, *_ = body(made, arithmetic)
        assert first == f"    {kind} y = {expected};"
        fails = "fault)" in expected
        assert second.startswith("    if (RARELY(fault->raised)) return nothing_State") is fails


@pytest.mark.parametrize(
    ("text", "plain"),
    [
        ("(u.u < s.x or u.u > dt) and dt < 1.0", "(u->u < s->x || u->u > dt) && dt < 1.0"),
        ("u.u < s.x and u.u > dt or dt < 1.0", "(u->u < s->x && u->u > dt) || dt < 1.0"),
        ("u.u < s.x and (u.u > dt and dt < 1.0)", "u->u < s->x && (u->u > dt && dt < 1.0)"),
        ("u.u < s.x or u.u > dt or dt < 1.0", "u->u < s->x || u->u > dt || dt < 1.0"),
        ("not u.u < s.x", "!(u->u < s->x)"),
        ("not (u.u < s.x and s.x < 1.0)", "!(u->u < s->x && s->x < 1.0)"),
        ("not math.isfinite(u.u)", "!isfinite(u->u)"),
        ("not not math.isnan(u.u)", "!(!isnan(u->u))"),
        ("u.u < s.x < -1.5", "u->u < s->x && s->x < -1.5"),
        ("0.5 <= u.u != s.x >= 2", "0.5 <= u->u && u->u != s->x && s->x >= 2.0"),
        ("(u.u < s.x) == (dt != 1.0)", "(u->u < s->x) == (dt != 1.0)"),
        ("(u.u < s.x) != True", "(u->u < s->x) != true"),
        ("p.n == 2", "p->n == 2"),
        ("p.n + 1 < COUNT * 2", "p->n + 1 < COUNT * 2"),
        ("p.n < u.u", "(double)p->n < u->u"),
        ("u.u + 1.0 > -s.x", "u->u + 1.0 > -s->x"),
        ("False", "false"),
    ],
)  # fmt: skip
def test_a_condition_groups_as_in_python(text: str, plain: str) -> None:
    made = module(f"y = 0.0\nif {text}:\n    y = 1.0\nreturn State(y), Outputs(y)\n", 1)
    assert body(made, Plain())[1] == f"    if ({plain}) {{"
    if " + 1.0" in text:
        return
    dual = body(made, Dual())[1].replace(".v", "").replace("dual((double)p->n)", "(double)p->n")
    assert dual.replace("_dual", "") == f"    if ({plain}) {{"  # values decide, derivatives do not


STATEMENTS = (
    ("x = u.u\nx += s.x * 2.0\nx -= 1.0 / s.x\nx *= 3\nx /= 2.0\nx += p.n",
     ["double x = u->u;", "x += s->x * 2.0;", "x -= checked_div(1.0, s->x, fault);", CHECK, "x *= 3.0;",
      "x = x / 2.0;", "x += (double)p->n;"]),
    ("j = p.n\nj += 2\nj *= j\nj -= 1\nx = float(j)",
     ["int j = p->n;", "j += 2;", "j *= j;", "j -= 1;", "double x = (double)j;"]),
    ("x = 0.0\nfor i in range(3):\n    x += i\nfor i in range(1, p.n):\n    x += i",
     ["double x = 0.0;", "for (int i = 0; i < 3; i++) {", "    x += (double)i;", "}",
      "for (int i = 1; i < p->n; i++) {", "    x += (double)i;", "}"]),
    ("x = 0.0\nfor i in range(3, 0, -1):\n    x += i\nfor i in range(1, 9, 1):\n    continue",
     ["double x = 0.0;", "for (int i = 3; i > 0; i--) {", "    x += (double)i;", "}",
      "for (int i = 1; i < 9; i++) {", "    continue;", "}"]),
    ("x = 0.0\nn = p.n\nfor i in range(n):\n    n = 1\n    x += i",
     ["double x = 0.0;", "int n = p->n;", "const int value_1 = n;", "for (int i = 0; i < value_1; i++) {",
      "    n = 1;", "    x += (double)i;", "}"]),
    ("x = 0.0\nfor i in range(p.n + int(u.u)):\n    x = 1.0",
     ["double x = 0.0;", "const int value_1 = p->n + checked_int(u->u, fault);", CHECK,
      "for (int i = 0; i < value_1; i++) {", "    x = 1.0;", "}"]),
    ("x = 0.0\nfor w in (1.0, -2.0):\n    x += w\nfor w in (3.0,):\n    x += w\nfor w in (4.0,):\n    x += w",
     ["double x = 0.0;", "const double w_each[2] = {1.0, -2.0};", "for (int w_at = 0; w_at < 2; w_at++) {",
      "    const double w = w_each[w_at];", "    x += w;", "}", "const double w_each_[1] = {3.0};",
      "for (int w_at = 0; w_at < 1; w_at++) {", "    const double w = w_each_[w_at];", "    x += w;", "}",
      "const double w_each__[1] = {4.0};", "for (int w_at = 0; w_at < 1; w_at++) {",
      "    const double w = w_each__[w_at];", "    x += w;", "}"]),
    ("a, b = u.u, s.x\na, b = b, a\nx = a - b",
     ["double a = u->u;", "double b = s->x;", "const double value_1 = b;", "const double value_2 = a;", "a = value_1;",
      "b = value_2;", "double x = a - b;"]),
    ("a, b = u.u, 2.0\na, b = b, 1.0\nx = a - b",
     ["double a = u->u;", "double b = 2.0;", "const double value_1 = b;", "a = value_1;", "b = 1.0;",
      "double x = a - b;"]),
    ("w = sorted_pair(u.u, s.x)\nl, r = w\nq, _ = sorted_pair(l, r)\nx = q",
     ["Pair w = sorted_pair(u->u, s->x);", "double l = w.left;", "double r = w.right;",
      "const Pair value_1 = sorted_pair(l, r);", "double q = value_1.left;", "double x = q;"]),
    ("if u.u > 0.0:\n    x = 1.0\n    f = True\n    t = (1.0, 2.0)\n    k = 2\nelse:\n    x = 2.0\n    f = False\n"
     "    t = p.L[:2]\n    k = 3\nx += t[0] + k if f else x",
     ["double x = 0.0;", "bool f = 0;", "Doubles2 t = nothing_Doubles2;", "int k = 0;", "if (u->u > 0.0) {",
      "    x = 1.0;", "    f = true;", "    t = (Doubles2){{1.0, 2.0}};", "    k = 2;", "} else {", "    x = 2.0;",
      "    f = false;", "    t = (Doubles2){{p->L.item[0], p->L.item[1]}};", "    k = 3;", "}",
      "x += f ? t.item[0] + (double)k : x;"]),
    ("x = 1.0\nif u.u > 0.0:\n    x = 2.0\nelif s.x > 0.0:\n    pass\nelif 1.0 / s.x > 2.0:\n    x = 4.0\n"
     "else:\n    x = 5.0",
     ["double x = 1.0;", "if (u->u > 0.0) {", "    x = 2.0;", "} else if (s->x > 0.0) {", "} else {",
      "    const bool value_1 = checked_div(1.0, s->x, fault) > 2.0;", f"    {CHECK}", "    if (value_1) {",
      "        x = 4.0;", "    } else {", "        x = 5.0;", "    }", "}"]),
    ("x = 1.0\nif u.u > 0.0:\n    x = 2.0\nelif (*sorted_pair(u.u, s.x), dt)[1] > 2.0:\n    x = 4.0",
     ["double x = 1.0;", "if (u->u > 0.0) {", "    x = 2.0;", "} else {",
      "    const Pair value_2 = sorted_pair(u->u, s->x);", "    if (value_2.right > 2.0) {", "        x = 4.0;",
      "    }", "}"]),
    ("x = 1.0\nwhile x < 5.0:\n    x *= 2.0\nwhile 8.0 / x > 1.0:\n    x *= 2.0\nwhile True:\n    break",
     ["double x = 1.0;", "while (x < 5.0) {", "    x *= 2.0;", "}", "for (;;) {",
      "    const bool value_1 = checked_div(8.0, x, fault) > 1.0;", f"    {CHECK}", "    if (!(value_1)) break;",
      "    x *= 2.0;", "}", "for (;;) {", "    break;", "}"]),
    ("unused = u.u\nx = 1.0\nshifted(x)",
     ["double unused = u->u;", "(void)unused;", "double x = 1.0;", "shifted(x, 0.75, fault);", CHECK]),
    ("x = u.u\nif x > 2.0:\n    raise ValueError(f'x = {x!r} 5 % of {p.n}, {p.n:.2f} or {x:.3g}')",
     ["double x = u->u;", "if (x > 2.0) {",
      '    fault_raise(fault, "x = %r 5 %% of %d, %.2f or %.3g", x, p->n, (double)p->n, x);',
      "    return nothing_State_and_Outputs;", "}"]),
    ("u = Inputs(2.0)\nx = u.u", ["u = (Inputs){2.0};", "double x = u.u;"]),
    ("dt = dt * 2.0\nx = dt", ["dt = dt * 2.0;", "double x = dt;"]),
    ("x: float = 2.5\nx = 3", ["double x = 2.5;", "x = 3.0;"]),
    ("double = u.u\nx = double", ["double double_ = u->u;", "double x = double_;"]),
    ("x = 1.0 / (1.0 / u.u)", ["double x = checked_div(1.0, checked_div(1.0, u->u, fault), fault);", CHECK]),
)  # fmt: skip


@pytest.mark.parametrize(("text", "lines"), STATEMENTS)
def test_statements_are_one_for_one(text: str, lines: list[str]) -> None:
    found = body(module(f"{text}\nreturn State(x), Outputs(x)\n", 1), Plain())
    assert found == [*(f"    {line}" for line in lines), f"    {RETURN}"]


def test_a_name_that_is_read_as_it_is_first_written_is_not_declared_there() -> None:
    """Of an argument; with derivatives a step that cannot fail any more asks for nothing."""
    text = "x = u.u / s.x\nif u.u / x > 1.0:\n    x = 2.0\nreturn State(x), Outputs(x)\n"
    dual = body(module(text, 1), Dual())
    assert dual == [
        "    Dual x = dual_div(u->u, s->x);", "    if (dual_div(u->u, x).v > 1.0) {", "        x = dual(2.0);", "    }",
        "    return (State_dual_and_Outputs_dual){(State_dual){x}, (Outputs_dual){x}};",
    ]  # fmt: skip


NAMED = '''
import math
from typing import Annotated, NamedTuple
from tsm_fmu.models.contract import Quantity
NAME = "Tried"
_RATE = 2.5
COUNT = 7
class Fault(NamedTuple):
    a: float
    register: float
class Params(NamedTuple):
    k: Annotated[float, Quantity("N", "gain")] = 1.0
class State(NamedTuple):
    pass
class Inputs(NamedTuple):
    u: Annotated[float, Quantity("1", "input")]
class Outputs(NamedTuple):
    y: Annotated[float, Quantity("1", "output")]
PRESETS = {}
def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(), Outputs(0.0)
def exp(a: float, flag: float) -> float:
    """``Twice``
    of it.

    More.
    """
    return 2.0 * a
def _hidden(f: Fault) -> float:
    # above
    return f.a - f.register  # beside
# between functions
def noted(a: float) -> None:
    if a > 5.0:
        raise ValueError("too large")
def fifth() -> float:
    return 5.0  # noqa: none of ours
def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    noted(u.u)
    return State(), Outputs(exp(u.u, 1.0) + _hidden(Fault(_RATE, COUNT)) * fifth())
'''


@pytest.fixture(scope="module")
def named() -> ModuleType:
    made = ModuleType("a.tried_out")
    made.__dict__.update(SOURCE_TEXT=textwrap.dedent(NAMED), __file__="tried.py", __doc__="First.\n\nSecond */ line.")
    exec(compile(NAMED, "tried.py", "exec", dont_inherit=True), made.__dict__)  # noqa: S102  our own text
    return made


def test_names_that_c_or_the_layers_have_already_get_the_files_before_them(named: ModuleType) -> None:
    plain, dual = units(named)
    assert [law.c_name for law in plain.laws] == ["start", "noted", "tried_out_exp", "hidden_", "fifth", "step"]
    assert [law.c_name for law in dual.laws] == [f"{law.c_name}_dual" for law in plain.laws]
    assert plain.constants == {"RATE_": 2.5, "COUNT": 7}
    prototypes = {law.c_name: plain.prototype(law) for law in plain.laws}
    assert prototypes["noted"] == "static void noted(double a, Fault *fault)"
    assert prototypes["hidden_"] == "static double hidden_(const TriedOutFault *f)"
    assert prototypes["fifth"] == "static double fifth(void)"
    assert prototypes["step"] == (
        "static State_and_Outputs step(const Params *p, const State *s, const Inputs *u, double dt, Fault *fault)"
    )
    declared = plain.declarations()
    assert declared[:3] == ["static const double RATE_ = 2.5;", "static const int COUNT = 7;", ""]
    at = declared.index("} TriedOutFault;")
    assert declared[at - 3 : at] == ["typedef struct {", "    double a;", "    double register_;"]
    assert "static const State_and_Outputs nothing_State_and_Outputs;" in declared
    assert plain.struct(Record(named.Params)) == ["typedef struct {", "    double k;  /* [N] gain */", "} Params;"]
    assert dual.struct(Record(named.Params)) == ["typedef struct {", "    Dual k;", "} Params_dual;"]
    assert plain.struct(Record(named.State)) == ["typedef struct {", "    char none;", "} State;"]


def test_functions_stand_by_their_lines_with_the_first_words_of_their_text(named: ModuleType) -> None:
    plain, dual = units(named)
    text = "\n".join(plain.functions())
    order = ["/* ---- tried_out */", "start(", "tried_out_exp(", "hidden_(", "noted(", "fifth(", "step("]
    places = [text.index(word if "/*" in word else f" {word}") for word in order]
    assert places == sorted(places)
    assert "/* Twice of it. */\nstatic double tried_out_exp(double a, double flag)\n{\n    (void)flag;\n" in text
    assert "    /* above */\n    return f->a - f->register_;  /* beside */\n" in text
    assert "noqa" not in text
    assert "between" not in text
    assert "static double fifth(void)\n{\n    return 5.0;\n}" in text
    assert "    (void)p; (void)s; (void)dt;\n" in text
    assert "    hidden_(&(" not in text  # a struct that has no place of its own is put into an array of one
    assert "hidden_((TriedOutFault[1]){(TriedOutFault){RATE_, (double)COUNT}})" in text
    assert "/* Twice" not in "\n".join(dual.functions())


CONDITIONED = NAMED.replace(
    "PRESETS = {}",
    """PRESETS = {}
def margin(p: Params) -> float:
    return p.k - 1.0
def turns(p: Params) -> int:
    return 3
def half(p: Params) -> float:
    return 0.5 * p.k
CONDITIONS = (
    Condition("k > 1 */", margin, "k = {k} with {turns} or {turns:g} and {half:.3g}, 5 % of {margin!r}", "raise k",
              numbers={"turns": turns, "half": half}),
    Condition("k >= 1", margin, "k = {k:.2f}", "raise k", closed=True, consequence="it is slow"),
)
""",
).replace("import Quantity", "import Condition, Quantity")


def test_a_joint_condition_is_a_margin_and_a_sentence_with_its_numbers_as_python_prints_them() -> None:
    made = ModuleType("a.tried_out")
    made.__dict__.update(SOURCE_TEXT=CONDITIONED, __file__="tried.py")
    exec(compile(CONDITIONED, "tried.py", "exec", dont_inherit=True), made.__dict__)  # noqa: S102  our own text
    text = "\n".join(Conditions(Unit(made, Plain())).functions())
    check, warn = text.split("void model_warnings(")
    assert "if (!fault->raised) {  /* k > 1 * / */" in check
    assert "double margin = margin(p);" in check
    assert "if (!fault->raised && !(margin > 0.0)) {" in check
    assert "if (!fault->raised && !(margin >= 0.0)) {" in warn
    raised = " ".join(check.partition("fault_raise(")[2].split())
    assert raised.startswith(
        'fault, "k = %r with %d or %g and %.3g, 5 %% of %r -- expected k > 1 */ -- raise k", p->k, turns(p), '
        "(double)turns(p), half(p), margin);"
    )
    told = " ".join(warn.partition("sentence_put(")[2].split())
    assert told.startswith('text, sizeof text, "k = %.2f -- it is slow -- raise k", p->k); tell(whom, text);')
    assert "fault_raise" not in warn
    assert "tell(" not in check


def test_comments_of_a_function_are_those_between_its_lines(named: ModuleType) -> None:
    lines = NAMED.splitlines()
    above, beside = (n for n, line in enumerate(lines, 1) if "# above" in line or "# beside" in line)
    assert source(named._hidden, named).comments == {above: ("above", True), beside: ("beside", False)}
    for other in (named.noted, named.exp, named.fifth):
        assert source(other, named).comments == {}


def test_parts_of_structs_are_reached_by_pointer_or_by_name() -> None:
    assert member("(*p)", ".x") == "p->x"
    assert member("p", ".x") == "p.x"
    array, mixed = Array(FLOAT, 2), Mixed((FLOAT, INT))
    assert (members(array), members(mixed)) == ([".item[0]", ".item[1]"], [".item0", ".item1"])
    assert (items_of(array), items_of(mixed), items_of(FLOAT)) == ([FLOAT, FLOAT], [FLOAT, INT], None)
    assert [c_variable(w) for w in ("x", "auto", "dual", "fault")] == ["x", "auto_", "dual_", "fault_"]
    assert {"while", "double", "typedef"} <= C_WORDS
