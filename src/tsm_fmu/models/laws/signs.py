"""Sign rules that several friction models share."""


def sign(value: float) -> float:
    """Sign of a number, 0 at 0."""
    if value > 0.0:
        return 1.0
    if value < 0.0:
        return -1.0
    return 0.0


def held_sign(value: float, last: float) -> float:
    """Sign of a number; at 0 the ``last`` one, so that a sample on the switch keeps its branch."""
    if value == 0.0:
        return last
    return sign(value)
