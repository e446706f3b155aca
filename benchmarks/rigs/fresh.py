"""Cases drawn afresh from a seed, and their answers."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from ..blind.catalogue import STRATA, Case, catalogue
from ..blind.generate import write
from .outcome import Outcome, outcome_of_ours, outcome_of_theirs

TRIES = 5
"""Drawings of a case: of some the stated size cannot be reached."""
GENERATOR = "rigs.py"
SCORER = "score.py"


@dataclass(frozen=True)
class Drawn:
    """A case on disk.

    Attributes
    ----------
    author : str
    name, model : str
    folder : Path
        Logs only.
    values : dict of str to float
        Parameters believed.
    truth : dict
        For the judge.
    scorer : Path or None
        The other author's ``score.py``, where there is one.
    """

    author: str
    name: str
    model: str
    folder: Path
    values: dict[str, float]
    truth: dict[str, Any]
    scorer: Path | None = None


def ours(seed: int, count: int, out: Path, strata: str = STRATA) -> list[Drawn]:
    """Cases of `benchmarks.blind`, the strata in turn, each with a rig, motions and noise of its own.

    Parameters
    ----------
    seed, count : int
    out : Path
        Where logs are written.
    strata : str
    """
    rng, found = np.random.default_rng(seed), []
    groups = [[c for c in catalogue() if c.stratum == letter] for letter in strata]
    for k in range(count):
        group, name = groups[k % len(groups)], f"ours{k:04d}"
        truth = None
        for _ in range(TRIES):
            case: Case = group[int(rng.integers(len(group)))]
            case = replace(case, name=name, seed=int(rng.integers(1 << 31)))
            try:
                truth = write([case], out)[name]
                break
            except RuntimeError:  # the response at no amount has the stated size
                continue
        if truth is not None:
            folder = out / "logs" / name
            known = json.loads((folder / "case.json").read_text())
            found.append(Drawn("ours", name, known["model"], folder, known["set"], truth))
    return found


def theirs(home: Path, seed: int, count: int, out: Path) -> list[Drawn]:
    """Cases of another author's generator, which is run as its README says.

    Parameters
    ----------
    home : Path
        Folder with its ``rigs.py``.
    seed, count : int
    out : Path
    """
    words = [sys.executable, GENERATOR, "--seed", str(seed), "--cases", str(count), "--out", str(out.resolve())]
    # its compiled functions are kept beside it, where we may not write
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(out.resolve() / "numba")}
    subprocess.run(words, cwd=home, check=True, stdout=subprocess.DEVNULL, env=environment)
    found = []
    for truth in json.loads((out / "truth.json").read_text())["cases"]:
        folder = out / "logs" / truth["name"]
        call = json.loads((folder / "call.json").read_text())
        scorer = home / SCORER if (home / SCORER).is_file() else None
        found.append(Drawn("third", truth["name"], call["model"], folder, call["set"], truth, scorer))
    return found


def generator_of(option: str | None) -> Path | None:
    """Folder of the other author's generator: the one asked for, else ``rigs`` beside the data of $TSM_FMU_DATA."""
    data = os.environ.get("TSM_FMU_DATA")
    found = Path(option) if option else Path(data).resolve().parent / "rigs" if data else None
    return found if found and (found / GENERATOR).is_file() else None


def judged(case: Drawn) -> Outcome:
    """The outcome of a case, from its logs and what its user knows."""
    answer = answered(case)
    if case.author == "ours":
        return outcome_of_ours(case.name, case.model, case.truth, answer)
    return outcome_of_theirs(case.truth, answer, scored_by(case.scorer, case.truth, answer))


def scored_by(scorer: Path | None, truth: dict[str, Any], answer: dict[str, Any]) -> str:
    """What the other author's scorer calls an answer; empty without a scorer.

    Parameters
    ----------
    scorer : Path or None
        Its ``score.py``.
    truth, answer : dict
        An entry of ``truth.json``, content of ``diagnosis.json`` or ``{"failed": reason}``.
    """
    if scorer is None:
        return ""
    if "failed" in answer:
        return "error"
    spec = importlib.util.spec_from_file_location("other_authors_scorer", scorer)
    if spec is None or spec.loader is None:
        return ""
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return str(module.judge(truth, answer)[0])


def answered(case: Drawn) -> dict[str, Any]:
    """What ``diagnosis.json`` would hold; no FMU is built and no page written."""
    from tsm_fmu.diagnosis.report.write import as_json
    from tsm_fmu.diagnosis.workflow import diagnose
    from tsm_fmu.kernels.kernel import kernel
    from tsm_fmu.logs.record import read_record
    from tsm_fmu.models.contract import InputError

    begin = process_time()
    runs = {r: [read_record(p) for p in _logs(case.folder, r)] for r in ("measured", "holdout", "reference")}
    try:
        found = diagnose(
            kernel(case.model), runs["measured"], holdout=runs["holdout"], reference=runs["reference"],
            values=case.values,
        )  # fmt: skip
    except InputError as refusal:
        return {"failed": str(refusal), "seconds": process_time() - begin}
    return {**as_json(found, {}), "seconds": process_time() - begin}


def _logs(folder: Path, role: str) -> Iterator[Path]:
    yield from sorted(folder.glob(f"{role}*.csv"))


def commit() -> str:
    """Short hash of the commit that is judged, with a mark where files differ from it; empty without git."""
    where = Path(__file__).parent
    words = ("git", "-C", str(where), "describe", "--always", "--abbrev=9", "--dirty=-changed", "--exclude=*")
    try:
        return subprocess.run(words, check=True, capture_output=True, text=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""


def fresh_seed() -> int:
    """A seed that nobody has seen."""
    return int.from_bytes(os.urandom(4), "big")
