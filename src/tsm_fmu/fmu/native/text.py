"""Lines of C: width, strings, comments."""

from __future__ import annotations

import re

INDENT = "    "
WIDTH = 118


def quoted(text: str) -> str:
    """A string as C has it."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'


def wrapped(line: str, comment: str = "") -> list[str]:
    """A line in pieces of readable width."""
    margin = len(line) - len(line.lstrip())
    found: list[str] = []
    while len(line) > WIDTH:
        places = [m.end() for m in re.finditer(r"(, |\) [-+*/] |&& |\? |: | [-+*/] )", line[:WIDTH])]
        place = max((p for p in places if p > margin + 20 and line[:p].count('"') % 2 == 0), default=0)
        if not place:
            break
        found.append(line[:place].rstrip())
        line = " " * (margin + 8) + line[place:]
    if len(line) + len(comment) > WIDTH + 10 and comment:
        return [" " * margin + comment.strip(), *found, line]
    return [*found, line + comment]


def safe(text: str) -> str:
    return text.replace("*/", "* /")
