"""Generated C: the text of a line survives its wrapping, and strings theirs."""

import json
import random
import re

import pytest

from tsm_fmu.fmu.native.text import WIDTH, quoted, safe, wrapped


def expression(rng: random.Random, terms: int) -> str:
    """A sum of calls and products, as kernels make them."""
    parts = []
    for _ in range(terms):
        a, b = (f"p->{rng.choice(['sigma0', 'T_c', 'kappa'])}[{rng.randrange(9)}]" for _ in range(2))
        parts.append(rng.choice([f"{a} * {b}", f"fmax({a}, {b})", f"({a} > 0.0 && {b} < 1.0 ? {a} : {b})"]))
    return " + ".join(parts)


@pytest.mark.parametrize("seed", range(12))
def test_a_wrapped_line_is_the_same_code_in_readable_width(seed):
    rng = random.Random(seed)
    indent = "    " * rng.randrange(4)
    line = f"{indent}double y = {expression(rng, rng.randrange(1, 15))};"
    pieces = wrapped(line)
    assert "".join(" ".join(pieces).split()) == "".join(line.split())
    assert all(len(piece) <= WIDTH for piece in pieces)
    assert (len(pieces) == 1) == (len(line) <= WIDTH)
    assert pieces[0].startswith(indent)
    for piece in pieces[1:]:
        assert piece.startswith(indent + " " * 8)


def test_a_string_is_not_cut_and_a_line_without_a_place_stays():
    text = "a + b, c * d " * 20
    line = f"    fail(unit, {quoted(text)}, 3.0 + 4.0);"
    pieces = wrapped(line)
    assert any(quoted(text) in piece for piece in pieces)
    assert wrapped("x" * 200) == ["x" * 200]


@pytest.mark.parametrize(("first", "broken"), [(21, False), (22, True)])
def test_a_line_is_not_broken_in_its_first_twenty_letters(first: int, broken: bool):
    line = "    " + "f" * (first - 3) + ", " + "x" * 120
    assert len(wrapped(line)) == (2 if broken else 1)


def test_a_comment_stands_behind_its_line_or_above_it():
    assert wrapped("    y = 1.0;", "  /* Eq (3) */") == ["    y = 1.0;  /* Eq (3) */"]
    line = "    y = " + "a" * 100 + ";"
    assert wrapped(line, "  /* the long-run mean, Eq (3) */") == ["    /* the long-run mean, Eq (3) */", line]


@pytest.mark.parametrize("text", ['say "no"', "C:\\temp", "two\nlines", "plain"])
def test_a_quoted_text_is_that_text(text):
    assert json.loads(quoted(text)) == text  # JSON escapes these as C does


def test_a_comment_cannot_end_early():
    assert "*/" not in safe("lam */ mu")
    assert re.sub(" ", "", safe("lam */ mu")) == "lam*/mu"
