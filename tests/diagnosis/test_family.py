"""Of what a residual is a law: residuals that were built here, from functions that are not those on offer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tsm_fmu.diagnosis import workflow
from tsm_fmu.diagnosis.answer.family import contradicted, families_of, family_evidence, not_little
from tsm_fmu.diagnosis.answer.sentence import answer
from tsm_fmu.diagnosis.criteria import REFERENCE_RATIO
from tsm_fmu.diagnosis.evidence import FamilyShare, Gap
from tsm_fmu.diagnosis.fits.refit import Task, as_given
from tsm_fmu.diagnosis.residual.families import Functions, family_shares
from tsm_fmu.diagnosis.result import Diagnosis
from tsm_fmu.diagnosis.runs.motion_signals import Coordinates, coordinates_of
from tsm_fmu.effects import EFFECTS, FAMILIES, about, words
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.problem import FitRun

DT = 0.0097


def runs(seed: int = 3, count: int = 4, n: int = 2400) -> list[Coordinates]:
    """Four sines of no common period, with a load that moves otherwise."""
    rng, found = np.random.default_rng(seed), []
    for _ in range(count):
        t = np.arange(n) * DT
        parts = zip((0.9, 0.5, 0.3, 0.11), (0.131, 0.337, 0.871, 2.3), rng.random(4) * 6.0, strict=True)
        x = 0.047 * np.sum([a * np.sin(2.0 * np.pi * f * t + p) for a, f, p in parts], axis=0)
        v = np.gradient(x, t)
        load = 2.1 + 1.3 * np.sin(2.0 * np.pi * 0.23 * t + 6.0 * rng.random())
        found.append(coordinates_of(kernel("LuGreFriction"), FitRun("r", t, v[:, None], v[:, None]), load))
    return found


LAWS: dict[str, Callable[[Coordinates], np.ndarray]] = {
    "position": lambda c: np.sin(5.3 * (c.x - 0.01) / 0.047) + 0.4 * np.tanh(c.x / 0.01),
    "speed": lambda c: np.sign(c.v) * np.abs(c.v / 0.1) ** 0.37,
    "acceleration": lambda c: c.s * np.sqrt(np.abs(c.a) / 0.3) * (c.a * c.v > 0.0),
    "load": lambda c: c.z * np.maximum(0.0, (c.load if c.load is not None else 0.0) - 1.7) ** 1.3,
    "time": lambda c: c.z / (1.0 + (c.time - c.time[0]) / 4.0),
    "history": lambda c: c.s / (1.0 + (c.since_reversal / 0.004) ** 2),
    "direction": lambda c: (c.v > 0.0) * np.abs(c.v / 0.1) ** 0.8,
}


@pytest.mark.parametrize("family", LAWS)
def test_the_family_of_a_law_predicts_most_of_it(family: str) -> None:
    rng, where = np.random.default_rng(11), runs()
    law = [LAWS[family](c) for c in where]
    size = 0.1 * float(np.std(np.concatenate(law)))
    noisy = [y + size * rng.normal(size=y.size) for y in law]
    outputs = [0.7 * c.z + 1.3 * c.v for c in where]
    shares = family_shares(noisy, outputs, Functions(where), np.empty((sum(y.size for y in law), 0)))
    assert max(shares, key=lambda f: shares[f]) == family
    assert shares[family] > 0.6


def test_a_late_signal_is_a_law_of_the_sensor() -> None:
    where = runs()
    outputs = [0.3 * np.tanh(c.z) + 8.1 * c.x for c in where]
    late = [y - np.interp(c.time - 0.023, c.time, y) for c, y in zip(where, outputs, strict=True)]
    shares = family_shares(late, outputs, Functions(where), np.empty((sum(y.size for y in late), 0)))
    assert max(shares, key=lambda f: shares[f]) == "sensor"


def stroke_and_hold(seed: int, count: int = 4) -> list[Coordinates]:
    """Strokes of one to three seconds with rests of up to four seconds between them."""
    rng, found = np.random.default_rng(seed), []
    for _ in range(count):
        x, at = [], 0.0
        while len(x) < 2400:
            to, moving, still = (
                0.047 * rng.uniform(-1.0, 1.0),
                int(rng.uniform(1.0, 3.0) / DT),
                int(rng.exponential(0.9) / DT),
            )
            u = np.arange(1, moving + 1) / moving
            x += [*(at + (to - at) * u * u * (3.0 - 2.0 * u)), *[to] * still]
            at = to
        t = np.arange(2400) * DT
        v = np.gradient(np.array(x[:2400]), t)
        found.append(coordinates_of(kernel("LuGreFriction"), FitRun("r", t, v[:, None], v[:, None]), None))
    return found


def gap_after_reversals(c: Coordinates) -> np.ndarray:
    """Friction that is nothing over a part of the way after each reversal."""
    return -c.s * ((c.since_reversal > 0.0041) & (c.since_reversal < 0.0067))


def saturating_age(c: Coordinates) -> np.ndarray:
    """Strength of contacts that saturates with their age, which half a millimetre of travel renews."""
    age, found = 0.0, []
    for dt, v in zip(np.diff(c.time, prepend=c.time[0]), np.abs(c.v), strict=True):
        age = age * np.exp(-v * dt / 0.0005) + dt
        found.append(1.0 - np.exp(-age / 0.7))
    return c.z * np.array(found)


@pytest.mark.parametrize("law", [gap_after_reversals, saturating_age])
def test_what_happens_at_one_place_after_a_reversal_or_ages_is_a_law_of_the_history(
    law: Callable[[Coordinates], np.ndarray],
) -> None:
    rng, where = np.random.default_rng(23), stroke_and_hold(31)
    left = [law(c) for c in where]
    size = 0.3 * float(np.std(np.concatenate(left)))
    noisy = [y + size * rng.normal(size=y.size) for y in left]
    shares = family_shares(
        noisy, [0.7 * c.z for c in where], Functions(where), np.concatenate([c.z for c in where])[:, None]
    )
    history = shares.pop("history")
    assert history > 0.5
    assert history > 1.2 * max(shares.values()), shares


def test_noise_is_no_law_and_what_the_parameters_do_is_none() -> None:
    """White noise, and a residual that moves of the model's parameters make: nothing is predicted of either."""
    rng, where = np.random.default_rng(5), runs()
    outputs = [c.z for c in where]
    rows = sum(c.x.size for c in where)
    noise = [rng.normal(size=c.x.size) for c in where]
    assert max(family_shares(noise, outputs, Functions(where), np.empty((rows, 0))).values()) < 0.05
    done = [np.tanh(c.v / 0.05) for c in where]
    left = [0.3 * y + 0.01 * rng.normal(size=y.size) for y in done]
    assert max(family_shares(left, outputs, Functions(where), np.concatenate(done)[:, None]).values()) < 0.05


