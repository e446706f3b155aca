"""The reference results that an FMU carries: signals that exercise the model, results of the kernel, files that fit."""

import zipfile
from pathlib import Path

import numpy as np
import pytest
from fmpy import read_csv

from tsm_fmu import InputError
from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.fmu.reference import FOLDER, SMOKE_ROWS
from tsm_fmu.fmu.stimuli import KNOTS, ROWS, STEP, motion, stimuli
from tsm_fmu.kernels.kernel import Kernel, kernel
from tsm_fmu.models import MODELS

TIME = STEP * np.arange(ROWS)
CONSTANT = {("LebusWinding", "F_w"), ("LebusWinding", "tau_w")}  # friction off: no slip length is published
NAMES = [module.NAME for module in MODELS]


def references(fmu: Path, tmp_path: Path) -> tuple[np.ndarray | None, np.ndarray]:
    """Stimuli and results as FMPy reads them."""
    with zipfile.ZipFile(fmu) as archive:
        names = [n for n in archive.namelist() if n.startswith(FOLDER) and n.endswith(".csv")]
        archive.extractall(tmp_path, names)
    found = {name.rpartition("_")[2]: read_csv(tmp_path / name) for name in names}
    return found.get("in.csv"), found["out.csv"]


def turns(x: np.ndarray) -> np.ndarray:
    """Rows at which a signal turns back."""
    way = np.sign(np.diff(x))
    rows = np.flatnonzero(way)
    return rows[1:][np.diff(way[rows]) != 0]


def test_motion_is_the_integral_of_its_derivatives():
    t = np.linspace(0.0, 4.2, 40_001)
    x, v, a = np.array([motion(float(time)) for time in t]).T
    h = t[1]
    assert np.abs(np.diff(x) - h * (v[1:] + v[:-1]) / 2).max() < h**2 * np.abs(a).max()  # a jumps at the knots
    same_move = np.abs(np.diff(a)) < 0.5  # the acceleration jumps where a move ends in a rest
    assert np.abs(np.diff(v) - h * (a[1:] + a[:-1]) / 2)[same_move].max() < 1e-8 * np.ptp(v)
    assert same_move.mean() > 0.999


def test_motion_turns_nests_and_rests():
    x = np.array([motion(float(t))[0] for t in TIME])
    assert turns(x).size >= 7
    extremes = x[turns(x)]
    nested = (np.diff(extremes)[1:-1] ** 2 < np.diff(extremes)[:-2] ** 2) & (
        np.diff(extremes)[1:-1] ** 2 < np.diff(extremes)[2:] ** 2
    )
    assert nested.any()
    rests = np.diff(x) == 0.0
    assert rests[0]
    assert np.count_nonzero(rests) * STEP == pytest.approx(
        sum(d for k, (d, goal) in enumerate(KNOTS) if goal == ((0.0, 0.0), *KNOTS)[k][1]), abs=0.1
    )


@pytest.mark.parametrize("name", NAMES)
def test_inputs_move_and_outputs_answer(name, tmp_path):
    given, expected = references(build_fmu(kernel(name), tmp_path), tmp_path)
    assert len(expected) == ROWS
    for v in kernel(name).inputs:
        assert given is not None
        assert turns(given[v.name]).size >= 2, v.name
        assert given[v.name].min() >= v.quantity.lo, v.name
    for v in kernel(name).outputs:
        assert (np.ptp(expected[v.name]) == 0.0) == ((name, v.name) in CONSTANT), v.name
    assert any(np.ptp(expected[v.name][:SMOKE_ROWS]) > 0.0 for v in kernel(name).outputs)


@pytest.mark.parametrize("name", NAMES)
def test_results_are_the_kernel_on_the_stimuli_one_row_later(name, tmp_path):
    """The plain kernel wrote them; its compiled twin and the shift are independent of that."""
    compiled = not name.startswith("Lebus")  # half a minute of compilation
    k = kernel(name)
    given, expected = references(build_fmu(k, tmp_path), tmp_path)
    u = np.empty((ROWS, 0))
    if given is not None:
        columns = np.array([given[v.name] for v in k.inputs]).T
        u = np.vstack([columns[:1], columns[:-1]])
    results = k.simulate(k.params(), TIME, u, compiled=compiled)
    for j, v in enumerate(k.outputs):
        np.testing.assert_allclose(expected[v.name], results[:, j], rtol=1e-12, atol=1e-300)


def test_start_values_of_a_fitted_model_are_used(tmp_path):
    fitted = build_fmu(kernel("PairedTsmBacklash"), tmp_path, start_values={"c": 0.87, "beta": -0.5, "x_0": 0.013})
    given, expected = references(fitted, tmp_path)
    assert given is not None
    assert expected["x_out"][0] == pytest.approx(0.87 * given["x_in"][0] + 0.013, rel=1e-12)


def test_stimuli_get_smaller_where_a_fitted_model_would_leave_its_domain(tmp_path):
    """A wheel that holds 2 turns takes 12.6 rad, not the 61 of the usual signal."""
    fmu = build_fmu(kernel("LebusWinding"), tmp_path, start_values={"n_t": 1.0, "L_d0": 4.0e-4})
    given, expected = references(fmu, tmp_path)
    assert given is not None
    assert 4.0 < given["theta"].max() < 4.0 * np.pi
    assert set(expected["layer"]) == {1.0, 2.0} or given["theta"].max() < 2.0 * np.pi


def test_a_model_that_never_runs_is_refused(tmp_path):
    from types import ModuleType

    from tsm_fmu.models import sum as template

    source = Path(str(template.__file__)).read_text().partition("def start")[0] + (
        "def start(p, u):\n    return step(p, None, u, 0.0)\n\n\n"
        'def step(p, s, u, dt):\n    raise ValueError("no fuel")\n'
    )
    module = ModuleType("tsm_fmu.models.stalled")
    module.__dict__.update(__package__="tsm_fmu.models", SOURCE_TEXT=source)
    exec(compile(source, "stalled", "exec"), module.__dict__)  # noqa: S102  our own text
    with pytest.raises(
        InputError, match=r"^Sum fails on its reference experiment.*no fuel.* -- change the start values$"
    ):
        build_fmu(Kernel(module), tmp_path)
    assert not list(tmp_path.iterdir())


def test_no_two_inputs_turn_together_but_derivatives_do():
    u = np.array(stimuli(kernel("Sum")))
    places = [set(turns(u[:, j])) for j in range(3)]
    assert not places[0] & places[1] & places[2]
    x, v, _a = np.array(stimuli(kernel("PairedTsmFriction")))[:, :3].T
    assert np.abs(np.gradient(x, STEP) - v)[2:-2].max() < 0.1 * np.abs(v).max()
