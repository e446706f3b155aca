"""Mutation run: faults put into source files one at a time (cosmic-ray), and whether the tests beside them see them.

    python build_scripts/mutate.py [--base main] [--most 20] [--seed 0] [PATH...]

Each PATH is a file or a folder of ``src/tsm_fmu``; of a folder, mutants are drawn from all its files together. Without
paths the files are taken that differ from ``--base``. Tests of ``src/tsm_fmu/a/b.py`` are those of ``tests/a`` that run
the changed line, cheapest first, as a run under coverage.py finds them (``out/mutate`` keeps what it found; tests as
sound without a mutant are asked for). A line that only a process of its own runs gets the tests called after the file.
Everything happens in a copy; the working tree is not touched. Ends with 1 where fewer than 85 % of all are killed.

Left out, because no test can see them: annotations, ``is`` for ``==`` and back, caches, and the guards ``frozen``,
``slots``, ``kw_only`` and ``strict``.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import importlib
import json
import os
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
PACKAGE = Path("src/tsm_fmu")
WORK = ROOT / "out" / "mutate"
LEAST_KILLED = 0.85
BUDGET_S = 30.0
"""Of the tests of one mutant when they pass: dearer ones are not asked, and what only they see counts as survived."""
HARMLESS = ("Eq_Is", "Is_Eq", "NotEq_IsNot", "IsNot_NotEq")
GUARDS = ("frozen", "slots", "kw_only", "strict")
CACHES = ("cache", "lru_cache", "cached_property")
PRELOADED = (
    "hypothesis", "matplotlib.figure", "numba", "numpy", "pytest", "scipy.integrate", "scipy.optimize", "scipy.signal",
    "scipy.stats", "statsmodels.stats.api",
)  # fmt: skip
"""Imported once for all mutants: each of them is a fork."""
MEMORY = 8 << 30


@dataclass(frozen=True)
class Mutant:
    """One fault: the file, its line, the operator with its occurrence, and the file's text with it."""

    file: Path
    line: int
    operator: str
    occurrence: int

    @property
    def key(self) -> tuple[str, str, int]:
        return str(self.file), self.operator, self.occurrence