def test_without_a_load_nothing_is_said_of_it() -> None:
    where = [replace(c, load=None) for c in runs(count=2)]
    shares = family_shares([c.x for c in where], [c.x for c in where], Functions(where), np.empty((4800, 0)))
    assert set(FAMILIES) - set(shares) == {"load"}


def test_names_bring_their_family_and_what_has_none_its_best_evidence() -> None:
    seen = (FamilyShare("time", "F", 0.81), FamilyShare("load", "F", 0.3), FamilyShare("speed", "x_out", 0.95))
    for module in EFFECTS:
        assert families_of((f"{module.NAME}@F",), (), (), "F") == (about(module.NAME).family,)
    assert families_of((), ("wear", "load_dependence", "thermal"), (), "F") == ("time", "load")
    assert families_of((), (), seen, "F") == ("time",)
    assert families_of((), (), (FamilyShare("time", "F", 0.03),), "F") == ()
    near = (FamilyShare("load", "F", 0.61), FamilyShare("position", "F", 0.6), FamilyShare("time", "F", 0.5))
    assert families_of((), (), near, "F") == ("load", "position")
    # a set whose laws leave more than twice what those of another family leave
    own = FamilyShare("time", "F", 0.63)
    assert families_of((), ("wear", "thermal"), (FamilyShare("load", "F", 0.92), own), "F") == ("time", "load")
    assert families_of((), ("wear", "thermal"), (FamilyShare("load", "F", 0.78), own), "F") == ("time",)
    assert families_of((), ("wear", "thermal"), (FamilyShare("load", "x_out", 0.92), own), "F") == ("time",)
    assert families_of(("wear",), (), (FamilyShare("load", "F", 0.92), own), "F") == ("time",)
    # what comes closest, beside what the residual says
    assert families_of((), (), seen, "F", ("inertia", "wear@x_out")) == ("time", "acceleration")
    assert families_of((), (), (), "F", ("bend_angle",)) == ("load",)


