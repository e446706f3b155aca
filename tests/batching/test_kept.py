"""Results kept on disk: what a killed batch goes on from, what does not count, and places that cannot be written."""

from __future__ import annotations

import hashlib
import json
import shutil
from pathlib import Path

import pytest

from tsm_fmu.batching.kept import Kept, digest_of
from tsm_fmu.models.contract import InputError


def test_kept_results_survive_a_torn_line_and_count_only_for_the_same_batch(tmp_path: Path) -> None:
    path = tmp_path / "points.jsonl"
    first = Kept(path, {"seed": 3})
    assert not path.exists()  # a batch that found no place to work leaves no file
    first.add(4, {"y": 1.25})
    first.add(1, {"y": -0.5})
    with path.open("a", encoding="utf-8") as file:
        file.write('[2, {"y": 7')
    again = Kept(path, {"seed": 3})
    assert again.results == {4: {"y": 1.25}, 1: {"y": -0.5}}
    again.add(2, {"y": 9.0})
    assert Kept(path, {"seed": 3}).results == {4: {"y": 1.25}, 1: {"y": -0.5}, 2: {"y": 9.0}}
    assert len(path.read_text(encoding="utf-8").splitlines()) == 4  # the torn one is gone, the others stand once
    assert Kept(path, {"seed": 4}).results == {}
    again.finish()
    assert not path.exists()
    again.finish()


@pytest.mark.parametrize("bad", ["{", "7", "[1]", '["a", {}]', "[1, 2]", "null", ""])
def test_what_follows_a_broken_line_is_not_believed(tmp_path: Path, bad: str) -> None:
    path = tmp_path / "points.jsonl"
    kept = Kept(path, "batch")
    kept.add(0, {"y": 0.5})
    with path.open("a", encoding="utf-8") as file:
        file.write(f"{bad}\n{json.dumps([8, {'y': 8.0}])}\n")
    again = Kept(path, "batch")
    assert again.results == {0: {"y": 0.5}}
    again.add(3, {"y": 1.5})
    assert Kept(path, "batch").results == {0: {"y": 0.5}, 3: {"y": 1.5}}


def test_a_file_that_is_none_of_ours_counts_as_none(tmp_path: Path) -> None:
    path = tmp_path / "points.jsonl"
    path.write_bytes(b"\xff\xfe\x00 no text")
    kept = Kept(path, Path("runs"))  # which JSON does not know
    assert kept.results == {}
    kept.add(0, {})
    assert Kept(path, Path("runs")).results == {0: {}}
    assert Kept(path, Path("other")).results == {}


def test_a_place_that_cannot_be_written_is_one_line_with_what_is_kept(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match=r"file -- expected a folder that can be written \(.+\) -- choose another"):
        Kept(tmp_path / "file" / "points.jsonl", 1)
    folder = tmp_path / "deep" / "below"
    kept = Kept(folder / "points.jsonl", 1)
    assert folder.is_dir()
    for number in range(3):
        kept.add(number, {})
    shutil.rmtree(folder)
    with pytest.raises(InputError) as wrong:
        kept.add(3, {})
    said = str(wrong.value)
    assert said.startswith(f"{folder / 'points.jsonl'} -- expected a file that can be written (No such file")
    assert said.endswith("make room, and give the command again: 3 results are kept")


def test_a_digest_is_that_of_the_bytes_and_empty_without_any(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"\x00\xff 1")
    assert digest_of(tmp_path / "a") == hashlib.sha256(b"\x00\xff 1").hexdigest()
    assert digest_of(tmp_path / "none") == digest_of(tmp_path) == ""
