"""The fixed blind cases through the command line, judged together as ``python -m benchmarks.blind`` judges all."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from benchmarks.blind.catalogue import STRATA, gate
from benchmarks.blind.generate import write
from benchmarks.blind.judge import diagnosed
from benchmarks.blind.score import Scored, scored


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> list[Scored]:
    out, cases = tmp_path_factory.mktemp("blind"), gate()
    truth = write(cases, out)
    return [scored(c.name, truth[c.name], diagnosed(out / "logs" / c.name, out / "diagnoses" / c.name)) for c in cases]


def of(results: Sequence[Scored], strata: str) -> list[Scored]:
    found = [r for r in results if r.stratum in strata]
    assert {r.stratum for r in found} == set(strata)
    return found


def test_every_stratum_is_there_and_no_run_fails(results: list[Scored]) -> None:
    assert {r.stratum for r in results} == set(STRATA)
    assert [r.name for r in results if r.verdict == "failed"] == []


def test_nothing_is_named_where_nothing_is_missing(results: list[Scored]) -> None:
    assert {r.name: r.named for r in of(results, "BF") if r.named} == {}


def test_wrong_parameters_are_said_to_be_that(results: list[Scored]) -> None:
    assert {r.verdict for r in of(results, "B")} == {"parameters"}


def test_outside_the_vocabulary_no_wrong_name(results: list[Scored]) -> None:
    rows = of(results, "E")
    assert {r.name: r.named for r in rows if r.wrong} == {}
    assert any(r.verdict == "unknown" for r in rows)


def test_what_the_log_cannot_show_is_listed(results: list[Scored]) -> None:
    assert all(r.listed for r in of(results, "G"))


def test_names_are_given_and_right(results: list[Scored]) -> None:
    rows = of(results, "ACD")
    right = sum(r.right > 0 and not r.wrong for r in rows)
    assert right >= 0.6 * len(rows)
    assert sum(r.wrong for r in results) <= 1
    closures = [r.closure for r in of(results, "A") if r.right and r.closure is not None]
    assert sorted(closures)[len(closures) // 2] > 0.9
