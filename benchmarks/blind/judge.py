"""``tsm-fmu diagnose`` on the cases: what it answers, by case."""

from __future__ import annotations

import contextlib
import io
import json
from collections.abc import Callable
from pathlib import Path
from time import perf_counter


def arguments(folder: Path, out: Path) -> list[str]:
    """Command line for one case, from what its user knows."""
    known = json.loads((folder / "case.json").read_text())
    words = ["diagnose", known["model"]]
    for role in ("measured", "holdout", "reference"):
        words += [w for name in known[role] for w in (f"--{role}", str(folder / name))]
    words += [w for name, value in known["set"].items() for w in ("--set", f"{name}={value!r}")]
    return [*words, *known["options"], "--out", str(out)]


def in_process(words: list[str]) -> int:
    """Run the command line in this process, quietly; return its exit code."""
    import tsm_fmu.cli  # noqa: F401  registers the verbs
    from tsm_fmu.cli.app import run

    with contextlib.redirect_stdout(io.StringIO()):
        return run(words)


def diagnosed(folder: Path, out: Path, run: Callable[[list[str]], int] = in_process) -> dict[str, object]:
    """Answer to one case; of one that fails only ``failed``, the exit code.

    Parameters
    ----------
    folder : Path
        ``logs/CASE``.
    out : Path
        Where the diagnosis may write.
    run : callable
        Runs the command line and returns its exit code.
    """
    began, report = perf_counter(), out / "diagnosis.json"
    report.unlink(missing_ok=True)
    out.mkdir(parents=True, exist_ok=True)
    code = run(arguments(folder, out))
    wall = perf_counter() - began
    if code != 0 or not report.is_file():
        return {"failed": code, "wall_s": wall}
    return {**json.loads(report.read_text()), "wall_s": wall}
