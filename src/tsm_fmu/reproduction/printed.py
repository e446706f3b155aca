"""Numbers as they stand in print: a text, and the interval of values that would have been printed like that."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction

import numpy as np
from scipy.stats import t as student

from .verdict import Span

_NUMBER = re.compile(r"[-+]?(?:\d+\.\d*|\.\d+|\d+/\d+|\d+)")


@dataclass(frozen=True)
class Printed:
    """A number or a range of numbers of a paper.

    Attributes
    ----------
    text : str
        As printed, word for word: ``10.5``, ``around 3``, ``1.14-1.24``.
    span : Span
        Every value that is printed like this, in ``unit``.
    unit : str
        Of the print.
    where : str
        Figure, table, equation or section.
    """

    text: str
    span: Span
    unit: str
    where: str


def printed(text: str, unit: str, where: str) -> Printed:
    """A printed number and what rounds to it: half a unit of its last digit either way.

    ``around 3`` is a 3 rounded to whole numbers, ``2/3`` a fraction rounded to thirds. A range ``a to b`` reaches
    from the lower end of a to the upper end of b.

    Raises
    ------
    ValueError
        No number in ``text``, or more than two.
    """
    low, _, high = text.partition(" to ")
    ends = [_rounding(part, text) for part in ((low, high) if high else (low,))]
    return Printed(text, Span.of(*(value for end in ends for value in end)), unit, where)


def trials(values: tuple[str, ...], unit: str, where: str) -> Printed:
    """Repeated measurements of one number, printed one by one; the span is where one more of them would be.

    That is the 95 % prediction interval of normal scatter, mean +- t s sqrt(1 + 1/n): of five trials and one more, the
    one more lies outside lowest and highest in one case of three.
    """
    found = sorted(values, key=float)
    numbers = np.array([float(v) for v in values])
    n = numbers.size
    reach = float(student.ppf(0.975, n - 1) * np.std(numbers, ddof=1) * math.sqrt(1.0 + 1.0 / n))
    mean = float(np.mean(numbers))
    return Printed(f"{found[0]} to {found[-1]}", Span(mean - reach, mean + reach), unit, where)


def last_digit(numbers: Iterable[float]) -> float:
    """Unit of the last decimal place that any of the numbers has, as they are printed."""
    places = [-int(Decimal(repr(number)).normalize().as_tuple().exponent) for number in numbers]
    return 10.0 ** -max(0, *places)


def value(text: str) -> float:
    """The number in a print."""
    found = _NUMBER.findall(text)
    if len(found) != 1:
        raise ValueError(f"print {text!r} -- expected one number")
    return float(Fraction(found[0]))


def _rounding(part: str, text: str) -> tuple[float, float]:
    found = _NUMBER.findall(part)
    if len(found) != 1:
        raise ValueError(f"print {text!r} -- expected one number, or two with ' to ' between them")
    number = found[0]
    fraction = number.partition("/")[2]
    half = 0.5 / int(fraction) if fraction else 0.5 * 10.0 ** -len(number.partition(".")[2])
    at = float(Fraction(number))
    return at - half, at + half
