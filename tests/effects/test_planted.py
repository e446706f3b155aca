"""Every effect, planted in an easy log, is named, or the set that its file declares as look-alikes.

One model and place an effect; with ``TSM_FMU_PLANTED=all`` every model and place, which takes 20 minutes.
``python -m benchmarks.planted`` prints the table of all of them.
"""

from __future__ import annotations

import os

import pytest

from benchmarks.planted.catalogue import Case, catalogue, first_of_each
from benchmarks.planted.formulas import FORMULAS
from benchmarks.planted.judge import judged
from tsm_fmu.effects import EFFECTS
from tsm_fmu.kernels.chain import attach
from tsm_fmu.kernels.kernel import kernel

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")


def test_every_effect_is_planted() -> None:
    ids = [module.NAME for module in EFFECTS]
    assert sorted(FORMULAS) == sorted(ids)
    assert sorted({case.effect for case in catalogue()}) == sorted(ids)


def test_every_place_is_one_of_the_effect() -> None:
    for case in catalogue():
        spec = f"{case.effect}@{case.channel}" if case.channel else case.effect
        assert attach(kernel(case.model), spec).spec == spec


CASES = catalogue() if os.environ.get("TSM_FMU_PLANTED") == "all" else first_of_each()


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_it_is_named(case: Case) -> None:
    found = judged(case)
    assert found.right, f"{case.name}: {found.verdict} {', '.join(found.answer)}"
