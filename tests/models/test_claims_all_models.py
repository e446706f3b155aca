"""Claims that every model in the registry has to keep; a new model is covered by being registered."""

from __future__ import annotations

import ast
import inspect
import json
import math
import re
import sys
from pathlib import Path

import numpy as np
import pytest

from tsm_fmu import InputError, models
from tsm_fmu.effects import EFFECTS
from tsm_fmu.kernels.kernel import Kernel
from tsm_fmu.logs.units import same_quantity, unit_to_si
from tsm_fmu.models import MODELS
from tsm_fmu.models.contract import conditions_of, flat, packed, variables

KERNELS = [Kernel(module) for module in MODELS]
PRESETS = [(k, preset) for k in KERNELS for preset in k.presets]
PARAMETERS = [(k, v) for k in KERNELS for v in k.parameters]
EQUATION = re.compile(r"(?<!\w)\(([A-Z]?\d+)[a-z]?\)")  # (23), (5b), (T1), but not sgn(0)
# MMT 2015 identifies this set per radian of the pulley; the numbers stand under the names of metres, as its text says
PER_RADIAN = {("LuGreFriction", "mmt2015")}

every_model = pytest.mark.parametrize("model", KERNELS, ids=lambda k: k.name)
every_preset = pytest.mark.parametrize(
    ("model", "preset"), PRESETS, ids=lambda x: x.name if isinstance(x, Kernel) else x
)


def smooth_inputs(model: Kernel, t: np.ndarray, seed: int) -> np.ndarray:
    """Sums of sines of seeded frequency: positions and tensions stay positive, voltages and rates take both signs."""
    rng = np.random.default_rng(seed)
    columns = []
    for v in model.inputs:
        f, phase = rng.uniform(0.1, 1.5, 3)[:, None], rng.uniform(0.0, math.tau, 3)[:, None]
        wave = (np.array([0.5, 0.3, 0.15])[:, None] * np.sin(math.tau * f * t + phase)).sum(axis=0)
        amplitude, offset = {"rad": (2.5, 3.0), "N": (4.0, 5.0), "V": (9.0, 0.0), "m/s": (0.03, 0.0)}.get(
            v.quantity.unit, (0.7, 0.0)
        )
        columns.append(offset + amplitude * wave)
    return np.column_stack(columns) if columns else np.empty((t.size, 0))


@every_model
def test_declaration_is_complete(model: Kernel) -> None:
    module = model.module
    names = [v.name for v in model.parameters + model.inputs + model.outputs]
    assert len(set(names)) == len(names)
    assert module.NAME == model.name
    assert model.outputs
    for v in model.parameters + model.inputs + model.outputs:
        assert len(v.quantity.meaning) > 3
        assert unit_to_si(v.quantity.unit).factor == 1.0, f"{v.name} [{v.quantity.unit}] is not SI"
        if v.quantity.display:
            assert same_quantity(v.quantity.display, v.quantity.unit), v.name
        assert re.fullmatch(r"[A-Za-z][A-Za-z0-9_.]*", v.name)
    for v in model.parameters + model.inputs:  # an output has no start value
        assert v.quantity.lo <= v.start <= v.quantity.hi, f"{v.name} starts outside its bounds"
    assert all(v.kind is float for v in variables(module.State)), "the compiled form needs one type from step to step"


@every_model
def test_docstring_has_numbered_equations_a_source_and_the_validity(model: Kernel) -> None:
    text = inspect.getdoc(model.module) or ""
    numbers = set(EQUATION.findall(text))
    assert numbers, "no equation number"
    assert re.search(r"IFToMM|ICINCO|MMT|MSSP|AME|Adv\. Mech|Source|Astrom", text), "no source"
    assert re.search(r"[Vv]alid", text), "nothing about validity"
    comments = re.findall(r"#(.*)", inspect.getsource(model.module))
    cited = {number for comment in comments for number in EQUATION.findall(comment)}
    shared = {getattr(part, "__module__", "") for part in vars(model.module).values()}
    for name in shared & sys.modules.keys():
        if name.startswith("tsm_fmu."):
            numbers |= set(EQUATION.findall(sys.modules[name].__doc__ or ""))
    assert cited <= numbers, "a comment cites an equation that no docstring has"


@every_model
def test_first_preset_is_the_default(model: Kernel) -> None:
    first = next(iter(model.presets))
    assert model.params(first) == model.params()


@every_preset
def test_preset_is_accepted_and_equals_its_printed_numbers(model: Kernel, preset: str) -> None:
    p = model.params(preset)
    declared = {v.name: v for v in model.parameters}
    entry = model.presets[preset]
    assert len(entry.source) > 5
    assert entry.printed
    assert set(entry.si) <= set(declared)
    for name, (number, unit) in entry.printed.items():
        variable = declared[name]
        value = model.named(p)[name]
        if (model.name, preset) in PER_RADIAN:
            assert value == number
        else:
            assert same_quantity(unit, variable.quantity.unit), f"{name}: {unit} for {variable.quantity.unit}"
            assert value == pytest.approx(number * unit_to_si(unit).factor, rel=1e-12), name


