"""Normalised Bouc-Wen hysteresis: zeta after a travel in one direction.

MSSP 2015 Eq (6) with w frozen (IFToMM 2013 Eqs (2), (4) with rho = k/F_f)::

    dzeta/dt = rho (w - sigma |w| |zeta|^(n-1) zeta + (sigma - 1) w |zeta|^n)           (6)

Along travel q = rho int |w| dt of direction s, with y = s zeta::

    dy/dq = 1 - kappa |y|^n,    kappa = 1 for y >= 0,  -(2 sigma - 1) for y < 0         (6a)

so zeta depends on the path only, moves towards s and never past it: |zeta| <= max(1, |zeta0|) for
sigma >= 1/2, n >= 1. Travel is a hypergeometric function of y that has no elementary inverse except for n = 1 and 2.
For n = 1 (6a) is linear and solved exactly. Otherwise, on each side of 0:

* where |kappa| |y|^n is below `_NEAR` (near 0 it is not smooth): the series of travel over y and of its inverse, four
  terms each, up to `_LEAVE`::

    q = y sum (kappa |y|^n)^j/(1 + j n),    y = q sum c_j (kappa |q|^n)^j               (6b)

* elsewhere the Taylor series of y over q to order 5, which takes one power because each derivative of |y|^n over y
  is the one before it times a number over y. With g = dy/dq and g_j its j-th derivative over y, the derivatives of y
  over q are ::

    g,  g g_1,  g (g_1^2 + g g_2),  g (g_1^3 + 4 g g_1 g_2 + g^2 g_3),
    g (g_1^4 + 11 g g_1^2 g_2 + g^2 (4 g_2^2 + 7 g_1 g_3) + g^3 g_4)                    (6c)

  in sub-steps of at most `_SHARE` of the distance to 0 and `_RESOLUTION` of the local length 1/|g_1|, held on their
  side of 1 where the exact solution stays;
* where n |d| is below `_APPROACH`, d = 1 - y: the exponential approach with the first two terms of 1/(1 - (1 - d)^n),
  solved for d by one Newton step::

    log(d/d_0) + P(d) - P(d_0) = -n q,    P(d) = (n - 1)/2 d + (n^2 - 1)/24 d^2         (6d)

So the sub-steps of a step do not grow with n: at most 350 for sigma up to 2. Bounded for any step; error below
1e-7 max(1, |zeta0|) whatever the step (test).
"""

import math

_NEAR = 0.006
_LEAVE = 0.009
_APPROACH = 0.008
_MOST_PARTS = 100_000
_RESOLUTION = 0.0625
_SHARE = 0.2  # of the distance to 0, where the series has its singularity


def bouc_wen_after(zeta: float, travel: float, sigma: float, n: float) -> float:
    """State after ``travel`` = rho int w dt (signed, one direction), Eq (6).

    Parameters
    ----------
    zeta : float
        State before [1].
    travel : float
        rho w dt [1].
    sigma, n : float
        Shape; sigma >= 1/2 and n >= 1 [1].

    Raises
    ------
    ValueError
        If the state is beyond a million times its limit.
    """
    if travel == 0.0:
        return zeta
    if not abs(zeta) < 1e6:
        raise ValueError("Bouc-Wen state beyond 1e6 -- expected about 1 -- the friction level has all but vanished")
    s = math.copysign(1.0, travel)
    return s * _advanced(s * zeta, abs(travel), 2.0 * sigma - 1.0, n)


