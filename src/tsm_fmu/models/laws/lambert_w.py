"""Principal branch of the Lambert W function, w exp(w) = x, for real x >= -1/e.

Halley's iteration, from the branch-point series sqrt(2 (1 + e x)) near -1/e, from log(1 + x) below e,
from log(x) - log(log(x)) above (Corless et al., Adv. Comput. Math. 5 (1996), Sections 4 and 5). Relative error about
1e-15, except near the branch point W = -1, where W depends on x like a square root: there W is good to about 1e-8.
"""

import math


def lambert_w0(x: float) -> float:
    """W0(x); an argument below -1/e by rounding counts as -1/e.

    Parameters
    ----------
    x : float
        Finite, at least -1/e [1].
    """
    if x == 0.0:
        return 0.0
    near_branch = 1.0 + math.e * x
    if near_branch <= 0.0:
        return -1.0
    if x < -0.25:
        p = math.sqrt(2.0 * near_branch)
        w = -1.0 + p - p * p / 3.0 + 11.0 / 72.0 * p * p * p
    elif x < math.e:
        w = math.log1p(x)
    else:
        w = math.log(x) - math.log(math.log(x))
    for _ in range(20):
        f = w - x * math.exp(-w)
        slope = 1.0 + w
        if slope <= 1e-9:
            return w
        change = f / (slope - 0.5 * (1.0 + slope) * f / slope)
        w -= change
        if abs(change) <= 1e-15 * abs(w):
            break
    return w
