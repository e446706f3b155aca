"""The order of the runs of a life."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tsm_fmu import InputError, Record, read_record
from tsm_fmu.tracking.order import order_note, ordered

HOUR = 3600.0


def run(name: str, **values: float) -> Record:
    columns = {column: np.array([value, 7.0]) for column, value in values.items()}
    return Record(name, np.array([0.0, 1.0]), columns, dict.fromkeys(columns, "1"))


def names(records: list[Record]) -> list[str]:
    return [record.name for record in records]


def test_numbers_in_names_count_by_their_value() -> None:
    given = [run(name) for name in ("day_10", "day_2", "day_1b", "rig 3/day_1", "day_1")]
    assert names(ordered(given, "name")) == ["day_1", "day_1b", "day_2", "day_10", "rig 3/day_1"]
    assert names(ordered(given, "given")) == names(given)


def test_a_column_counts_by_its_first_value() -> None:
    given = [run("a", cycles=1170.0), run("b", cycles=-3.0), run("c", cycles=93.5)]
    assert names(ordered(given, "cycles")) == ["b", "c", "a"]
    with pytest.raises(InputError, match=r"runs b and d are both at -3 -- expected"):
        ordered([*given, run("d", cycles=-3.0)], "cycles")


def test_dates_of_logs_in_whatever_form_they_stand(tmp_path: Path) -> None:
    """2026-05-04T13:00Z is 1777899600 s after 1970; the window moves the beginning."""
    texts = {
        "iso": "time,x [m]\n2026-05-04T15:00:00+02:00,0\n2026-05-04T15:00:01+02:00,1\n2026-05-04T15:00:02+02:00,1\n",
        "unix": f"time [s],x [m]\n{1777899600 - HOUR},0\n{1777899601 - HOUR},1\n{1777899602 - HOUR},1\n",
        "unix_ms": "time [ms],x [m]\n1777899599000,0\n1777899600500,1\n1777899601000,1\n",
    }
    for name, text in texts.items():
        (tmp_path / f"{name}.csv").write_text(text)
    records = [read_record(tmp_path / f"{name}.csv") for name in texts]
    assert [record.begins for record in records] == [1777899600.0, 1777899600.0 - HOUR, 1777899599.0]
    assert names(ordered(records, "start")) == ["unix", "unix_ms", "iso"]
    assert "--by start" in order_note(records, "given")[0]
    assert order_note(ordered(records, "start"), "given") == ()
    later = [*records[:2], read_record(tmp_path / "unix_ms.csv", start=1.0)]
    assert names(ordered(later, "start")) == ["unix", "iso", "unix_ms"]


def test_times_of_day_have_no_date(tmp_path: Path) -> None:
    (tmp_path / "day.csv").write_text("time,x [m]\n13:00:00,0\n13:00:01,1\n")
    record = read_record(tmp_path / "day.csv")
    assert record.begins is None
    with pytest.raises(InputError, match=r"are no dates -- expected time stamps"):
        ordered([record], "start")
