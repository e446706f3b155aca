"""Write the tables of criteria into the docs: ``python build_scripts/write_criteria.py`` (``--check`` only compares).

Name, value and reason come from the modules themselves; a table stands between two comments,
``<!-- criteria of MODULE -->`` and ``<!-- end -->``.
"""

from __future__ import annotations

import ast
import re
import sys
from importlib import import_module
from itertools import pairwise
from pathlib import Path

DOCS = Path(__file__).parents[1] / "docs"
PAGES = {"tsm_fmu.diagnosis.criteria": "diagnosis.md", "tsm_fmu.checking.criteria": "checking.md"}
UNITS = {"S": "s", "HZ": "Hz", "RAD": "rad", "TURNS": "turns", "SAMPLES": "samples", "DB": "dB"}
"""Last word of a name, for the unit that it stands for."""


def criteria(module: str) -> list[tuple[str, str, object, str]]:
    """Section, name, value and reason of each criterion of a module, in its order."""
    loaded = import_module(module)
    text = Path(str(loaded.__file__)).read_text(encoding="utf-8")
    sections = {n: line[2:] for n, line in enumerate(text.splitlines(), 1) if line.startswith("# ")}
    found, body = [], ast.parse(text).body
    for statement, after in pairwise(body):
        if isinstance(statement, ast.Assign) and isinstance(statement.targets[0], ast.Name):
            name = statement.targets[0].id
            said = after.value if isinstance(after, ast.Expr) else None
            if not isinstance(said, ast.Constant) or not isinstance(said.value, str):
                raise SystemExit(f"{module}.{name} -- expected a sentence below it that says why -- write one")
            section = sections[max(n for n in sections if n < statement.lineno)]
            found.append((section, name, getattr(loaded, name), " ".join(said.value.split())))
    return found


def shown(name: str, value: object) -> str:
    """A value with its unit: shares in per cent."""
    if isinstance(value, tuple):
        return ", ".join(shown(name, v) for v in value)
    if not isinstance(value, (int, float)):
        return str(value)
    last = name.rpartition("_")[2]
    if last == "SHARE":
        return f"{100.0 * value:.12g} %"
    return f"{value:.12g} {UNITS[last]}" if last in UNITS else f"{value:.12g}"


def table(module: str) -> str:
    """The table of a module in Markdown."""
    lines, section = [], ""
    for heading, name, value, why in criteria(module):
        if heading != section:
            lines += ["", f"**{heading}**", "", "| name | value | why |", "|---|---|---|"]
            section = heading
        lines.append(f"| `{name}` | {shown(name, value)} | {why.replace('|', chr(92) + '|')} |")
    return "\n".join(lines).strip()


def updated(text: str, module: str) -> str:
    """A page with the table of a module."""
    begin, end = f"<!-- criteria of {module} -->\n", "<!-- end -->"
    pattern = re.compile(f"{re.escape(begin)}.*?{re.escape(end)}", re.DOTALL)
    if not pattern.search(text):
        raise SystemExit(f"no {begin.strip()} ... {end} in docs/{PAGES[module]} -- expected both -- add them")
    return pattern.sub(lambda _: f"{begin}\n{table(module)}\n\n{end}", text)


def main(words: list[str]) -> int:
    """Write all tables; with ``--check`` the exit code is 1 where one is not in step."""
    behind = []
    for module, page in PAGES.items():
        path = DOCS / page
        text = path.read_text(encoding="utf-8")
        new = updated(text, module)
        if new != text:
            behind.append(page)
            if "--check" not in words:
                path.write_text(new, encoding="utf-8")
    if behind and "--check" in words:
        print(f"docs/{', docs/'.join(behind)} -- not in step with the criteria -- run python {sys.argv[0]}")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
