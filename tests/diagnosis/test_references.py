"""Values that serve measured and reference runs: what a refit hides of one kind of runs, those of the other show."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tsm_fmu.diagnosis.choice.served import served_choice
from tsm_fmu.diagnosis.fits.references import jointly, left_of_references, serve, serve_both, serve_both_but_for_one
from tsm_fmu.diagnosis.fits.refit import Fitted, Task, refit
from tsm_fmu.diagnosis.result import Diagnosis
from tsm_fmu.diagnosis.workflow import diagnose
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import Record
from tsm_fmu.regression.problem import FitRun

from .conftest import DT, LEVEL, VISCOUS, exponential
from .test_choice import made, names

KNOWN = {"sigma0": 100.0, "sigma1": 0.0, "sigma2": 0.1, "F_c": 0.7, "F_s": 0.7, "v_s": 0.3}
NOISE = 0.004


def record(name: str, seed: int, *, sines: bool, late: float = 0.0, viscous: float = VISCOUS) -> Record:
    """Dahl friction in closed form and a drag, over one sine or over three, with a force that comes late."""
    rng, t = np.random.default_rng(seed), np.arange(3000) * DT
    one = ((1.0, 0.31 * (1.0 + 0.3 * (seed % 3))),)
    v = np.zeros(t.size)
    for amplitude, f in ((1.1, 0.13), (0.6, 0.37), (0.4, 1.31)) if sines else one:
        v += amplitude * np.sin(2.0 * np.pi * f * t + (rng.random() * 6.0 if sines else 0.0))
    force = LEVEL * exponential(np.cumsum(v) * DT) + viscous * v
    force = np.interp(t - late, t, force) + NOISE * rng.standard_normal(t.size)
    return Record(name, t, {"v": v, "F": force}, {"v": "m/s", "F": "N"})


@cache
def diagnosed(late: float = 0.0, viscous: float = VISCOUS, referenced: bool = True) -> Diagnosis:
    measured = [record(f"m{k}", k, sines=False, late=late, viscous=viscous) for k in (3, 4)]
    reference = [record(f"r{k}", k, sines=True) for k in (11, 12)] if referenced else []
    return diagnose(kernel("LuGreFriction"), measured, reference=reference, values=KNOWN)


def test_what_other_values_imitate_is_named_where_reference_runs_do_not_bear_them() -> None:
    """A force of single sines that comes 10 ms late is one of another Stribeck speed with a little lag."""
    assert diagnosed(late=0.01, referenced=False).verdict == "parameters"
    found = diagnosed(late=0.01)
    assert found.effects == ("delay@F",)
    assert found.final is not None
    assert found.final.values["F.delay.T_d"] == pytest.approx(0.01, rel=0.03)


def test_a_value_that_has_changed_since_the_reference_runs_is_no_effect_and_is_said() -> None:
    found = diagnosed(viscous=3.0 * VISCOUS)
    assert (found.verdict, found.effects, found.equivalent) == ("parameters", (), ())
    assert [c.name for c in found.unlike_references] == ["sigma2"]
    assert found.unlike_references[0].before == pytest.approx(VISCOUS, rel=0.03)
    assert found.unlike_references[0].after == pytest.approx(3.0 * VISCOUS, rel=0.03)
    assert "They are not those of the reference runs (sigma2 0.11" in found.answer
    assert "the rig has changed since" in found.answer


def test_of_one_rig_that_lacks_nothing_nothing_of_the_kind_is_said() -> None:
    found = diagnosed()
    assert (found.verdict, found.unlike_references) == ("parameters", ())
    assert "reference runs" not in found.answer


def test_without_reference_runs_nothing_is_said_of_them() -> None:
    assert diagnosed(late=0.01, referenced=False).unlike_references == ()


def fits(viscous: float) -> tuple[Fitted, Fitted]:
    """The model refitted to runs of a rig with another drag, and to reference runs of it with the usual one."""

    def fitted(runs: list[Record]) -> Fitted:
        made = [
            FitRun(r.name, r.time, r.columns["v"][:, None], r.columns["F"][:, None]).compared_from(200) for r in runs
        ]  # fmt: skip
        return refit(Task("LuGreFriction", made, ("F",), KNOWN), (), {}, steps=40)

    here = fitted([record("m", 5, sines=True, viscous=viscous)])
    return here, fitted([record("r", 11, sines=True), record("s", 12, sines=True)])


def test_values_of_one_rig_serve_all_of_its_runs() -> None:
    here, reference = fits(VISCOUS)
    assert serve(reference, here)
    assert serve_both(here, reference, ())
    assert left_of_references(reference, here) == pytest.approx([NOISE], rel=0.1)
    assert left_of_references(reference, reference) == pytest.approx(reference.rmse)


def test_of_a_rig_that_has_changed_no_values_serve_both_but_for_the_one_that_has() -> None:
    here, reference = fits(2.0 * VISCOUS)
    joint = jointly(here, reference, ())
    assert not serve(reference, here)
    assert not serve_both(here, reference, ())
    assert VISCOUS * 1.2 < joint.values["sigma2"] < VISCOUS * 1.9
    assert joint.rmse[0] > 3.0 * NOISE
    changed = jointly(here, reference, (), "sigma2")
    assert changed.rmse == pytest.approx(here.rmse, rel=0.05)
    assert changed.values["sigma2"] == pytest.approx(2.0 * VISCOUS, rel=0.02)
    assert changed.values["F_c"] == pytest.approx(LEVEL, rel=0.01)
    assert serve_both_but_for_one(here, reference, (), 1.3 * here.rmse)
    assert not serve_both_but_for_one(here, reference, (), 0.7 * here.rmse)


Served = Callable[[str], bool]


def served(
    hypotheses: dict[str, float], serving: set[str], changed: float = np.inf, parameters: int = 5
) -> list[tuple[str, ...]]:  # fmt: skip
    """Effects supported of hypotheses by what they leave, some with values that serve reference runs.

    A value that has changed leaves ``changed``; branches have three parameters more.
    """
    found = []
    for added, rmse in hypotheses.items():
        one = made(added, rmse, rmse, parameters=parameters + len(added.split()) + 3 * ("branches" in added))
        one.__dict__["serves_references"] = added in serving
        one.__dict__["may_have_changed"] = lambda most: bool((made("", changed).measured <= most).all())
        found.append(one)
    return names(served_choice(found, replace(found[0], measured=np.array([1.0]), held_out=np.array([1.0]))))


@pytest.mark.parametrize(
    ("hypotheses", "serving", "changed", "expected"),
    [
        # none: next to nothing is left without an effect
        ({"": 0.004, "inertia": 0.0035}, {"", "inertia"}, np.inf, [()]),
        ({"": 0.004, "inertia": 0.0035}, {"inertia"}, np.inf, [("inertia",)]),
        ({"": 0.004, "inertia": 0.0035}, set(), np.inf, [()]),
        ({"": 0.004, "inertia": 0.0035, "wear": 0.0036}, {"inertia", "wear"}, np.inf, [("inertia",), ("wear",)]),
        # one value that has changed leaves about as little, or more
        ({"": 0.004, "inertia": 0.0035}, {"inertia"}, 0.0045, [()]),
        ({"": 0.004, "inertia": 0.0035}, {"inertia"}, 0.0047, [("inertia",)]),
        # of effects that leave as little
        ({"": 0.2, "inertia": 0.02, "wear": 0.0201}, {"wear"}, np.inf, [("wear",)]),
        (
            {"": 0.2, "delay@F": 0.02, "acceleration_branches": 0.0199},
            {"acceleration_branches"},
            np.inf,
            [("acceleration_branches",), ("delay@F",)],
        ),
        ({"": 0.2, "inertia": 0.02, "wear": 0.0201}, {"wear", "inertia"}, np.inf, [("inertia",), ("wear",)]),
        ({"": 0.2, "inertia": 0.02, "wear": 0.0201}, set(), np.inf, [("inertia",), ("wear",)]),
        # a right name whose law is not quite that of the rig
        ({"": 0.2, "inertia": 0.02, "wear": 0.07}, {"wear"}, np.inf, [("inertia",)]),
        ({"": 0.2, "inertia": 0.02, "wear delay@F": 0.02}, {"wear delay@F"}, np.inf, [("inertia",)]),
    ],
)
def test_of_what_leaves_about_as_little_that_is_supported_with_which_values_serve_reference_runs(
    hypotheses: dict[str, float], serving: set[str], changed: float, expected: list[tuple[str, ...]]
) -> None:
    assert sorted(served(hypotheses, serving, changed)) == sorted(expected)