def main(arguments: Sequence[str] | None = None) -> int:
    """Run and print; return the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("paths", nargs="*", type=Path, metavar="PATH")
    parser.add_argument("--base", default="main", help="files that differ from this commit")
    parser.add_argument("--most", type=int, default=20, help="mutants of a path, drawn at random")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args(arguments)
    paths = [p.resolve().relative_to(ROOT) for p in given.paths] or changed(given.base)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # by way of what is to be tidied up
    copy = copied()
    for name in PRELOADED:
        importlib.import_module(name)
    killed = total = 0
    for path in paths:
        survivors, drawn = mutate(copy, path, given.most, given.seed)
        killed, total = killed + drawn - len(survivors), total + drawn
        print(
            f"{path}: {drawn - len(survivors)} of {drawn} killed (seed {given.seed})",
            *survivors,
            sep="\n  ",
            flush=True,
        )
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


def copied() -> Path:
    """A copy of the tree at the same place in every run, so that what numba compiled there stays."""
    copy = WORK / "copy"
    shutil.rmtree(copy, ignore_errors=True)
    ignored = shutil.ignore_patterns(".git", ".venv", "out", "__pycache__", "_build", ".hypothesis")
    shutil.copytree(ROOT, copy, ignore=ignored, symlinks=True)
    return copy


def mirrored(path: Path, root: Path) -> list[str]:
    """Tests that mirror a file or folder of the package: those of its folder, and those elsewhere that import a module
    of it, or are called after one, which its folder's tests are not; without a folder, those called after it.
    """
    parts = path.relative_to(PACKAGE).parts
    folder = root / "tests" / parts[0]
    if folder.is_dir():
        own = set[str]().union(*(_modules(parts[0], f) for f in folder.rglob("*.py")))
        own |= {f.stem for f in folder.rglob("test_*.py")}
        others = sorted(f for f in (root / "tests").rglob("test_*.py") if folder not in f.parents)
        return [str(f.relative_to(root)) for f in (folder, *(f for f in others if _modules(parts[0], f) - own))]
    return [str(f.relative_to(root)) for f in sorted((root / "tests").glob(f"test_*{path.stem}*.py"))]


def _modules(folder: str, tests: Path) -> set[str]:
    """Modules of a folder of the package that a file of tests imports, and its own name where one is called so."""
    text, place = tests.read_text(encoding="utf-8"), ROOT / PACKAGE / folder
    named = {tests.stem} if any(place.rglob(f"{tests.stem.removeprefix('test_')}.py")) else set[str]()
    return named | set(re.findall(rf"^\s*(?:from|import) tsm_fmu\.({folder}\.[\w.]+)", text, re.M))


def named_after(file: Path, tests: Iterable[str]) -> list[str]:
    """Of some tests, those in a file that is called after a source file."""
    return [test for test in tests if file.stem in Path(test.partition("::")[0]).stem]


def mutate(copy: Path, path: Path, most: int, seed: int) -> tuple[list[str], int]:
    """Survivors of a file or folder, as line, operator and changed text, and how many mutants were drawn."""
    folders = mirrored(path, copy)
    if not folders:
        return [], 0
    files = [path] if path.suffix else sorted(f.relative_to(copy) for f in (copy / path).rglob("*.py"))
    mutants = sorted((m for file in files for m in mutants_of(copy, file)), key=lambda m: m.key)
    drawn = random.Random(seed).sample(mutants, min(most, len(mutants)))
    covered = Covered.of(copy, folders, files)
    tested = _state(copy, [f for folder in folders for f in _files_of(copy / folder)])
    survivors = []
    for mutant in sorted(drawn, key=lambda m: m.key):
        before = (copy / mutant.file).read_text(encoding="utf-8")
        after = _mutated(before, mutant)
        tests, seconds = covered.tests_of(copy, mutant)
        kept = WORK / "verdicts" / hashlib.sha256(f"{tested}{mutant.file}{after}".encode()).hexdigest()[:20]
        if not kept.is_file():  # else an earlier run, stopped before its end, has asked
            survived = not tests or _passes(copy, mutant.file, after, tests, seconds)
            kept.parent.mkdir(parents=True, exist_ok=True)
            kept.write_text("survived" if survived else "killed", encoding="utf-8")
        if kept.read_text(encoding="utf-8") == "survived":
            told = _difference(before, after) + ("" if tests else " (no test runs it)")
            survivors.append(f"{mutant.file.relative_to(PACKAGE)}:{mutant.line}, {mutant.operator}: {told}")
    return survivors, len(drawn)


def _files_of(place: Path) -> list[Path]:
    return sorted(place.rglob("*.py")) if place.is_dir() else [place]


def _state(copy: Path, files: Iterable[Path]) -> str:
    """Hash of the text of files, by their paths in the copy."""
    texts = ((str(f.relative_to(copy)).encode(), f.read_bytes()) for f in files)
    return hashlib.sha256(b"".join(part for pair in texts for part in pair)).hexdigest()


def mutants_of(copy: Path, file: Path) -> Iterator[Mutant]:
    """Every mutant of a file that a test could see."""
    from cosmic_ray.ast import ast_nodes, get_ast  # pyright: ignore[reportMissingImports]
    from cosmic_ray.plugins import get_operator, operator_names  # pyright: ignore[reportMissingImports]

    text = (copy / file).read_text(encoding="utf-8")
    hidden, nodes = list(_hidden(ast.parse(text))), list(ast_nodes(get_ast(text)))
    for name in operator_names():
        operator: Any = get_operator(name)
        if operator.arguments() or name.endswith(HARMLESS):
            continue
        positions = [at for node in nodes for at in operator().mutation_positions(node)]
        for occurrence, (start, _) in enumerate(positions):
            if not any(begin <= tuple(start) < end for begin, end in hidden):
                yield Mutant(file, start[0], name, occurrence)


def _hidden(tree: ast.AST) -> Iterator[tuple[tuple[int, int], tuple[int, int]]]:
    """Ranges in which no mutant is drawn."""
    for node in ast.walk(tree):
        parts: list[ast.expr | None] = []
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            parts.append(node.returns)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            parts += [d for d in node.decorator_list if _name(d) in CACHES]
        if isinstance(node, ast.arg | ast.AnnAssign):
            parts.append(node.annotation)
        if isinstance(node, ast.keyword) and node.arg in GUARDS:
            parts.append(node.value)
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.BinOp) and isinstance(node.value.op, ast.BitOr):
            types = all(isinstance(t, ast.Name) and t.id[0].isupper() and not t.id.isupper() for t in node.targets)
            parts += [node.value] if types else []  # a union of types
        for part in parts:
            if part is not None:
                low = part.col_offset - (part in getattr(node, "decorator_list", ()))  # with its @
                yield (part.lineno, low), (part.end_lineno, part.end_col_offset)  # pyright: ignore


def _name(decorator: ast.AST) -> str:
    called = decorator.func if isinstance(decorator, ast.Call) else decorator
    return called.attr if isinstance(called, ast.Attribute) else getattr(called, "id", "")


def _mutated(text: str, mutant: Mutant) -> str:
    from cosmic_ray.mutating import mutate_code  # pyright: ignore[reportMissingImports]
    from cosmic_ray.plugins import get_operator  # pyright: ignore[reportMissingImports]

    operator: Any = get_operator(mutant.operator)
    return str(mutate_code(text, operator(), mutant.occurrence))


def _difference(before: str, after: str) -> str:
    old, new = before.splitlines(), after.splitlines()
    changes = [(a.strip(), b.strip()) for a, b in zip(old, new, strict=False) if a != b]
    return "line removed" if len(old) != len(new) else " | ".join(f"- {a} + {b}" for a, b in changes)


@dataclass(frozen=True)
class Covered:
    """Tests of each line of each file (an empty name: as the file is imported), and how long each test takes [s]."""

    lines: dict[str, dict[int, list[str]]]
    seconds: dict[str, float]

    @classmethod
    def of(cls, copy: Path, folders: Sequence[str], files: Sequence[Path]) -> Covered:
        """From a run of all tests of the folders, file by file; what is kept of it is used where nothing changed."""
        shared = [copy / f for f in files] + sorted((copy / "tests").rglob("conftest.py"))
        found = cls({}, {})
        for folder in folders:
            for tests in (f for f in _files_of(copy / folder) if f.name.startswith("test_")):
                name = _state(copy, [*shared, tests])[:20]
                kept = WORK / "covered" / f"{name}.json"
                if not kept.is_file():
                    kept.parent.mkdir(parents=True, exist_ok=True)
                    test = str(tests.relative_to(copy))
                    if _forked(copy, lambda test=test, kept=kept: _measure(copy, test, kept), 3600.0):
                        raise SystemExit(f"{test} fails without a mutant -- expected sound tests -- mend it first")
                found.add(json.loads(kept.read_text(encoding="utf-8")))
        return found

    def add(self, one: dict[str, Any]) -> None:
        """What one file of tests runs."""
        self.seconds.update(one["seconds"])
        for file, lines in one["lines"].items():
            mine = self.lines.setdefault(file, {})
            for line, tests in lines.items():
                mine.setdefault(int(line), []).extend(tests)

    def tests_of(self, copy: Path, mutant: Mutant) -> tuple[list[str], float]:
        """Tests that run a mutant's statement, cheapest first, as many as the budget allows, and their duration [s]."""
        text = (copy / mutant.file).read_text(encoding="utf-8")
        tree = ast.parse(text)
        statement = _statement(tree, mutant.line)
        lines = range(statement[0], statement[1] + 1)
        tests = self._running(mutant.file, lines)
        if any(n in self.lines.get(str(mutant.file), {}) for n in lines) and (not tests or _at_import(tree, lines[0])):
            tests |= self._importing(copy, mutant.file, text, statement)  # one that imports it is not all that use it
        if not tests:
            tests = set(named_after(mutant.file, self.seconds))
        chosen, seconds = [], 0.0
        for test in sorted(tests, key=lambda t: (self.seconds.get(t, 0.0), t)):
            seconds += self.seconds.get(test, 0.0)
            if chosen and seconds > BUDGET_S:
                break
            chosen.append(test)
        return chosen, seconds

    def _running(self, file: Path, lines: Iterable[int]) -> set[str]:
        known = self.lines.get(str(file), {})
        return {test for line in lines for test in known.get(line, ()) if test}

    def _importing(self, copy: Path, file: Path, text: str, statement: tuple[int, int]) -> set[str]:
        """For what runs as the file is imported: tests that use the name assigned there, else those of its scope."""
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.Assign | ast.AnnAssign) and node.lineno == statement[0]:
                target = node.targets[0] if isinstance(node, ast.Assign) else node.target
                found = self._using(copy, [n.id for n in ast.walk(target) if isinstance(n, ast.Name)])
                if found:
                    return found
            if isinstance(node, ast.FunctionDef):
                first = min([node.lineno, *(d.lineno for d in node.decorator_list)])
                if first <= statement[0] < node.body[0].lineno:
                    return self._running(file, range(node.body[0].lineno, (node.end_lineno or 0) + 1))
        return self._running(file, range(1, text.count("\n") + 2))

    def _using(self, copy: Path, names: Sequence[str]) -> set[str]:
        """Tests of all statements with one of these names."""
        found: set[str] = set()
        for file in self.lines:
            tree = ast.parse((copy / file).read_text(encoding="utf-8"))
            lines = {n.lineno for n in ast.walk(tree) if isinstance(n, ast.Name) and n.id in names}
            lines |= {n.lineno for n in ast.walk(tree) if isinstance(n, ast.Attribute) and n.attr in names}
            for line in lines:
                first, last = _statement(tree, line)
                found |= self._running(Path(file), range(first, last + 1))
        return found


