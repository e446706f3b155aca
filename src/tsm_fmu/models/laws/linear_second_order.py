"""A linear second-order system with constant input: exact response and first sign change.

Every linear function h of its state obeys, with the same a_1 and a_0::

    h'' + a_1 h' + a_0 h = a_0 h_inf                                                    (L1)
    h(t) = h_0 + h'_0 E(t) + (h''_0 + a_1 h'_0) G(t)                                    (L2)
    E(t) = (exp(q_1 t) - exp(q_2 t))/(q_1 - q_2),   G(t) = integral of E from 0 to t    (L3)
    q_1,2 = -a_1/2 +- sqrt(a_1^2/4 - a_0)                                               (L4)

E is the response of a unit slope (sin and exp for complex poles, t exp(q t) for a double one), and
G = (1 - E' - a_1 E)/a_0. Stable systems only: a_0 > 0 and a_1 >= 0.
"""

import math

MOST_NEWTON = 60  # points before only bisection is left; the ordinary case needs five
ROUNDING = 1e-15  # a value of this part of its terms, or less, is zero


def slope_response(a_1: float, a_0: float, t: float) -> tuple[float, float]:
    """E(t) and its integral G(t), Eq (L3), without cancellation at small or large t.

    Parameters
    ----------
    a_1, a_0 : float
        Coefficients of Eq (L1) [1/s, 1/s2].
    t : float
        Time, 0 or more [s].
    """
    if a_1 * t < 0.25 and a_0 * t * t < 0.0625:
        # Taylor series: t^k coefficients from (L1); the closed form of G loses digits here
        coefficient, before, e, g = t, 0.0, t, 0.5 * t * t
        for k in range(2, 14):
            following = -(a_1 * t * coefficient / k + a_0 * t * t * before / (k * (k - 1.0)))
            before, coefficient = coefficient, following
            e += coefficient
            g += coefficient * t / (k + 1.0)
        return e, g
    middle, square = -0.5 * a_1, 0.25 * a_1 * a_1 - a_0
    if square > 0.0:
        d = math.sqrt(square)
        fast = middle - d  # (L4); the slow pole from the product, where the sum would cancel
        slow = a_0 / fast
        e = -math.exp(slow * t) * math.expm1(-2.0 * d * t) / (2.0 * d)
        if d > 0.05 * a_1:  # poles apart: the form below would lose the digits of G when a_0 << a_1^2
            return e, (math.expm1(slow * t) / slow - math.expm1(fast * t) / fast) / (2.0 * d)
        rate = slow * e + math.exp(fast * t)  # E'
    elif square < 0.0:
        w = math.sqrt(-square)
        decay = math.exp(middle * t)
        e = decay * math.sin(w * t) / w
        rate = decay * math.cos(w * t) + middle * e
    else:
        decay = math.exp(middle * t)
        e = t * decay
        rate = decay + middle * e
    return e, (1.0 - rate - a_1 * e) / a_0


def response(h: float, dh: float, ddh: float, a_1: float, a_0: float, t: float) -> float:
    """h(t) from its value and first two derivatives at 0, Eq (L2)."""
    e, g = slope_response(a_1, a_0, t)
    return h + dh * e + (ddh + a_1 * dh) * g


def first_extremum(dh: float, ddh: float, a_1: float, a_0: float) -> float:
    """First t > 0 with h'(t) = 0; infinity if there is none. Closed form from h'' + a_1 h' + ... = 0."""
    lean = ddh + 0.5 * a_1 * dh
    square = 0.25 * a_1 * a_1 - a_0
    if square < 0.0:  # dh cos(w t) + lean/w sin(w t) = 0
        w = math.sqrt(-square)
        if dh == 0.0:
            return math.pi / w if lean != 0.0 else math.inf
        angle = math.atan2(dh, -lean / w)
        return (angle if angle > 0.0 else angle + math.pi) / w
    if dh == 0.0 or dh * lean >= 0.0:
        return math.inf
    ratio = -dh / lean  # tanh(d t)/d = ratio
    d = math.sqrt(square)
    if d * ratio >= 1.0:
        return math.inf
    return math.atanh(d * ratio) / d if d > 0.0 else ratio


def first_fall_below_zero(
    h: float, dh: float, ddh: float, a_1: float, a_0: float, t_end: float, e_end: float, g_end: float
) -> float:
    """First time in [0, t_end] at which h, not negative before, falls through zero; infinity if it does not.

    ``e_end`` and ``g_end`` are E and G at ``t_end``: a caller who asks for several h of one system has them already.

    h is monotone between its extrema, whose times are known in closed form, and the first falling stretch
    reaches the lowest value of all; so one bracket holds the only crossing there can be. A value
    below zero by rounding at t = 0 counts as zero while h rises.
    """
    lean = ddh + a_1 * dh
    # |E| <= t, and <= 1/a_1: its rate is below exp(-a_1 t) up to its maximum, and later maxima are lower
    longest, half = (t_end, 0.5) if a_1 * t_end < 1.0 else (1.0 / a_1, 1.0)
    if h > (abs(dh) + half * abs(lean) * t_end) * longest:
        return math.inf  # too far away to get there
    turn = first_extremum(dh, ddh, a_1, a_0)
    falls = dh < 0.0 or (dh == 0.0 and ddh < 0.0)
    left, right = 0.0, min(turn, t_end)
    if not falls:
        if turn >= t_end:
            return math.inf
        left, right = turn, t_end
        square = 0.25 * a_1 * a_1 - a_0
        if square < 0.0:
            right = min(right, turn + math.pi / math.sqrt(-square))
    lowest = h + dh * e_end + lean * g_end if right == t_end else response(h, dh, ddh, a_1, a_0, right)
    if lowest >= 0.0:
        return math.inf
    return _crossing(h, dh, lean, a_1, a_0, left, right)


def _crossing(h: float, dh: float, lean: float, a_1: float, a_0: float, left: float, right: float) -> float:
    """Where h falls through zero between ``left`` and ``right``.

    Newton's method on (L2), kept in a bracket: the middle is tried instead where Newton's next point is outside or
    its step more than half the last one, and always after `MOST_NEWTON` points. So it never takes many more points
    than bisection.
    """
    t, last = left, 2.0 * (right - left)
    tried = 0
    while True:
        e, g = slope_response(a_1, a_0, t)
        value = h + dh * e + lean * g
        if abs(value) <= ROUNDING * (abs(h) + abs(dh * e) + abs(lean * g)) or (tried == 0 and value < 0.0):
            return t
        if value < 0.0:
            right = t
        else:
            left = t
        middle = 0.5 * (left + right)
        if not left < middle < right:
            return right
        slope = dh * (1.0 - a_1 * e - a_0 * g) + lean * e
        ahead = -value / slope if slope < 0.0 and tried < MOST_NEWTON else math.inf
        if 2.0 * abs(ahead) > last or not left < t + ahead < right:
            ahead = middle - t
        t, last = t + ahead, abs(ahead)
        tried += 1
