"""Which effects come closest to what has no name, on hypotheses made up of numbers."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tsm_fmu.diagnosis.answer import closest
from tsm_fmu.diagnosis.answer.closest import closest_effects

Ids = tuple[str, ...]


def said(
    word: str, plain: float, best: float, most: Ids, monkeypatch: pytest.MonkeyPatch, lost: float | None = None
) -> Ids:
    """Of parts of the mean square that the refitted model leaves, 4 % of the spread in one of two channels."""
    asked: list[Any] = []
    monkeypatch.setattr(closest, "telling_nuisances", lambda fitted, nuisances: asked.append(fitted) or most)

    def made(left: float, *added: str) -> Any:
        fitted = SimpleNamespace(spread=np.array([3.1, 0.7]), name=added)
        measured = np.array([left, 1.0]) * (0.04 * fitted.spread) ** 2
        return SimpleNamespace(
            measured=measured, held_out=None, fitted=fitted, added=added, effects=added, nuisances=("delay@F",)
        )

    one, first, final = made(best, "wear"), made(plain), SimpleNamespace(name="final")
    others = [made(lost, "breakaway_ageing")] if lost is not None else []  # that has lost its signature
    selection: Any = SimpleNamespace(
        choice=SimpleNamespace(best=one),
        hypotheses=(first, one, *others),
        baselines=SimpleNamespace(refitted=made(1.0)),
    )
    verdict: Any = SimpleNamespace(word=word, final=final)
    found = closest_effects(selection, verdict, missing=word in ("unknown", "named"))
    assert all(fitted is (final if word == "parameters" else first.fitted) for fitted in asked)
    return found


@pytest.mark.parametrize(
    ("plain", "best", "most", "expected"),
    [
        (0.9, 0.45, (), ("wear",)),  # closes half
        (0.9, 0.6, (), ("wear",)),  # adds a notable part of what is left
        (0.9, 0.7, (), ()),
        (0.9, 0.7, ("delay@F",), ()),  # the nuisance parameters do not close half
        (0.24, 0.22, ("delay@F",), ("delay@F",)),  # they do, and the best effect hardly more
        (0.24, 0.22, (), ("wear",)),
        (0.24, 0.15, ("delay@F",), ("wear",)),
    ],
)
def test_where_something_is_missing(
    plain: float, best: float, most: Ids, expected: Ids, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert said("unknown", plain, best, most, monkeypatch) == expected


@pytest.mark.parametrize(
    ("best", "lost", "expected"),
    [(0.7, 0.45, ("breakaway_ageing",)), (0.7, 0.6, ()), (0.6, 0.55, ("wear",)), (0.45, 0.3, ("wear",))],
)
def test_what_has_lost_its_signature_comes_closest_where_it_alone_closes_half(
    best: float, lost: float, expected: Ids, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert said("unknown", 0.9, best, (), monkeypatch, lost) == expected
    assert "breakaway_ageing" not in said("parameters", 0.9, best, (), monkeypatch, lost)


@pytest.mark.parametrize(
    ("word", "plain", "best", "most", "expected"),
    [
        ("parameters", 0.24, 0.22, ("delay@F",), ("delay@F",)),
        ("parameters", 0.24, 0.22, (), ()),
        ("parameters", 0.24, 0.15, (), ("wear",)),
        ("none", 0.24, 0.22, ("delay@F",), ()),
    ],
)
def test_where_nothing_is(
    word: str,
    plain: float,
    best: float,
    most: Ids,
    expected: Ids,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert said(word, plain, best, most, monkeypatch) == expected
