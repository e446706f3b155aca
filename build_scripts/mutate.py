"""Mutation run: faults put into changed files one at a time (cosmic-ray), and whether the files' own tests see them.

    python build_scripts/mutate.py [--base main] [--most 20] [FILE...]

Without files those are taken that differ from ``--base``. Everything runs in a copy; the working tree is not touched.
Tests of ``src/tsm_fmu/a/b.py`` are ``tests/a``. Ends with 1 where fewer than 85 % are killed.
"""

from __future__ import annotations

import argparse
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGE = Path("src/tsm_fmu")
LEAST_KILLED = 0.85
TIMEOUT_S = 120.0
"""Of the tests of one mutant; an endless loop counts as killed."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run and print; return the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE")
    parser.add_argument("--base", default="main", help="files that differ from this commit")
    parser.add_argument("--most", type=int, default=20, help="mutants of a file, drawn at random")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args(arguments)
    files = [f.resolve().relative_to(ROOT) for f in given.files] or changed(given.base)
    killed = total = 0
    with tempfile.TemporaryDirectory(prefix="mutate-") as folder:
        copy = Path(folder) / "copy"
        shutil.copytree(ROOT, copy, ignore=shutil.ignore_patterns(".git", ".venv", "out", "__pycache__", "docs"))
        for file in files:
            survivors, drawn = mutate(copy, file, given.most, given.seed)
            killed, total = killed + drawn - len(survivors), total + drawn
            print(f"{file}: {drawn - len(survivors)} of {drawn} killed", *survivors, sep="\n  ", flush=True)
    if not total:
        print("no mutants: no source file differs, or none has tests beside it")
        return 0
    print(f"all: {killed} of {total} killed ({killed / total:.0%}; expected {LEAST_KILLED:.0%})")
    return 0 if killed >= LEAST_KILLED * total else 1


def changed(base: str) -> list[Path]:
    """Source files that differ from a commit."""
    command = ["git", "diff", "--name-only", "--diff-filter=d", base, "--", str(PACKAGE)]
    names = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()
    return [Path(name) for name in names if name.endswith(".py")]


def mirrored(file: Path, root: Path) -> list[str]:
    """Test files that mirror a source file: those called after it, else its folder; none where there is no folder."""
    parts = file.relative_to(PACKAGE).parts
    folder = root / "tests" / (parts[0] if len(parts) > 1 else "")
    own = sorted(folder.glob(f"test_*{file.stem}*.py"))
    found: Iterable[Path] = own or ([folder] if len(parts) > 1 and folder.is_dir() else [])
    return [str(path.relative_to(root)) for path in found]


def mutate(copy: Path, file: Path, most: int, seed: int) -> tuple[list[str], int]:
    """Survivors of a file, as line, operator and changed text, and how many mutants were drawn.

    Raises
    ------
    SystemExit
        The tests fail without a mutant.
    """
    from cosmic_ray.commands import execute, init  # pyright: ignore[reportMissingImports]
    from cosmic_ray.config import ConfigDict  # pyright: ignore[reportMissingImports]
    from cosmic_ray.work_db import WorkDB, use_db  # pyright: ignore[reportMissingImports]
    from cosmic_ray.work_item import WorkerOutcome, WorkResult  # pyright: ignore[reportMissingImports]

    tests = mirrored(file, copy)
    if not tests:
        return [], 0
    command = f"env PYTHONPATH={copy / 'src'} {sys.executable} -m pytest -x -q -p no:cacheprovider {' '.join(tests)}"
    sound = subprocess.run(command.split(), cwd=copy, capture_output=True, text=True)
    if sound.returncode != 0:
        raise SystemExit(f"{' '.join(tests)} fail without a mutant -- expected sound tests -- mend them first")
    config = ConfigDict({
        "module-path": str(copy / file), "timeout": TIMEOUT_S, "test-command": f"sh -c 'cd {copy} && {command}'",
        "excluded-modules": [], "distributor": {"name": "local"},
    })  # fmt: skip
    with use_db(str(copy / "session.sqlite"), WorkDB.Mode.create) as session:
        init([copy / file], session, {})
        jobs = sorted(item.job_id for item in session.pending_work_items)
        drawn = set(random.Random(seed).sample(jobs, min(most, len(jobs))))
        session.set_multiple_results([j for j in jobs if j not in drawn], WorkResult(WorkerOutcome.SKIPPED))
        execute(session, config)
        done = [(item, result) for item, result in session.completed_work_items if item.job_id in drawn]
    return [_survivor(item, result) for item, result in done if not result.is_killed], len(done)


def _survivor(item: object, result: object) -> str:
    (mutation,) = item.mutations  # pyright: ignore[reportAttributeAccessIssue]
    diff = str(result.diff).splitlines()  # pyright: ignore[reportAttributeAccessIssue]
    lines = [line for line in diff if line[:1] in "+-" and line[:3] not in ("+++", "---")]
    return f"line {mutation.start_pos[0]}, {mutation.operator_name}: {' '.join(lines)}"


if __name__ == "__main__":
    sys.exit(main())