def _statement(tree: ast.AST, line: int) -> tuple[int, int]:
    """First and last line of the innermost statement at a line; of a compound one its head alone."""
    best = (line, line)
    for node in ast.walk(tree):  # outer before inner
        if isinstance(node, ast.stmt) and node.lineno <= line <= (node.end_lineno or line):
            body = getattr(node, "body", None)
            last = max(node.lineno, body[0].lineno - 1) if body else node.end_lineno or line
            best = (node.lineno, last) if line <= last else best
    return best


def _at_import(tree: ast.AST, line: int) -> bool:
    """Whether a line runs as its file is imported: it is in no function."""
    functions = (n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef | ast.AsyncFunctionDef))
    return not any(f.body[0].lineno <= line <= (f.end_lineno or line) for f in functions)


def _measure(copy: Path, tests: str, kept: Path) -> int:
    """Run a file of tests under coverage and write which test runs which line; return pytest's exit code."""
    import coverage  # pyright: ignore[reportMissingImports]
    import pytest

    data = WORK / f"coverage-{os.getpid()}"
    watch = coverage.Coverage(data_file=str(data), source=[str(copy / PACKAGE)], config_file=False, messages=False)
    seconds: dict[str, float] = {}
    users: dict[str, list[str]] = {}

    class Contexts:
        """A test's own lines go to it, those of a wider fixture to all that use it."""

        def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
            for item in items:
                for name in getattr(item, "fixturenames", ()):
                    users.setdefault(f"fixture {name}", []).append(item.nodeid)

        @pytest.hookimpl(wrapper=True)
        def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
            self.test = item.nodeid
            watch.switch_context(item.nodeid)
            try:
                return (yield)
            finally:
                watch.switch_context("")

        @pytest.hookimpl(wrapper=True)
        def pytest_fixture_setup(self, fixturedef: Any) -> Iterator[None]:
            if fixturedef.scope != "function":
                watch.switch_context(f"fixture {fixturedef.argname}")
            try:
                return (yield)
            finally:
                watch.switch_context(self.test)

        def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
            seconds[report.nodeid] = seconds.get(report.nodeid, 0.0) + report.duration

    watch.start()
    code = int(pytest.main(["-q", "-p", "no:cacheprovider", tests], plugins=[Contexts()]))
    watch.stop()
    watch.save()
    found = watch.get_data()
    lines = {}
    for file in (f for f in found.measured_files() if f.endswith(".py")):  # and no templates
        by_line = found.contexts_by_lineno(file)
        spread = {n: sorted({t for c in cs for t in users.get(c, [c])}) for n, cs in by_line.items()}
        lines[str(Path(file).relative_to(copy))] = spread
    if code in (0, 5):
        kept.write_text(json.dumps({"seconds": seconds, "lines": lines}), encoding="utf-8")
    data.unlink(missing_ok=True)
    return 0 if code == 5 else code