@pytest.mark.parametrize(
    ("answer_is", "seen", "none"),
    [
        (("thermal", "stiffness_hardening"), {"sensor": 0.88, "time": 0.23, "position": 0.2}, True),
        (("acceleration_branches",), {"direction": 0.71, "acceleration": 0.02}, True),
        (("acceleration_branches",), {"direction": 0.59, "acceleration": 0.02}, False),  # nothing predicts much
        (("inertia",), {"history": 0.88, "acceleration": 0.56}, False),  # many laws can bend to a few
        (("wear",), {"sensor": 0.96, "time": 0.82}, True),  # few laws of a sensor leave a quarter
        (("wear",), {"sensor": 0.9, "time": 0.82}, False),
        (("winding_crossover",), {"position": 0.01, "load": 0.42}, False),
        (("delay",), {"sensor": 0.97, "history": 0.99}, False),
        ((), {"sensor": 0.97}, False),
    ],
)
def test_laws_of_another_kind_that_predict_far_more_contradict_a_name(
    answer_is: tuple[str, ...], seen: dict[Any, float], none: bool
) -> None:
    """In the channel of which its effects remove most, whatever is said of others."""
    task = SimpleNamespace(discrepancy=np.zeros(1))
    fitted = SimpleNamespace(problem=SimpleNamespace(channels=("x_out", "F", "tau_in")), task=task)
    acts = np.array([True, True, False]) & bool(answer_is)
    one: Any = SimpleNamespace(
        effects=answer_is, measured=np.array([0.9, 0.16, 0.01]), held_out=None, fitted=fitted, acts=acts
    )
    choice: Any = SimpleNamespace(winner=one, supported=(one,))
    evidence = [FamilyShare(family, "F", share) for family, share in seen.items()]
    evidence += [FamilyShare("sensor", "x_out", 0.99), FamilyShare("sensor", "tau_in", 0.98)]
    before: Any = SimpleNamespace(measured=np.array([1.0, 1.0, 1.0]))
    assert contradicted(choice, before, evidence) is none
    there = {
        "yes": [FamilyShare(about(s).family, "F", 0.61) for s in answer_is],
        "no": [FamilyShare("load", "F", 0.61)],
    }
    assert not contradicted(choice, before, evidence, lambda: there["yes"])  # other motions show it
    assert contradicted(choice, before, evidence, lambda: there["no"]) is none
    reference = np.sqrt([0.2, 0.16, 0.2]) / REFERENCE_RATIO
    for factor, as_good in ((1.01, True), (0.99, False)):  # as little as the model on reference runs
        task.discrepancy = factor * reference
        assert contradicted(choice, before, evidence) is (none and not as_good)
        one.held_out = np.array([0.9, 0.17, 0.01])  # of others it leaves more
        assert contradicted(choice, before, evidence) is none
        one.held_out = None
    task.discrepancy, leaves = np.zeros(1), 1.0 - max(seen.values())
    for part in (0.51, 0.49):  # half of what those laws leave: more is explained by the answer than by them
        one.measured[1] = part * leaves
        enough = part < 0.5 or one.measured[1] < 0.03
        assert contradicted(choice, before, evidence) is (none and not enough)
    one.measured[1] = 0.029  # as little as a right name may leave of what it removes: 3 %
    assert not contradicted(choice, before, evidence)


def test_what_is_next_to_nothing_has_no_family_where_nothing_is_missing() -> None:
    fitted: Any = SimpleNamespace(
        problem=SimpleNamespace(channels=("x_out", "F")), rmse=np.array([0.031, 0.2]), spread=np.array([3.1, 130.0])
    )  # 1 % and 0.15 %
    seen = [FamilyShare("time", "F", 0.99), FamilyShare("load", "x_out", 0.11), FamilyShare("speed", "x_out", 0.08)]
    assert [e.family for e in not_little(seen, fitted)] == ["load"]


def test_the_answer_says_the_family() -> None:
    gap = {"F": Gap("N", 0.31, 0.3, None, None, 0.04, 0.04, None, None, None, 0.29, None)}
    seen = (FamilyShare("load", "F", 0.823), FamilyShare("time", "F", 0.2))
    said = answer(Diagnosis("unknown", gap=gap, channels=("F",), family=("load",), family_evidence=seen))
    assert "What is missing is a law of the load (such laws predict 82 % of it)." in said
    named = Diagnosis("named", effects=("wear",), gap=gap, channels=("F",), family=("time",))
    assert answer(named).endswith("Family: a law of time or travel.")
    beside = replace(named, equivalent=(("stribeck", "load_dependence"),), family=("time", "speed", "load"))
    told = answer(beside)
    assert f"and one of {words('stribeck')}, {words('load_dependence')} (these runs cannot tell which)" in told
    assert told.endswith("Family: a law of time or travel.")  # of the name, not of all that may be beside it
    sets = Diagnosis("ambiguous", equivalent=(("wear", "stribeck"),), gap=gap, family=("time", "speed"))
    assert answer(sets).endswith("Family: a law of time or travel or a law of the speed.")


