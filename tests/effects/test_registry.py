"""An effect is one file and one line of the registry: what its file says is complete, and nothing else names it."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Annotated, NamedTuple, get_args

import numpy as np
import pytest

import tsm_fmu
from tsm_fmu.effects import EFFECTS, FAMILIES, about, looks_like, roles_of, shapes_of, sizes_of, words
from tsm_fmu.effects.about import Family, Size
from tsm_fmu.kernels.kernel import Kernel
from tsm_fmu.models.contract import InputError, Quantity

SRC = Path(tsm_fmu.__file__).parent
IDS = frozenset(module.NAME for module in EFFECTS)
OWN_WORDS = ("models", "scenarios", "reproduction")
"""Folders that speak of physics and papers in the field's words, which effects share; they know no effects."""
OTHER_MEANING = {("checking/sensor.py", "quantisation"), ("cosim/order.py", "delay")}
"""Files where such a word is something else: the kind of a finding in a log, a way to break an algebraic loop."""
UNITS = {
    "stroke": "{x}", "per stroke": "1/({y})", "position": "{x}|rad", "travel": "{x}", "speed": "{x}/s",
    "acceleration": "{x}/s2", "time": "s", "load": "{load}", "turns": "{x}/rad", "angle": "rad", "number": "1|1/{bend}",
    "share": "1", "exponent": "1", "width": "rad", "centre": "{x}",
}  # fmt: skip
"""Unit of a shape by its scale."""

each = pytest.mark.parametrize("module", EFFECTS, ids=lambda m: m.NAME)


@each
def test_what_is_known_is_complete(module):
    known = module.ABOUT
    assert len(known.shown_by.split()) >= 4
    assert known.signature
    assert "_" not in known.words + known.words_on_motion
    assert bool(known.words_on_motion) == ("lost motion" in known.places)
    assert not (known.words_on_motion and {"output", "input"} & set(known.places))  # its channel says which it is
    assert set(known.places) <= {"friction", "lost motion", "output", "input"}
    assert set(known.looked_for) <= set(known.places) - {"input"}
    assert set(known.looks_like) <= IDS - {module.NAME}
    assert known.turns >= 0.0
    assert known.family in FAMILIES
    assert set(FAMILIES) == set(get_args(Family))


def test_no_two_effects_have_the_same_words():
    on_motion = [m.ABOUT.words_on_motion for m in EFFECTS if m.ABOUT.words_on_motion]
    assert len({*(m.ABOUT.words for m in EFFECTS), *on_motion}) == len(EFFECTS) + len(on_motion)
    assert len({m.ABOUT.signature for m in EFFECTS}) == len(EFFECTS)
    assert words("delay") == "a delay"
    assert words("delay@tau_in") == "a delay in tau_in"
    assert words("load_dependence") == "load-dependent friction"
    assert words("load_dependence@x_out~f[N]") == "lost motion that grows with the load in x_out, driven by f"


def test_a_look_alike_is_one_whichever_file_says_so(monkeypatch):
    assert looks_like("delay@x_out", ["coulomb", "sensor_lag@tau_in"])
    assert not looks_like("delay@x_out", ["coulomb"])
    other = about("coulomb")._replace(looks_like=("delay",))
    monkeypatch.setattr(next(m for m in EFFECTS if m.NAME == "coulomb"), "ABOUT", other)
    assert looks_like("delay@x_out", ["coulomb"])
    assert looks_like("coulomb", ["delay"])


@each
def test_sizes_alone_take_an_effect_out_of_neutral_and_nothing_else_does(module):
    effect = Kernel(module)
    rng = np.random.default_rng(5)
    time = np.arange(60) * 5e-2
    grid = np.linspace(0.0, 12.0, time.size)
    signals = np.column_stack([np.interp(grid, np.arange(13), rng.normal(size=13)) for _ in effect.inputs])
    still = effect.simulate(module.NEUTRAL, time, signals, compiled=False)
    assert set(roles_of(module)) == {v.name for v in effect.parameters}
    for v in effect.parameters:
        step = np.copysign(0.07, sizes_of(module)[v.name].first) if v.name in sizes_of(module) else 0.07
        try:
            p = effect.params(None, {v.name: v.start + step})
        except InputError:
            p = effect.params(None, {v.name: v.start - step})
        changed = not np.array_equal(effect.simulate(p, time, signals, compiled=False), still)
        assert changed == (v.name in sizes_of(module)), v.name


