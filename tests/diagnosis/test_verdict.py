"""What a verdict makes of supported hypotheses, made up here."""

from __future__ import annotations

from collections.abc import Collection
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tsm_fmu.diagnosis.answer import verdict
from tsm_fmu.diagnosis.criteria import FAMILY_SHARE
from tsm_fmu.diagnosis.evidence import FamilyShare
from tsm_fmu.diagnosis.fits.placing import not_applicable
from tsm_fmu.diagnosis.fits.quantised import Levels
from tsm_fmu.effects import EFFECTS, about
from tsm_fmu.kernels.kernel import kernel

AFTER_REVERSALS = [m.NAME for m in EFFECTS if m.ABOUT.after_reversal and m.ABOUT.looks_like]


@pytest.fixture
def said(monkeypatch: pytest.MonkeyPatch):
    def fit(read: Collection[str] = ()) -> Any:
        one: Any = SimpleNamespace(
            model="LuGreFriction", problem=SimpleNamespace(channels=("F",)), effects=("creep",),
            task=SimpleNamespace(fixed=("sigma1",)),
        )  # fmt: skip
        one.not_kept = lambda fixed: SimpleNamespace(**vars(one), read=read, kept=fixed)
        return one

    final = fit()
    monkeypatch.setattr(verdict, "with_read", lambda fitted, specs, _: fit(specs))
    monkeypatch.setattr(verdict, "_final_fit", lambda *_: final)
    monkeypatch.setattr(verdict, "sign_notes", lambda _: ())
    floors = SimpleNamespace(without_answer=False, open_=np.zeros(1, bool), unexplained=np.zeros(1, bool))

    def of(effects: tuple[str, ...], nowhere: Collection[str], wandering: tuple[str, ...] = ()) -> verdict.Verdict:
        winner = SimpleNamespace(effects=effects, fitted=SimpleNamespace(model="LuGreFriction"))
        choice = SimpleNamespace(winner=winner, supported=[winner])
        tested = [*effects, "viscous_power"]
        return verdict.verdict_of(
            SimpleNamespace(levels=(), refitted=SimpleNamespace(fitted=final)),
            choice,
            floors,
            (),
            tested,
            (),
            nowhere,
            (),
            lambda fitted: fitted,
            wandering,
            (),
            lambda _: None,
        )

    return of


@pytest.mark.parametrize("effect", AFTER_REVERSALS)
def test_a_set_of_laws_after_reversals_holds_none_that_cannot_be_there(said, effect: str) -> None:
    found = said((effect,), ())
    whole = found.equivalent
    assert whole[0] == effect
    assert found.final.kept == ("sigma1",), "what the user fixed"
    assert set(whole[1:]) <= set(about(effect).looks_like)
    for other in whole[1:]:
        assert said((effect,), (other,)).equivalent == tuple(e for e in whole if e != other)
    assert said((effect,), (effect,)).equivalent == whole, "what was refitted was asked about"


@pytest.mark.parametrize(
    ("model", "channels"), [("SingleTsmDahl", ("F",)), ("LuGreFriction", ("F",)), ("TendonDrive", ("x_out", "tau_in"))]
)
def test_another_curve_after_reversals_is_a_set_with_play_before_the_friction(said, model, channels) -> None:
    base = kernel(model)
    nowhere = not_applicable(base, channels).keys()
    assert said(("presliding_shape",), nowhere).equivalent == ("presliding_shape", "backlash", "smooth_backlash")