@pytest.mark.parametrize("verdict", ["none", "parameters"])
def test_an_answer_without_a_name_says_what_is_left(verdict: str) -> None:
    gap = {"F": Gap("N", 0.31, 0.3, None, None, 0.04, 0.04, None, None, None, 0.29, None)}
    seen = (FamilyShare("history", "F", 0.417), FamilyShare("time", "F", 0.2))
    told = answer(Diagnosis(verdict, gap=gap, channels=("F",), family=("history",), family_evidence=seen))
    assert "No effect named" in told
    law = f"{FAMILIES['history']} (such laws predict 42 % of it)"
    assert told.endswith(f"What the model's own parameters leave, too little for a name, is {law}.")
    assert "too little" not in answer(Diagnosis(verdict, gap=gap, channels=("F",), family_evidence=seen))


def test_the_answer_says_how_a_family_is_known() -> None:
    gap = {"F": Gap("N", 0.31, 0.3, None, None, 0.04, 0.04, None, None, None, 0.29, None)}
    steps = (FamilyShare("sensor", "F", 0.872, "steps"),)
    told = answer(Diagnosis("none", gap=gap, channels=("F",), family=("sensor",), family_evidence=steps))
    assert told.endswith(f"is {FAMILIES['sensor']} (the steps of its converter make 87 % of it).")
    slow = (FamilyShare("time", "F", 0.913, "slow"),)
    told = answer(Diagnosis("unknown", gap=gap, channels=("F",), family=("time",), family_evidence=slow))
    assert f"{FAMILIES['time']} (what moves slowly and with nothing in the log makes 91 % of it)." in told


@pytest.mark.parametrize(("q", "most"), [(0.2311, "steps"), (1e-4, "predicted")])
def test_steps_of_a_converter_are_of_the_sensor(
    q: float, most: str, rig: Callable[..., FitRun], known: dict[str, float]
) -> None:
    """The model is the rig's, but for the steps; they make q^2/12 of what is left, or next to nothing of the noise."""
    runs = [rig(seed, rows=1500) for seed in (5, 6)]
    runs = [replace(run, targets=q * np.round(run.targets / q)) for run in runs]
    fitted = as_given(Task("LuGreFriction", runs, ("F",), known, None, tuple(known)), ())
    (of_sensor,) = (e for e in family_evidence(fitted, runs) if e.family == "sensor")
    assert of_sensor.how == most
    if most == "steps":
        assert of_sensor.share == pytest.approx(q**2 / 12.0 / float(fitted.rmse[0]) ** 2, rel=0.01)


@pytest.mark.parametrize(
    ("word", "near", "slow", "expected"),
    [
        ("unknown", (), 0.9, ("time",)),
        ("unknown", (), 0.0, ()),
        ("unknown", ("wear@F", "inertia"), 0.9, ("time", "acceleration")),
        ("unknown", ("inertia",), 0.9, ("acceleration",)),  # something is said already
        ("parameters", (), 0.9, ()),
        ("not_excited", (), 0.9, ()),
    ],
)
def test_a_gap_that_moves_slowly_and_with_nothing_is_of_the_time(
    word: str, near: tuple[str, ...], slow: float, expected: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    parts = (FamilyShare("time", "F", slow, "slow"),) if slow else ()
    monkeypatch.setattr(workflow, "closest_effects", lambda *_, **__: near)
    monkeypatch.setattr(workflow, "slow_parts", lambda *_: parts)
    fitted = SimpleNamespace(problem=SimpleNamespace(channels=("F",)), rmse=np.array([0.1]), spread=np.array([3.1]))
    little = (FamilyShare("time", "F", 0.03), FamilyShare("load", "F", 0.02))
    refitted = SimpleNamespace(fitted=fitted)
    found: Any = SimpleNamespace(
        verdict=SimpleNamespace(word=word, effects=()), limits={}, tones={}, evidence=little, runs=None,
        selection=SimpleNamespace(baselines=SimpleNamespace(refitted=refitted), of_gap=refitted),
    )  # fmt: skip
    evidence, families = workflow._families(found, Diagnosis(word), "F")
    assert families == expected
    assert evidence == ((*parts, little[1]) if word == "unknown" and not near and slow else little)


def test_a_model_with_nothing_to_fit_has_a_family_too(rig: Callable[..., FitRun], known: dict[str, float]) -> None:
    """All parameters fixed: no parameter imitates anything, and the law is still one of the acceleration."""
    run = rig(3, inertia=0.4, rows=1500)
    task = Task("LuGreFriction", [run], ("F",), known, None, tuple(known))
    evidence = family_evidence(as_given(task, ()), [run])
    assert evidence[0].family == "acceleration"
