"""The blind cases themselves: they share nothing with the package, hide what they say, and tell nobody."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from collections import Counter
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from benchmarks.blind.catalogue import GATE, STRATA, Case, catalogue, gate, selected
from benchmarks.blind.generate import answer, effects_of, make, unmodelled, write
from benchmarks.blind.hidden import FORMS, rms
from benchmarks.blind.instruments import Instruments, coloured
from benchmarks.blind.motions import KINDS, motion
from benchmarks.blind.operators import maxwell_slip
from benchmarks.blind.outside import OUTSIDE
from benchmarks.blind.plants import MODELS, channels, draw_rig, signals
from tsm_fmu.effects import EFFECTS
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import read_record

ROOT = Path(__file__).parents[1]

BLIND = ROOT / "benchmarks" / "blind"
PERFECT = Instruments(noise=0.0, encoder=0.0)
CASES = catalogue()


def of(stratum: str) -> list[Case]:
    return [c for c in CASES if c.stratum == stratum]


def logs(case: Case) -> dict[str, dict[str, np.ndarray]]:
    """Columns of the measured runs."""
    made = make(case)
    return {
        name: {column.split(" ")[0]: log[column].to_numpy() for column in log}
        for name, log in made.runs.items()
        if name.startswith("measured")
    }


def pooled(runs: dict[str, dict[str, np.ndarray]], column: str) -> np.ndarray:
    return np.concatenate([run[column] for run in runs.values()])


# -- shares nothing


@pytest.mark.parametrize("file", sorted(BLIND.glob("*.py")), ids=lambda f: f.stem)
def test_no_import_of_the_package(file: Path) -> None:
    modules = []
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            modules += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            modules.append("." * node.level + (node.module or ""))
    ours = [m for m in modules if m.lstrip(".").startswith("tsm_fmu")]
    assert all(m.startswith("tsm_fmu.cli") for m in ours)
    assert not ours or file.stem == "judge"
    assert not any(m.startswith("..") for m in modules)


def test_making_a_case_loads_nothing_of_the_package() -> None:
    code = (
        "import sys; from benchmarks.blind import catalogue, generate, score, table, judge;"
        "generate.make(catalogue.catalogue()[0]);"
        "print([m for m in sys.modules if m.startswith('tsm_fmu')])"
    )
    found = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


# -- the catalogue


def test_strata_names_and_seeds() -> None:
    count = Counter(c.stratum for c in CASES)
    assert len(CASES) >= 120
    assert set(count) == set(STRATA)
    assert min(count.values()) >= 12
    assert count["F"] >= 20  # fewer could not show a rate of 5 %
    assert len({c.name for c in CASES}) == len({c.seed for c in CASES}) == len(CASES)
    assert {c.model for c in CASES} == set(MODELS)
    changes = sum(a.stratum != b.stratum for a, b in pairwise(CASES))
    assert changes > len(CASES) / 2  # the order of the names is not that of the strata


def test_sizes_span_what_is_asked_for() -> None:
    sizes = [c.size for c in CASES if c.hidden or c.wrong]
    assert min(sizes) >= 0.01
    assert max(sizes) <= 0.20
    assert min(sizes) <= 0.011
    assert max(sizes) >= 0.199


def test_hidden_ids_are_the_vocabulary() -> None:
    known = {module.NAME for module in EFFECTS}
    assert {effect for effect, _ in FORMS.values()} <= known
    hidden = {e for c in of("A") for e in effects_of(c)}
    assert len(hidden) >= 20
    assert all(effects_of(c) == [] and c.hidden for c in of("E"))
    assert all(len(effects_of(c)) == 2 and len(set(effects_of(c))) == 2 for c in of("D"))
    assert all(len(effects_of(c)) == 1 for c in (*of("A"), *of("G")))
    assert all(not c.hidden and not c.wrong for c in of("F"))
    assert all(c.wrong and not c.hidden for c in of("B"))


def test_selection_is_fixed_and_even() -> None:
    some = selected(21)
    assert [c.name for c in some] == [c.name for c in selected(21)]
    assert set(Counter(c.stratum for c in some).values()) == {3}
    assert {c.stratum for c in selected(None, "AF")} == {"A", "F"}
    assert selected(10_000) == CASES
    assert len(gate()) == len(GATE)
    assert {c.stratum for c in gate()} == set(STRATA)


# -- what is hidden


@pytest.mark.parametrize("kind", KINDS)
def test_motion_starts_at_rest_and_is_smooth(kind: str) -> None:
    m = motion(kind, 12.0, 0.001, 1.0, np.random.default_rng(3))
    assert abs(m.x[0]) < 1e-9
    assert abs(m.v[0]) < 1e-3
    assert 0.3 < np.max(np.abs(m.x)) < 2.1
    assert np.max(np.abs(np.diff(m.v))) < 0.05  # no jump of the speed


def test_stop_elements_have_the_exponential_reversal_curve() -> None:
    travel = np.concatenate([np.linspace(0.0, 9.0, 4000), np.linspace(9.0, -1.0, 9000)])
    z = maxwell_slip(0.013 * travel, 0.013)
    first, back = z[:4000], z[4000:]
    np.testing.assert_allclose(first, -np.expm1(-travel[:4000]), atol=0.004)
    np.testing.assert_allclose(back, -1.0 + 2.0 * np.exp(-(9.0 - travel[4000:])), atol=0.008)


def test_inner_loops_of_the_stop_elements_close() -> None:
    inner = np.concatenate([np.linspace(0.0, 5.0, 901), np.linspace(5.0, 3.9, 301), np.linspace(3.9, 5.0, 301)])
    z = maxwell_slip(inner, 1.7)
    assert z[1201] < z[900] - 0.3
    assert z[-1] == pytest.approx(z[900], abs=1e-12)  # the Coleman-Hodgdon and Dahl loops do not


@pytest.mark.parametrize("model", MODELS)
def test_amount_zero_changes_nothing(model: str) -> None:
    rig = draw_rig(model, np.random.default_rng(5), dip=model == "LuGreFriction")
    m = motion("strokes", 4.0, 0.001, 1.0, np.random.default_rng(6))
    used = {name for c in CASES if c.model == model for name in c.hidden}
    assert len(used) >= 8
    for name in sorted(used):
        s = signals(rig, m, 7)
        before = {c: y.copy() for c, y in channels(s).items()}
        (FORMS[name][1] if name in FORMS else OUTSIDE[name])(s, 0.0)
        for c, y in channels(s).items():
            np.testing.assert_allclose(y, before[c], atol=1e-3 * rms(before[c]), err_msg=f"{name} {c}")
        assert not any(s.levels.values())


SIZED = [c for k, c in enumerate(of("A") + of("C") + of("E")) if c.hidden and k % 4 == 0]


@pytest.mark.parametrize("case", SIZED, ids=lambda c: f"{c.model}-{c.hidden[0]}")
def test_size_is_as_stated(case: Case) -> None:
    perfect = replace(case, instruments=PERFECT, reference=False, holdout=())
    with_it, without = logs(perfect), logs(replace(perfect, hidden=()))
    shares = []
    for column in ("x_out", "tau_in", "F"):
        if column in next(iter(without.values())):
            before = pooled(without, column)
            shares.append(rms(pooled(with_it, column) - before) / rms(before))
    assert max(shares) == pytest.approx(case.size, rel=0.06)


@pytest.mark.parametrize("case", of("B"), ids=lambda c: f"{c.model}-{'-'.join(c.wrong)}")
def test_wrong_parameters_are_as_wrong_as_stated(case: Case) -> None:
    made = make(replace(case, instruments=PERFECT, holdout=()))
    true = made.rig.parameters()
    off = {n for n, v in made.values.items() if abs(v - true[n]) > 1e-3 * abs(true[n])}
    assert off == set(case.wrong)
    model, shares = kernel(case.model), {}
    wrong, right = model.params(None, made.values), model.params(None, true)
    squares: dict[str, list[float]] = {}
    for name in (n for n in made.runs if n.startswith("measured")):
        log = made.runs[name]
        scale = {"deg": np.pi / 180.0, "mm/s": 1e-3, "mm/s2": 1e-3}
        inputs = [
            next(log[c].to_numpy() * scale.get(c.split("[")[1][:-1], 1.0) for c in log if c.split(" ")[0] == v.name)
            for v in model.inputs
        ]
        time, u = log["time [s]"].to_numpy(), np.column_stack(inputs)
        a, b = (model.simulate(p, time, u) for p in (wrong, right))
        for j, v in enumerate(model.outputs):
            if any(c.split(" ")[0] == v.name for c in log):
                squares.setdefault(v.name, []).append(float(np.mean((a[:, j] - b[:, j]) ** 2)))
                squares.setdefault("of " + v.name, []).append(float(np.mean(b[:, j] ** 2)))
    shares = [np.sqrt(np.sum(squares[n]) / np.sum(squares["of " + n])) for n in squares if not n.startswith("of ")]
    assert max(shares) == pytest.approx(case.size, rel=0.2)


NEUTRAL = [c for k, c in enumerate(of("F") + of("D") + of("A")) if k % 5 == 0 or c.dip]


@pytest.mark.parametrize("case", NEUTRAL, ids=lambda c: c.name)
def test_rig_without_effect_is_the_baseline_within_the_noise(case: Case, tmp_path: Path) -> None:
    write([replace(case, hidden=(), instruments=replace(PERFECT, encoder=2e-6), reference=False)], tmp_path)
    folder = tmp_path / "logs" / case.name
    known = json.loads((folder / "case.json").read_text())
    model = kernel(known["model"])
    p = model.params(None, known["set"])
    for name in known["measured"] + known["holdout"]:
        record = read_record(folder / name)
        simulated = model.simulate(p, record.time, record.inputs_for(model))
        for c in set(record.columns) & {v.name for v in model.outputs}:
            column = [v.name for v in model.outputs].index(c)
            noise = case.instruments.noise * (0.2 if c == "x_out" else 1.0) * rms(record.columns[c])
            assert rms(record.columns[c] - simulated[:, column]) < noise, (name, c)


@pytest.mark.parametrize("case", of("G"), ids=lambda c: f"{c.model}-{c.hidden[0]}")
def test_not_excited_stays_below_the_noise(case: Case) -> None:
    made = make(case)
    assert abs(made.amounts[0]) > 1e-4  # on a motion that excites it, it has its size
    for channel, left in unmodelled(made).items():
        assert left < 0.5 * made.noise[channel], channel


# -- instruments


def test_noise_has_its_level_and_colour() -> None:
    for colour in (0.0, 0.6, 0.97):
        n = coloured(200_000, colour, np.random.default_rng(8))
        assert rms(n) == pytest.approx(1.0, rel=0.05)
        assert np.corrcoef(n[1:], n[:-1])[0, 1] == pytest.approx(colour, abs=0.02)


def test_jitter_is_in_the_stamps_or_hidden() -> None:
    jittered = [c for c in of("C") if c.instruments.jitter > 0.0]
    assert {c.instruments.stamped for c in jittered} == {True, False}
    for case in jittered[:4]:
        steps = np.diff(next(iter(logs(case).values()))["time"])
        assert (steps > 0.0).all()
        spread = np.std(steps) / np.mean(steps)
        expected = np.sqrt(2.0) * case.instruments.jitter if case.instruments.stamped else 0.0
        assert spread == pytest.approx(expected, rel=0.1, abs=1e-6)


# -- files


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[Case], Path]:
    out = tmp_path_factory.mktemp("blind")
    cases = selected(14)
    write(cases, out)
    return cases, out


def test_same_seed_same_bytes(written: tuple[list[Case], Path], tmp_path: Path) -> None:
    cases, out = written
    write(cases[::-1], tmp_path)
    files = sorted(p.relative_to(out) for p in (out / "logs").rglob("*") if p.is_file())
    assert len(files) > 4 * len(cases) - 1
    assert files == sorted(p.relative_to(tmp_path) for p in (tmp_path / "logs").rglob("*") if p.is_file())
    for file in files:
        assert (out / file).read_bytes() == (tmp_path / file).read_bytes(), file
    assert json.loads((out / "answers.json").read_text()) == json.loads((tmp_path / "answers.json").read_text())


def test_another_seed_another_log(written: tuple[list[Case], Path]) -> None:
    case = written[0][0]
    a, b = (make(replace(case, seed=seed)).runs["measured_1.csv"] for seed in (case.seed, case.seed + 1))
    assert not np.allclose(a.iloc[:, -1], b.iloc[:, -1])


def test_no_truth_beside_the_logs(written: tuple[list[Case], Path]) -> None:
    cases, out = written
    secret = {*FORMS, *OUTSIDE, *(e for e, _ in FORMS.values()), "stratum", "hidden", "seed", "size", "amount", "noise"}
    assert sorted(p.name for p in out.iterdir()) == ["answers.json", "logs"]
    for case in cases:
        folder = out / "logs" / case.name
        known = json.loads((folder / "case.json").read_text())
        assert set(known) == {"model", "set", "measured", "holdout", "reference", "options"}
        assert {p.name for p in folder.iterdir()} == {"case.json"} | {
            n for role in ("measured", "holdout", "reference") for n in known[role]
        }
        assert known["measured"]
        assert known["holdout"]
        for file in folder.iterdir():
            head = file.read_text()[:4000] if file.suffix == ".csv" else file.read_text()
            assert not [word for word in secret if word in head], file


def test_logs_have_what_the_models_read(written: tuple[list[Case], Path]) -> None:
    cases, out = written
    assert {c.model for c in cases} == set(MODELS)
    for case in cases:
        known = json.loads((out / "logs" / case.name / "case.json").read_text())
        model = kernel(known["model"])
        model.params(None, known["set"])  # raises if out of bounds
        for name in known["measured"] + known["holdout"] + known["reference"]:
            record = read_record(out / "logs" / case.name / name)
            assert record.inputs_for(model).shape == (record.time.size, len(model.inputs))
            assert set(record.columns) & {v.name for v in model.outputs}


def test_every_case_can_be_made_and_answered() -> None:
    for case in CASES:
        made = make(replace(case, reference=False, holdout=()))
        truth = answer(made)
        assert truth["effects"] == effects_of(case)
        for log in made.runs.values():
            assert np.isfinite(log.to_numpy()).all(), case.name
