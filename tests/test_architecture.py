"""The house: packages in floors, each importing only from those below it, no circle, no late import to hide one."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[1] / "src" / "tsm_fmu"
FLOORS = (
    "models effects kernels logs batching card report regression checking identification tracking cosim fmu diagnosis "
    "scenarios reproduction verbs local_page cli"
).split()
"""From the ground up; docs/architecture.md says what each is."""
ROOT = {"__init__", "__main__", "card"}
"""Modules that stand between the packages: the public names, the program, the file that fits and FMUs share."""


def imports(path: Path) -> Iterator[tuple[str, int]]:
    """Absolute names of the modules of this package that a file imports, wherever in it, and the line."""
    here = path.relative_to(SOURCE).with_suffix("").parts[:-1]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level:
            base = here[: len(here) + 1 - node.level]
            whole = ".".join((*base, *([node.module] if node.module else ())))
            for alias in node.names:
                yield ".".join(filter(None, (whole, alias.name))), node.lineno
        elif isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("tsm_fmu"):
            yield node.module.partition(".")[2], node.lineno


FILES = sorted(p for p in SOURCE.rglob("*.py") if p.relative_to(SOURCE).parts[0] not in ("__init__.py", "__main__.py"))


def test_every_package_has_a_floor_and_nothing_stands_loose():
    assert {p.name for p in SOURCE.iterdir() if (p / "__init__.py").is_file()} | {"card"} == set(FLOORS)
    assert {p.stem for p in SOURCE.glob("*.py")} == ROOT


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.relative_to(SOURCE).as_posix())
def test_imports_go_down(path):
    floor = FLOORS.index(path.relative_to(SOURCE).parts[0].removesuffix(".py"))
    for name, line in imports(path):
        package = name.partition(".")[0]
        if package in FLOORS:
            assert FLOORS.index(package) <= floor, f"line {line}: {name} is above"
        else:
            assert name == "__version__", f"line {line}: {name}"


def test_no_circle_among_modules():
    """Also within a package: what two modules need of each other belongs to a third."""
    modules = {".".join(p.relative_to(SOURCE).with_suffix("").parts).removesuffix(".__init__"): p for p in FILES}
    needs = {
        module: {name if name in modules else name.rpartition(".")[0] for name, _ in imports(path)} & set(modules)
        for module, path in modules.items()
    }
    done: set[str] = set()
    path: list[str] = []

    def walk(module: str) -> None:
        assert module not in path, " -> ".join((*path[path.index(module) :], module))
        if module in done:
            return
        path.append(module)
        for other in sorted(needs[module]):
            walk(other)
        path.pop()
        done.add(module)

    for module in needs:
        walk(module)


WRITES_ITSELF = {
    "logs/whole_file.py",  # the one place
    "batching/kept.py",  # results of a batch, appended; a cut last line is known
    "cosim/unpack.py",  # locks of temporary folders
    "kernels/compiled_cache.py",  # of numba, below the logs
    "fmu/native/zig.py",  # sources in a temporary folder
}


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.relative_to(SOURCE).as_posix())
def test_files_are_written_in_one_place_that_leaves_no_half_ones(path):
    """By `write_whole`."""
    if path.relative_to(SOURCE).as_posix() in WRITES_ITSELF:
        return
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            assert node.func.attr not in ("write_text", "write_bytes"), f"line {node.lineno}"
        if isinstance(node, ast.Call) and getattr(node.func, "id", getattr(node.func, "attr", "")) == "open":
            modes = [a.value for a in (*node.args, *(k.value for k in node.keywords)) if isinstance(a, ast.Constant)]
            assert not any(mode in ("w", "wb", "a", "x", "w+") for mode in modes), (
                f"line {node.lineno}: use write_whole"
            )