def _advanced(y: float, q: float, unload: float, n: float) -> float:
    """Solution of Eq (6a) after travel ``q``; ``unload`` is 2 sigma - 1."""
    if n == 1.0:
        return _advanced_linear(y, q, unload)
    parts = 0
    while q > 0.0:
        parts += 1
        if parts > _MOST_PARTS:
            raise ValueError("Bouc-Wen step of more than 100000 parts -- expected sigma and n near 1 -- lower them")
        if n * abs(1.0 - y) < _APPROACH:
            return 1.0 - _approached(1.0 - y, q, n)  # (6d)
        distance = abs(y)
        kappa = 1.0 if y > 0.0 else -unload
        power = distance**n
        if abs(kappa) * power <= _NEAR:
            before = _travel_from_zero(y, unload, n)
            h = _travel_from_zero(_LEAVE ** (1.0 / n), unload, n) - before
            h = q if q < h else h
            y = _from_zero(before + h, unload, n)  # (6b)
        else:
            g, g1 = 1.0 - kappa * power, -n * kappa * power / y  # (6a)
            # comparisons, as calls of min and max would take a tenth of an FMU's step
            steepness = abs(kappa) * (power / distance if power > distance else 1.0)
            longest = _RESOLUTION / (n * steepness if steepness > 1.0 else n)
            reach = _SHARE * distance if y > 0.0 else _SHARE * distance / g
            h = reach if reach < longest else longest
            h = q if q < h else h
            after = y + h * g * _mean_slope(h, g, g1, 1.0 / y, n)
            if not abs(after) < 1e300:
                raise ValueError("Bouc-Wen step overflows -- expected sigma and n near 1 -- lower them")
            y = 1.0 if (after < 1.0) == (y > 1.0) else after  # held on its side of 1
        q -= h
    return y


def _approached(d: float, q: float, n: float) -> float:
    """Distance to 1 after travel ``q`` from a small one, Eq (6d)."""
    p1, p2 = 0.5 * (n - 1.0), (n * n - 1.0) / 24.0
    first = d * math.exp(-n * q)
    short = d * (p1 + p2 * d) - first * (p1 + p2 * first)
    return d * math.exp(short / (1.0 + first * (p1 + 2.0 * p2 * first)) - n * q)


def _mean_slope(h: float, g: float, g1: float, inverse: float, n: float) -> float:
    """Mean of dy/dq over a sub-step, over its value at the start, Eq (6c); ``inverse`` is 1/y."""
    g2 = (n - 1.0) * g1 * inverse
    g3 = (n - 2.0) * g2 * inverse
    g4 = (n - 3.0) * g3 * inverse
    square = g1 * g1
    fourth = g1 * square + g * (4.0 * g1 * g2 + g * g3)
    fifth = square * square + g * (11.0 * square * g2 + g * (4.0 * g2 * g2 + 7.0 * g1 * g3 + g * g4))
    return 1.0 + 0.5 * h * (g1 + h / 3.0 * (square + g * g2 + 0.25 * h * (fourth + 0.2 * h * fifth)))


def _advanced_linear(y: float, q: float, unload: float) -> float:
    """Exact solution of Eq (6a) for n = 1."""
    if y >= 0.0:
        return 1.0 + (y - 1.0) * math.exp(-q)
    to_zero = -y if unload == 0.0 else math.log1p(-unload * y) / unload
    if q >= to_zero:
        return -math.expm1(to_zero - q)
    if unload == 0.0:
        return y + q
    return y * math.exp(-unload * q) - math.expm1(-unload * q) / unload


def _travel_from_zero(y: float, unload: float, n: float) -> float:
    """Signed travel from 0 to a small ``y``, Eq (6b)."""
    t = (1.0 if y > 0.0 else -unload) * abs(y) ** n
    return y * (1.0 + t * (1.0 / (1.0 + n) + t * (1.0 / (1.0 + 2.0 * n) + t / (1.0 + 3.0 * n))))


def _from_zero(q: float, unload: float, n: float) -> float:
    """Inverse of `_travel_from_zero`, Eq (6b); its c_j follow from putting the series into Eq (6a)."""
    t = (1.0 if q > 0.0 else -unload) * abs(q) ** n
    c1 = -1.0 / (1.0 + n)
    c2 = -n * c1 / (1.0 + 2.0 * n)
    c3 = -(n * c2 + 0.5 * n * (n - 1.0) * c1 * c1) / (1.0 + 3.0 * n)
    return q * (1.0 + t * (c1 + t * (c2 + t * c3)))
