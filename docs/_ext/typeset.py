"""Equations of a docstring, which are plain text there, as HTML with italics, subscripts and Greek letters.

An equation is written once, beside the code; this only sets it. What it does not know stays as it is written.
"""

from __future__ import annotations

import html
import re
from textwrap import dedent

NAMES = "alpha beta gamma delta epsilon zeta eta theta kappa lambda mu nu xi rho sigma tau phi psi omega pi"
GREEK = {
    **dict(zip(NAMES.split(), "αβγδεζηθκλμνξρστφψωπ", strict=True)),
    **{"Theta": "Θ", "Delta": "Δ", "Phi": "Φ", "Omega": "Ω", "eps": "ε"},
}
FUNCTIONS = set("exp ln log tanh sinh cosh sin cos tan sgn sign max min clip sqrt".split())
PROSE = set("at by for if in is of on or to up and the with where".split())
WORDS = re.compile(r"[A-Za-z][A-Za-z0-9]*(?:_[A-Za-z0-9]+)*")
CODE = re.compile(r"``?([^`]+)``?")
NUMBER = re.compile(r"(\([A-Z]?\d+[a-z]?\)(?:, \([A-Z]?\d+[a-z]?\))*)\s*$")


def docstring_html(text: str) -> str:
    """A docstring as HTML: paragraphs as text, indented blocks as equations."""
    parts = []
    for block in re.split(r"\n\s*\n", dedent(text).strip("\n")):
        if block.startswith("    "):
            parts.append(equations_html(dedent(block)))
        elif block.strip() != "::":
            words = html.escape(" ".join(block.replace("::", ":").split()))
            parts.append("<p>" + CODE.sub(r"<code>\1</code>", words) + "</p>")
    return "\n".join(parts)


def equations_html(block: str) -> str:
    """Lines of equations, their layout kept."""
    return f'<div class="equations"><pre>{chr(10).join(_line(line) for line in block.splitlines())}</pre></div>'


def _line(line: str) -> str:
    number = NUMBER.search(line)
    body = line[: number.start()] if number else line
    shown = WORDS.sub(lambda m: f"\x00{m.group(0)}\x01", body)
    shown = html.escape(shown).replace("-&gt;", "→").replace("&lt;-", "←").replace("&gt;=", "≥").replace("&lt;=", "≤")
    shown = re.sub(r"\x00([^\x01]*)\x01", lambda m: _symbol(m.group(1)), shown).replace("*", "·")
    return shown + (f'<span class="number">{number.group(1)}</span>' if number else "")


def _symbol(word: str) -> str:
    """A word of an equation: a function or prose as it is, ``dx_h`` as a differential, else a letter with its index."""
    head, *rest = word.split("_")
    stem = head.rstrip("0123456789")
    if stem[:1] == "d" and (stem[1:] in GREEK or len(stem) == 2):
        return f"d{_letter(head[1:], rest)}"
    if stem in FUNCTIONS | PROSE or (len(stem) > 3 and stem not in GREEK):
        return html.escape(word)
    return _letter(head, rest)


def _letter(head: str, rest: list[str]) -> str:
    stem = head.rstrip("0123456789")
    digits = head[len(stem) :]
    sub = ",".join(([digits] if digits else []) + [GREEK.get(r, r) for r in rest])
    return f"<i>{GREEK.get(stem, stem)}</i>" + (f"<sub>{sub}</sub>" if sub else "")