def _passes(copy: Path, file: Path, text: str, tests: Sequence[str], seconds: float) -> bool:
    """Whether the tests pass with a file's other text; an endless loop and a full memory do not."""
    import pytest

    place = copy / file
    before, stamp = place.read_bytes(), place.stat()
    place.write_text(text, encoding="utf-8")
    try:
        code = _forked(
            copy, lambda: int(pytest.main(["-x", "-q", "-p", "no:cacheprovider", *tests])), 15.0 + 5.0 * seconds
        )
    finally:
        place.write_bytes(before)
        os.utime(place, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))  # else what is compiled of it seems old
    return code in (0, 5)


def _forked(copy: Path, run: Callable[[], int], limit_s: float) -> int:
    """Exit code of a function in a process of its own in the copy; not 0 beyond its time."""
    child = os.fork()
    if child == 0:
        os.setsid()
        log = os.open(WORK / "tests.log", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        for stream in (1, 2):
            os.dup2(log, stream)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        resource.setrlimit(resource.RLIMIT_CPU, (int(limit_s), int(limit_s) + 5))
        resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))  # a browser reserves far more than it uses
        signal.signal(
            signal.SIGINT, signal.default_int_handler
        )  # in the background a shell ignores it, and tests send it
        os.environ |= {"PYTHONPATH": str(copy / "src"), "PYTHONDONTWRITEBYTECODE": "1"}
        sys.dont_write_bytecode = True
        sys.path.insert(0, str(copy / "src"))
        os.chdir(copy)
        code = 3
        try:
            code = run()
        finally:
            os._exit(code)
    end = time.monotonic() + 4.0 * limit_s  # it may wait for others
    try:
        while time.monotonic() < end:
            done, status = os.waitpid(child, os.WNOHANG)
            if done:
                child = 0
                return os.waitstatus_to_exitcode(status)
            time.sleep(0.02)
        return 3
    finally:
        if child:  # too late, or this program is ended
            os.killpg(child, signal.SIGKILL)
            os.waitpid(child, 0)


if __name__ == "__main__":
    sys.exit(main())
