"""Units put together from others, written as people and FMI write them."""

INERTIAS = {"N.s2/m": "kg", "N.m.s2/rad": "kg.m2"}
"""Force per acceleration and torque per angular acceleration."""


def simplified(unit: str) -> str:
    """A unit as FMI writes it, with one fraction at most: ``N.m/(rad/s)`` is ``N.m.s/rad``,
    ``N/(N)`` is ``1``, and a force per acceleration a mass.
    """
    powers = _powers(unit)
    above = [_factor(symbol, power) for symbol, power in powers.items() if power > 0]
    below = [_factor(symbol, -power) for symbol, power in powers.items() if power < 0]
    under = f"({'.'.join(below)})" if len(below) > 1 else "".join(below)
    text = (".".join(above) or "1") + (f"/{under}" if under else "")
    return INERTIAS.get(text, text)


def _powers(unit: str) -> dict[str, int]:
    """Exponents of the symbols in a unit, in the order of the text."""
    powers: dict[str, int] = {}
    outside, sign, factor = [1], 1, ""
    for char in unit + ".":
        if char not in "./()":
            factor += char
            continue
        symbol = factor.rstrip("0123456789")
        if symbol:
            powers[symbol] = powers.get(symbol, 0) + sign * int(factor[len(symbol) :] or "1")
        factor = ""
        if char == "(":
            outside.append(sign)
        elif char == ")" and len(outside) > 1:
            outside.pop()
        sign = -outside[-1] if char == "/" else outside[-1]
    return powers


def _factor(symbol: str, power: int) -> str:
    return symbol if power == 1 else f"{symbol}{power}"