@pytest.mark.parametrize(
    ("channel", "share", "unmoved", "word"),
    [
        ("F", 1.1 * FAMILY_SHARE, ("creep", "wear"), "unknown"),
        ("F", 0.9 * FAMILY_SHARE, ("creep", "wear"), "not_excited"),
        ("x_out", 0.83, ("creep", "wear"), "not_excited"),  # nothing is open there
        ("F", 0.0, ("creep",), "unknown"),
    ],
)
def test_a_gap_that_is_a_law_is_unknown_whatever_the_motion_would_not_show(channel, share, unmoved, word) -> None:
    floors = SimpleNamespace(without_answer=True, unexplained=np.array([True, False]))
    fitted = SimpleNamespace(problem=SimpleNamespace(channels=("F", "x_out")))
    baselines = SimpleNamespace(refitted=SimpleNamespace(fitted=fitted))
    evidence = (FamilyShare("load", channel, share),)
    more = SimpleNamespace(problem=fitted.problem)
    found = verdict.verdict_of(
        baselines,
        None,
        floors,
        evidence,
        ("creep", "wear"),
        unmoved,
        (),
        (),
        lambda one: more if one is fitted else one,
        (),
        (),
        lambda _: None,
    )
    assert found.word == word
    assert found.refitted is found.final is more


def test_few_levels_are_named_in_the_channels_that_are_explained(monkeypatch: pytest.MonkeyPatch) -> None:
    fitted: Any = SimpleNamespace(
        problem=SimpleNamespace(channels=("x_out", "tau_in")), effects=(), task=SimpleNamespace(fixed=()),
        not_kept=lambda _: fitted,
    )  # fmt: skip
    read: list[str] = []
    monkeypatch.setattr(verdict, "_final_fit", lambda *_: fitted)
    monkeypatch.setattr(verdict, "sign_notes", lambda _: ())
    monkeypatch.setattr(verdict, "with_levels", lambda one, levels: read.extend(x.spec for x in levels) or one)
    floors = SimpleNamespace(without_answer=False, open_=np.zeros(2, bool), unexplained=np.array([False, True]))
    winner = SimpleNamespace(effects=(), fitted=SimpleNamespace(model="TendonDrive"))
    choice = SimpleNamespace(winner=winner, supported=[winner])
    levels = (Levels("x_out", 0.07, 0.0), Levels("tau_in", 0.3, 0.0))
    baselines = SimpleNamespace(levels=levels, refitted=SimpleNamespace(fitted=fitted))
    found = verdict.verdict_of(
        baselines, choice, floors, (), (), (), (), (), lambda one: one, (), (), lambda _: None
    )  # fmt: skip
    assert (found.word, found.effects, read) == ("named", ("quantisation@x_out",), ["quantisation@x_out"])


@pytest.mark.parametrize("effects", [(), ("creep",), ("creep", "offset_drift@F")])
def test_a_zero_that_wanders_is_named_once_beside_the_laws(said, effects: tuple[str, ...]) -> None:
    found = said(effects, (), ("offset_drift@F",))
    assert found.word == "named"
    assert found.effects == tuple(dict.fromkeys((*effects, "offset_drift@F")))
    assert found.equivalent == ()
    assert found.final.read == ["offset_drift@F"], "the answer's model has it"


@pytest.mark.parametrize(
    ("curve", "held_out", "effects", "alone"),
    [
        (2.1, 2.1, ("backlash@v",), True),
        (2.1, None, ("backlash@v",), True),
        (1.9, 2.1, ("backlash@v",), False),  # another curve leaves nearly as little
        (2.1, 1.9, ("backlash@v",), False),  # on other motions it does
        (2.1, 2.1, ("viscous", "backlash@v"), False),  # it may shape the law of the other
        (1.1, 1.1, ("backlash@F",), True),  # play of what is measured is none before it
    ],
)
def test_play_before_a_friction_is_named_where_every_other_curve_leaves_much_more(
    curve: float, held_out: float | None, effects: tuple[str, ...], alone: bool
) -> None:
    def one(measured: float, elsewhere: float | None, effects: tuple[str, ...] = ()) -> Any:
        fitted = SimpleNamespace(model="LuGreFriction", spread=np.ones(1))
        return SimpleNamespace(
            effects=effects, fitted=fitted, acts=np.ones(1, bool), measured=np.array([0.03 * measured]),
            held_out=None if elsewhere is None else np.array([0.03 * elsewhere]),
        )  # fmt: skip

    play = one(1.0, None if held_out is None else 1.0, effects)
    found = verdict._plays_in_doubt(play, [one(9.7, 9.7), one(curve, held_out)])
    assert found == ([] if alone else ["backlash"])