@every_preset
def test_compiled_equals_plain_bit_for_bit(model: Kernel, preset: str) -> None:
    t = np.cumsum(np.random.default_rng(11).uniform(2e-4, 9e-3, 1200))
    inputs = smooth_inputs(model, t, seed=4)
    p = model.params(preset)
    compiled = model.simulate(p, t, inputs)
    assert np.isfinite(compiled).all()
    assert np.ptp(compiled, axis=0).max() > 0.0  # something happened
    np.testing.assert_array_equal(compiled, model.simulate(p, t, inputs, compiled=False))


@every_preset
def test_state_survives_json_bit_for_bit(model: Kernel, preset: str) -> None:
    module, p = model.module, model.params(preset)
    t = np.arange(400) * 3.1e-3
    rows = [module.Inputs(*row) for row in smooth_inputs(model, t, seed=8).tolist()]
    s, _ = module.start(p, rows[0])
    for u in rows[1:237]:
        s, _ = module.step(p, s, u, 3.1e-3)
    assert all(type(value) is float for value in flat(s))
    restored = packed(module.State, json.loads(json.dumps(flat(s))))
    for u in rows[237:]:
        s, there = module.step(p, s, u, 3.1e-3)
        restored, here = module.step(p, restored, u, 3.1e-3)
        assert here == there
    assert restored == s


@every_preset
def test_zero_input_stays_bounded(model: Kernel, preset: str) -> None:
    t = np.arange(8000) * 0.013
    y = np.abs(model.simulate(model.params(preset), t, np.zeros((t.size, len(model.inputs)))))
    assert np.isfinite(y).all()
    growth = 1e-6 if model.inputs else 1e-2  # a signal of its own meets its highest peak at some sample only
    assert (y[4000:].max(axis=0) <= y[:4000].max(axis=0) * (1 + growth) + 1e-12).all()


@every_model
def test_output_does_not_depend_on_what_ran_before(model: Kernel) -> None:
    t = np.arange(300) * 2.3e-3
    inputs = smooth_inputs(model, t, seed=21)
    first = model.simulate(model.params(), t, inputs)
    model.simulate(model.params(), t, inputs[::-1].copy())
    np.testing.assert_array_equal(model.simulate(model.params(), t, inputs), first)


def drawn(model: Kernel, rng: np.random.Generator) -> dict[str, float]:
    """Values within the bounds, up to a decade away from the defaults; integers anywhere in theirs."""
    values = {}
    for v in model.parameters:
        q = v.quantity
        if v.kind is int:
            values[v.name] = int(rng.integers(int(q.lo), int(q.hi) + 1))
            continue
        value = (v.start or 0.1) * 10.0 ** rng.uniform(-1.0, 1.0) * (-1.0 if q.lo < 0.0 and rng.random() < 0.3 else 1.0)
        value = 0.0 if q.lo == 0.0 and not q.open_lo and rng.random() < 0.1 else value
        values[v.name] = value if q.lo < value < q.hi or value == q.lo == 0.0 else v.start
    return values


CONDITIONS = [(k, c) for k in KERNELS for c in conditions_of(k.module)]


@pytest.mark.parametrize(("model", "condition"), CONDITIONS, ids=lambda x: getattr(x, "name", None))
def test_a_condition_can_be_met_and_broken_within_the_bounds_and_says_so_in_one_line(model, condition) -> None:
    rng = np.random.default_rng(23)
    equal = {"rho2": 0.37, "mu3": -0.37}  # the one condition that chance alone does not break
    sides = set()
    for trial in range(600):
        values = drawn(model, rng) | (
            equal if trial == 0 and equal.keys() <= {v.name for v in model.parameters} else {}
        )
        p = packed(model.module.Params, list(values.values()))
        met = condition.met(p)
        sides.add(met)
        if met:
            continue
        if not condition.consequence:
            with pytest.raises(InputError):
                model.check(p)
        sentence = condition.sentence(p)
        what, expected, remedy = sentence.split(" -- ")
        assert expected == (f"expected {condition.expectation(p)}" if not condition.consequence else expected)
        assert "\n" not in sentence
        assert not set("{}") & set(sentence)
        assert what
        assert remedy
    assert sides == {True, False}


@every_model
def test_roles_name_what_the_model_declares(model: Kernel) -> None:
    roles = model.roles
    inputs, outputs, parameters = ({v.name for v in part} for part in (model.inputs, model.outputs, model.parameters))
    assert roles.motion in inputs | {""}
    assert {roles.load, roles.drive} <= inputs | outputs | {""}
    assert {*roles.offsets, *roles.initial} <= parameters
    assert set(roles.depends) <= outputs
    assert {name for names in roles.depends.values() for name in names} <= inputs
    assert set(roles.has) <= {effect.NAME for effect in EFFECTS}
    assert {name for names in roles.has.values() for name in names} <= parameters
    if roles.friction:
        assert roles.friction.like in inputs | outputs
    if roles.held_load:
        assert roles.load in outputs
        assert "hold" in parameters
        assert {"slid", "v_in", roles.load} <= {v.name for v in variables(model.module.State)}


