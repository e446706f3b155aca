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
        assert given[v.name].max() <= v.quantity.hi, v.name
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


def test_the_motion_is_a_plan_of_strokes_that_close_their_loops():
    """A rest first; a wide stroke each way, a loop within a stroke, a small one at its end, rests; a full stroke."""
    durations, goals = np.array(KNOTS).T
    assert motion(0.0) == motion(STEP) == (0.0, 0.0, 0.0)
    assert ((durations > 2 * STEP) & (durations < 0.7)).all()  # no move is shorter than two rows, none drags on
    assert durations.sum() == pytest.approx(4.25, abs=0.02)  # 272 rows
    assert (np.abs(goals) <= 1.0).all()
    assert (goals.max(), goals.min()) == pytest.approx((1.0, -0.9), abs=0.05)
    moves = np.diff(goals, prepend=0.0)
    rests = moves == 0.0
    assert list(np.flatnonzero(rests)) == [0, 6, 10, 13]
    assert sorted({abs(g) > 0.0 for g in goals[rests]}) == [False, True]  # at the origin and under load
    turned = np.sign(moves[~rests])
    assert (turned[1:] == -turned[:-1]).all()
    closed = [k for k in range(len(goals) - 2) if goals[k] == goals[k + 2] and not rests[k + 1]]
    assert closed == [3, 7]  # each nested loop goes back to where it began
    depths = [abs(goals[k + 1] - goals[k]) for k in closed]
    assert depths == pytest.approx([0.66, 0.21], abs=0.02)
    strokes = np.abs(moves[~rests])
    assert np.sort(strokes)[-3:].min() > 1.3
    assert (strokes < 2.0).all()
    assert (strokes / durations[~rests] < 4.5).all()  # as fast as a rig moves, not faster
    for k, (time, place) in enumerate(zip(np.cumsum(durations), goals, strict=True)):
        x, v, _ = motion(float(time))
        assert x == pytest.approx(place, abs=1e-12), k
        assert v == pytest.approx(0.0, abs=1e-12)
    assert motion(99.0) == (goals[-1], 0.0, 0.0)
    middle = motion(float(durations[0] + 0.5 * durations[1]))
    assert middle == pytest.approx((0.5 * goals[1], 0.5 * np.pi * goals[1] / durations[1], 0.0), abs=1e-9)


SIZES = {
    "m": (0.0173, 0.0031), "rad": (1.27, 0.31), "N": (3.7, 6.3), "N.m": (0.083, 0.037), "V": (11.3, 0.7),
    "1": (1.9, 0.13),
}  # fmt: skip
"""Amplitude about the middle by unit: millimetres, a radian, cords that stay taut, the supply of a small motor."""
RANGES = {
    ("LebusWinding", "theta"): (1.6, 61.0), ("LebusTransmission", "theta_in"): (-21.3, 24.1),
    ("LebusTransmission", "tau_load"): (-0.036, 0.078), ("LebusCompensator", "theta_r"): (-21.3, 24.1),
    ("LebusCompensator", "T_measured"): (2.2, 7.7), ("HangingLoad", "s"): (-1.0, 1.0),
}  # fmt: skip
"""Least and largest value of the signals that a model has of its own."""


@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.NAME)
def test_every_signal_has_the_size_of_its_unit_and_a_pace_of_its_own(model):
    k = kernel(model.NAME)
    u = np.array(stimuli(k)).reshape(ROWS, len(k.inputs))
    assert (u[0] == u[1]).all()
    small = np.array(stimuli(k, size=0.37)).reshape(u.shape)
    assert small == pytest.approx(0.37 * u, rel=1e-12, abs=1e-15)
    fine = np.array(stimuli(k, step=STEP / 4)).reshape(1 + int(sum(d for d, _ in KNOTS) * 4 / STEP), len(k.inputs))
    assert fine[::4] == pytest.approx(u, rel=1e-12, abs=1e-12)
    for j, v in enumerate(k.inputs):
        unit = v.quantity.unit
        x = np.array([motion(0.83**j * t)[0] for t in TIME])
        if v.name in ("v", "a"):
            amplitude = SIZES[unit.partition("/")[0]][0]
            expected = [amplitude * motion(t)["va".index(v.name) + 1] for t in TIME]
            assert u[:, j] == pytest.approx(np.array(expected), rel=1e-12)
            continue
        own = RANGES.get((k.name, v.name))
        if own:
            assert u[:, j].min() - own[0] < 0.1 * (own[1] - own[0])
            assert own[0] <= u[:, j].min()
            assert u[:, j].max() <= own[1]
            assert np.ptp(u[:, j]) > 0.8 * (own[1] - own[0])
            middle, amplitude = np.polynomial.polynomial.polyfit(x, u[:, j], 1)
        else:
            amplitude, middle = SIZES[unit]
        assert u[:, j] == pytest.approx(middle + amplitude * x, rel=1e-9, abs=1e-12)


def test_files_hold_nine_digits_of_stimuli_thirteen_of_results_and_the_end_of_each_experiment(tmp_path):
    k = kernel("TendonDrive")
    with zipfile.ZipFile(build_fmu(k, tmp_path)) as archive:
        texts = {n.rpartition("/")[2]: archive.read(n).decode() for n in archive.namelist() if n.startswith(FOLDER)}
    for name, digits in (("TendonDrive_in.csv", 9), ("TendonDrive_out.csv", 13)):
        cells = [c for line in texts[name].splitlines()[1:] for c in line.split(",")[1:]]
        longest = max(len(c.partition("e")[0].replace("-", "").replace(".", "").lstrip("0")) for c in cells)
        assert longest == digits
    for name, rows in (("smoke_test.exp", SMOKE_ROWS), ("validation.exp", ROWS)):
        assert f'stopTime="{(rows - 1) * STEP!r}"' in texts[name]