@each
def test_ranges_of_shapes_are_in_their_unit_and_within_their_bounds(module):
    quantities = {v.name: v.quantity for v in Kernel(module).parameters}
    for name, shape in shapes_of(module).items():
        q = quantities[name]
        assert q.unit in UNITS[shape.scale].split("|"), name
        assert shape.lo <= shape.hi
        if shape.scale in ("number", "exponent", "angle", "share"):
            assert q.lo <= shape.lo <= shape.hi <= q.hi
        if shape.scale in ("position", "centre"):
            assert np.isneginf(q.lo)
            assert np.isposinf(q.hi)
        elif shape.scale not in ("angle", "share"):
            assert shape.lo > 0.0  # spread over its logarithm


def test_a_parameter_without_a_role_is_refused():
    class Params(NamedTuple):
        k: Annotated[float, Quantity("1", "a gain"), Size()] = 0.0
        x_s: Annotated[float, Quantity("m", "a position")] = 0.0

    module = ModuleType("nameless")
    vars(module)["Params"] = Params
    with pytest.raises(TypeError, match=r"x_s without a Size, Shape, Read or Start"):
        roles_of(module)


def mentions(path: Path) -> Iterator[tuple[str, int]]:
    """Ids of effects that a file holds as a whole string, and imports from a single effect.

    In a file that knows effects, identifiers too: elsewhere ``delay`` or ``slack`` is a word like any other.
    """
    tree = ast.parse(path.read_text(encoding="utf-8"))
    imports = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    knowing = any("effects" in [*(node.module or "").split("."), *(a.name for a in node.names)] for node in imports)
    for node in ast.walk(tree):
        line, found = getattr(node, "lineno", 0), []
        if not knowing and not isinstance(node, ast.Constant | ast.alias | ast.ImportFrom):
            continue
        match node:
            case ast.Constant(value=str(text)) if re.fullmatch(r"\w+([@.]\w*)*", text):
                found = [re.split("[@.]", text)[0]]
            case ast.Name(id=name) | ast.Attribute(attr=name) | ast.arg(arg=name) | ast.keyword(arg=str(name)):
                found = [name]
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name):
                found = [name]
            case ast.alias(name=name) if knowing or "effects" in name.split("."):
                found = name.split(".")
            case ast.ImportFrom(module=str(name)) if "effects" in name.split("."):
                found = name.split(".")
            case _:
                pass
        yield from ((name, line) for name in found if name in IDS)


def files() -> list[Path]:
    found = [path for path in SRC.rglob("*.py") if not path.is_relative_to(SRC / "effects")]
    assert len(found) > 100
    return found


def test_nothing_outside_the_folder_names_an_effect():
    named = []
    for path in files():
        place = path.relative_to(SRC).as_posix()
        if place.partition("/")[0] not in OWN_WORDS:
            named += [f"{place}:{line} {n}" for n, line in mentions(path) if (place, n) not in OTHER_MEANING]
    assert not named


def test_folders_with_words_of_their_own_know_no_effects():
    for path in (p for p in files() if p.relative_to(SRC).parts[0] in OWN_WORDS):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom):
                assert "effects" not in (node.module or "").split("."), path
                assert "effects" not in [alias.name for alias in node.names], path


def test_the_search_for_names_finds_them(tmp_path):
    texts = {
        "a.py": "X = 'delay'", "b.py": "X = ('delay@F', 1)", "c.py": "from ..effects.delay import KEPT",
        "d.py": "from ..effects import delay as late", "e.py": "from .. import effects\nX = effects.delay",
        "f.py": "X = 'a delay of'", "g.py": "from ..logs.delay import longest", "h.py": "def f(delay): return delay",
        "i.py": "from ..effects import EFFECTS\ndef f(delay): return delay",
    }  # fmt: skip
    found = {}
    for name, text in texts.items():
        (tmp_path / name).write_text(text)
        found[name] = len(list(mentions(tmp_path / name)))
    assert found == {"a.py": 1, "b.py": 1, "c.py": 1, "d.py": 1, "e.py": 1, "f.py": 0, "g.py": 0, "h.py": 0, "i.py": 2}
