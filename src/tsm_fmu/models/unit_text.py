"""Units put together from others, written as people and FMI write them."""

INERTIAS = {"N.s2/m": "kg", "N.m.s2/rad": "kg.m2"}
"""Force per acceleration and torque per angular acceleration."""


def simplified(unit: str) -> str:
    """A unit as FMI writes it, with one fraction at most: ``N.m/(rad/s)`` is ``N.m.s/rad``,
    ``N/(N)`` is ``1``, ``N/(m/s)2`` is ``N.s2/m2``, and a force per acceleration a mass.
    """
    text = written(_product([")", *reversed(_tokens(unit))]))
    return INERTIAS.get(text, text)


def written(powers: dict[str, float]) -> str:
    """The text of a product of symbols, in the order given: ``{"N": 1, "m": 1, "rad": -3}`` is ``N.m/rad3``."""
    above = [_factor(symbol, power) for symbol, power in powers.items() if power > 0]
    below = [_factor(symbol, -power) for symbol, power in powers.items() if power < 0]
    under = f"({'.'.join(below)})" if len(below) > 1 else "".join(below)
    return (".".join(above) or "1") + (f"/{under}" if under else "")


def _tokens(unit: str) -> list[str]:
    """Symbols, exponents and signs. No regular expressions: this file goes into FMUs, which load little."""
    found = [""]
    for k, c in enumerate(unit):
        number = found[-1].isdigit()
        decimal = c == "." and number and unit[k + 1 : k + 2].isdigit()
        if decimal or (c.isdigit() and found[-1][:1].isdigit()):
            found[-1] += c  # more of an exponent
        elif c.isspace():
            found.append("")
        elif c.isdigit() or c in "./()" or not found[-1] or found[-1] in "./()" or found[-1][0].isdigit():
            found.append(c)
        else:
            found[-1] += c
    return [token for token in found if token]


def _product(tokens: list[str]) -> dict[str, float]:
    """Exponents of the symbols up to the closing parenthesis; the tokens are a stack, the next one at its end."""
    powers: dict[str, float] = {}
    last: dict[str, float] = {}
    sign = 1.0

    def take(exponent: float) -> None:
        for symbol, power in last.items():
            powers[symbol] = powers.get(symbol, 0.0) + sign * exponent * power
        last.clear()

    while tokens:
        token = tokens.pop()
        if token[0].isdigit():
            take(float(token))
            continue
        take(1.0)
        if token == ")":
            break
        if token in "./":
            sign = -1.0 if token == "/" else 1.0
        else:
            last = _product(tokens) if token == "(" else {token: 1.0}
    return powers


def _factor(symbol: str, power: float) -> str:
    return symbol if power == 1.0 else f"{symbol}{power:g}"
