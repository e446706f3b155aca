"""Run the commands of the tutorials: ``python build_scripts/tutorials.py`` writes what they print into the pages.

A block ``console`` holds commands after ``$ `` and what they print. All blocks of a page run in one folder, one after
the other. The tests compare; numbers may differ by a hundredth, since libraries round differently, and ``...`` stands
for anything.
"""

from __future__ import annotations

import math
import re
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

PAGES = Path(__file__).parents[1] / "docs" / "tutorials"
BLOCK = re.compile(r"^```console\n(?P<text>.*?)^```$", re.MULTILINE | re.DOTALL)
COMMAND = re.compile(r"^\$ (?P<command>.*(?:\n> .*)*)\n(?P<printed>(?:(?!\$ ).*\n)*)", re.MULTILINE)
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
TOLERANCE = 0.01


@dataclass(frozen=True)
class Step:
    """A command of a page, what it is said to print, and where that stands in the page's text."""

    command: str
    expected: str
    begin: int
    end: int


def steps(text: str) -> Iterator[Step]:
    """Commands of a page in order."""
    for block in BLOCK.finditer(text):
        for found in COMMAND.finditer(block["text"]):
            start = block.start("text")
            yield Step(found["command"], found["printed"], start + found.start("printed"), start + found.end("printed"))


def ran(command: str, folder: Path) -> str:
    """What a command prints, both streams, in a folder."""
    command = re.sub(r"\n> ?", "\n", command)  # the shell's prompt of a further line
    python = shlex.quote(sys.executable)  # its folder's name may hold a blank
    command = re.sub(r"(?:^|(?<=; ))tsm-fmu\b", lambda _: f"{python} -m tsm_fmu", command)
    command = re.sub(r"(?:^|(?<=\n))python\b", lambda _: python, command)
    done = subprocess.run(
        command, shell=True, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=600
    )
    return done.stdout if not done.stdout or done.stdout.endswith("\n") else done.stdout + "\n"


def difference(expected: str, printed: str) -> str:
    """The first line that differs, in words; empty where all agree."""
    wanted, got = expected.splitlines(), printed.splitlines()
    if "..." in [line.strip() for line in wanted]:  # a line of dots stands for any lines
        k = [line.strip() for line in wanted].index("...")
        tail = wanted[k + 1 :]
        return difference("\n".join(wanted[:k]), "\n".join(got[:k])) or difference(
            "\n".join(tail), "\n".join(got[len(got) - len(tail) :] if tail else [])
        )
    for want, line in zip(wanted, got, strict=False):
        if not _same(want, line):
            return f"expected {want!r}, printed {line!r}"
    if len(wanted) != len(got):
        return f"expected {len(wanted)} lines, printed {len(got)}: {printed!r}"
    return ""


def _same(want: str, line: str) -> bool:
    parts = [re.escape(p) for p in NUMBER.sub("\0", want).split("...")]
    pattern = ".*?".join(parts).replace("\0", f"({NUMBER.pattern})")
    pattern = re.sub(r"(\\ )+", r"\\s+", pattern).replace("---", "-+").replace(r"\-\-\-", r"-+")
    shape = re.fullmatch(re.sub(r"(?:\\-){3,}", "-{3,}", pattern) + r"\s*", line)
    if shape is None:
        return False
    numbers = [float(n) for n in NUMBER.findall(want)]
    pairs = zip(numbers, map(float, shape.groups()), strict=False)
    return all(math.isclose(a, b, rel_tol=TOLERANCE, abs_tol=1e-12) for a, b in pairs)


def update(page: Path) -> None:
    """Write what the commands of a page print now into it; expectations with dots stay where they still hold."""
    text = page.read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        found = [(step, ran(step.command, Path(folder))) for step in steps(text)]
    for step, printed in reversed(found):
        if difference(step.expected, printed):
            text = text[: step.begin] + printed + text[step.end :]
    page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    for one in sorted(PAGES.glob(sys.argv[1] if len(sys.argv) > 1 else "*.md")):
        update(one)