@pytest.mark.parametrize("model", [k for k in KERNELS if k.roles.friction], ids=lambda k: k.name)
def test_the_friction_written_into_the_outputs_is_the_one_read_out_of_them(model: Kernel) -> None:
    port = model.roles.friction
    assert port is not None
    p, t = model.params(), np.arange(40) * 3.7e-3
    columns = [*smooth_inputs(model, t, seed=5).T]
    u, o = model.module.Inputs(*columns), model.module.Outputs(*model.simulate(p, t, np.column_stack(columns)).T)
    f = port.read(p, u, o)
    for before, after in zip(o, port.write(p, u, o, f), strict=True):
        np.testing.assert_allclose(after, before, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(port.read(p, u, port.write(p, u, o, 1.37 * f - 0.213)), 1.37 * f - 0.213, rtol=1e-10)


def _sides(variable):  # (bound, open, a value beyond it)
    q = variable.quantity
    for bound, is_open, beyond in ((q.lo, q.open_lo, -math.inf), (q.hi, q.open_hi, math.inf)):
        if math.isfinite(bound):
            step = math.copysign(1.0, beyond)
            yield bound, is_open, bound + step if variable.kind is int else math.nextafter(bound, beyond)


def _try_params(model: Kernel, values: dict[str, float]):
    try:
        return model.params(values=values), ""
    except InputError as refusal:
        return None, str(refusal)


@pytest.mark.parametrize(
    ("model", "variable"), PARAMETERS, ids=lambda x: x.name if isinstance(x, Kernel) else f"{x.name}"
)
def test_parameter_at_its_bounds_is_accepted_or_refused_as_declared(model: Kernel, variable) -> None:
    for unusable in (math.nan, math.inf, -math.inf, "much"):
        with pytest.raises(InputError, match=rf"^parameter {re.escape(variable.name)} = .* -- expected "):
            model.params(values={variable.name: unusable})
    expected = r"\d+ \(.*\)" if variable.quantity.choices else "a value in .*"  # names of a choice, or bounds
    outside = rf"^parameter {re.escape(variable.name)} = .* -- expected {expected} -- choose a value inside$"
    t = np.arange(60) * 2.9e-3
    for bound, is_open, beyond in _sides(variable):
        with pytest.raises(InputError, match=outside):
            model.params(values={variable.name: beyond})
        if is_open:
            with pytest.raises(InputError, match=outside):
                model.params(values={variable.name: bound})
            continue
        p, refusal = _try_params(model, {variable.name: bound})
        if p is None:  # a joint condition may exclude it, but not its own bound
            assert not re.match(outside, refusal)
            assert refusal.count(" -- ") == 2
            continue
        y = model.simulate(p, t, smooth_inputs(model, t, seed=2))
        assert np.isfinite(y).all()


@every_model
@pytest.mark.parametrize("compiled", [True, False])
def test_bad_records_are_refused_by_name(model: Kernel, compiled: bool) -> None:
    t, p = np.arange(5) * 0.01, model.params()
    inputs = smooth_inputs(model, t, seed=1)
    with pytest.raises(InputError, match=rf"^inputs of shape .* for {model.name} -- expected \(5, "):
        model.simulate(p, t, np.ones((5, len(model.inputs) + 1)), compiled=compiled)
    with pytest.raises(InputError, match=r"^time .* s in row 3 -- expected more than"):
        model.simulate(p, [0.0, 0.01, 0.02, 0.015, 0.03], inputs, compiled=compiled)
    for j, v in enumerate(model.inputs):
        broken = inputs.copy()
        broken[2, j] = math.nan
        with pytest.raises(InputError, match=rf"^input {re.escape(v.name)} = nan in row 2 \(t = 0\.02 s\)"):
            model.simulate(p, t, broken, compiled=compiled)


PACKAGE = Path(models.__file__).parents[1]
REACH = {"models": {"models"}, "effects": {"effects", "models"}}
FILES = [
    (file, reach)
    for folder, reach in REACH.items()
    for file in sorted((PACKAGE / folder).rglob("*.py"))
    if file.name != "__init__.py"  # registries stay at home: a file of an FMU imports kernels by name
]


@pytest.mark.parametrize(("file", "reach"), FILES, ids=[f.relative_to(PACKAGE).as_posix() for f, _ in FILES])
def test_kernel_files_import_math_typing_and_each_other_alone(file: Path, reach: set[str]) -> None:
    here = file.relative_to(PACKAGE).parts[:-1]
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            assert {alias.name for alias in node.names} <= {"math", "typing"}
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            assert node.module in {"math", "typing"}
        elif isinstance(node, ast.ImportFrom):
            assert node.level <= len(here) + 1
            reached = [*here[: len(here) + 1 - node.level], *(node.module or "").split(".")]
            assert reached[0] in reach
            # the compiler clones a function's globals: a module's attribute would stay uncompiled
            assert node.module, f"line {node.lineno} imports a module"
