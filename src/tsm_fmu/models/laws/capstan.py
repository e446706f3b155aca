"""A tendon in a bent sheath with Coulomb friction: the exact tension profile for any history of its two ends.

Jia et al., Adv. Mech. Eng. 2020, Eqs (14)-(21), corrected::

    dT/T = -mu sgn(xi) dl/R                                  printed dtheta/T = mu dl/R            (15)
    T(l) = T(0) exp(-lam(l) sgn(xi)),  lam(l) = int mu/R dl                                    (16)-(19)
    delta = int_0^L T(l)/EA dl                               lam under the integral runs with l    (21)

Where the tendon does not slide, |dT/T| <= mu dl/R keeps what its history left. With ``way`` = +1 for sliding towards
the driver (l = 0) and -1 towards the follower, W = T exp(way lam) never falls (way +1) or never rises (way -1) along
the tendon. Moving the ends by monotone travels therefore gives, exactly and whatever the step::

    W_new = W_old, cut off at the level ``near`` on the driver's side and ``far`` on the follower's side     (F)
    EA travel = int way (T_new - T_old) dl over the driver's cut, minus the same over the follower's         (T)
    near and far meet: the whole tendon slides, W is constant and EA delta = int T dl fixes it                (S)

The edges of the cuts are the moving reversal fronts. What a cut covers is forgotten: return-point memory. The profile
is the list of its kinks; `CAPACITY` kinks are kept between the ends. A history that needs more loses its smallest
fold: two neighbouring kinks at a distance dlam are replaced by their chord, a relative change of tension below
exp(2 dlam) - 1. The profile's stretch is then off by as much, until the tendon next slides along its whole length.
"""

import math
from typing import NamedTuple

CLOSE = 1e-15  # relative: rounding of the work moves a level by as much
CAPACITY = 8
END = CAPACITY + 1  # index of the last point when the memory is full

Eight = tuple[float, float, float, float, float, float, float, float]
Ten = tuple[float, float, float, float, float, float, float, float, float, float]


class Sheath(NamedTuple):
    """Pieces of the path from the driver: number, lengths [m], mu/R [1/m] (0: straight), total lam [1]."""

    n: int
    length: Eight
    rate: Eight
    lam: float


class Profile(NamedTuple):
    """Tension over lam: ``n`` + 1 points from driver to follower, exponential between them, the last one repeated."""

    n: int
    lam: Ten
    T: Ten


def sheath_of(mu: float, n_seg: int, length: Eight, radius: Eight) -> Sheath:
    """Sheath from friction coefficient, piece lengths [m] and bending radii [m] (0: straight)."""
    rate = (
        _rate(mu, radius[0]),
        _rate(mu, radius[1]),
        _rate(mu, radius[2]),
        _rate(mu, radius[3]),
        _rate(mu, radius[4]),
        _rate(mu, radius[5]),
        _rate(mu, radius[6]),
        _rate(mu, radius[7]),
    )
    lam = 0.0
    for i in range(n_seg):
        lam += rate[i] * length[i]
    return Sheath(n_seg, length, rate, lam)


def _rate(mu: float, radius: float) -> float:
    return mu / radius if radius > 0.0 else 0.0


def path_length(sheath: Sheath) -> float:
    """Length L of the path [m]."""
    total = 0.0
    for i in range(sheath.n):
        total += sheath.length[i]
    return total


def tension_integral(sheath: Sheath, a: float, b: float, T_a: float, slope: float) -> float:
    """Integrate T dl [N m] from lam = ``a`` to ``b`` for T = T_a exp(slope (lam - a)), Eq (21).

    A straight piece lies at one lam; it counts if that is in [a, b), or at ``b`` if the path ends there.
    """
    total = 0.0
    at = 0.0
    for i in range(sheath.n):
        rate = sheath.rate[i]
        if rate == 0.0:
            if a <= at and (at < b or (at == b and b >= sheath.lam)):
                total += T_a * math.exp(slope * (at - a)) * sheath.length[i]
        else:
            end = at + rate * sheath.length[i]
            lo = max(a, at)
            hi = min(b, end)
            if hi > lo:
                x = slope * (hi - lo)
                mean = math.expm1(x) / x if x != 0.0 else 1.0
                total += T_a * math.exp(slope * (lo - a)) * mean * (hi - lo) / rate
            at = end
    return total


def uniform_profile(sheath: Sheath, T: float) -> Profile:
    """The same tension everywhere."""
    return line_profile(sheath, T, 0.0)


def line_profile(sheath: Sheath, T_e: float, way: float) -> Profile:
    """Sliding along the whole length with tension ``T_e`` at the follower, Eqs (16)-(19)."""
    e = sheath.lam
    T_0 = T_e * math.exp(way * e)
    return Profile(1, (0.0, e, e, e, e, e, e, e, e, e), (T_0, T_e, T_e, T_e, T_e, T_e, T_e, T_e, T_e, T_e))


def stretched(sheath: Sheath, profile: Profile) -> float:
    """Integral of T dl [N m] over a profile."""
    if profile.T[0] == 0.0:
        return 0.0
    total = 0.0
    for k in range(profile.n):
        a = profile.lam[k]
        b = profile.lam[k + 1]
        total += tension_integral(sheath, a, b, profile.T[k], _slope(a, b, profile.T[k], profile.T[k + 1]))
    return total


def _slope(a: float, b: float, T_a: float, T_b: float) -> float:
    return math.log(T_b / T_a) / (b - a) if b > a else 0.0


def end_levels(profile: Profile, way: float) -> tuple[float, float]:
    """W at the driver and at the follower."""
    n = profile.n
    return profile.T[0], profile.T[n] * math.exp(way * profile.lam[n])


def cut_work(sheath: Sheath, profile: Profile, way: float, side: float, level: float) -> tuple[float, float]:
    """EA times the end's travel [N m] for a cut at ``level``, Eq (T), and its rate with the level.

    Parameters
    ----------
    sheath : Sheath
    profile : Profile
        Tension before.
    way : float
        +1: the tendon slides towards the driver, -1: towards the follower.
    side : float
        +1: the cut lies on the driver's side, -1: on the follower's.
    level : float
        W of the cut [N].
    """
    sign = side * way
    work = 0.0
    reach = 0.0
    W_b = profile.T[0]
    in_b = sign * (level - W_b)
    for k in range(profile.n):
        a = profile.lam[k]
        b = profile.lam[k + 1]
        W_a = W_b
        in_a = in_b
        W_b = profile.T[k + 1] * math.exp(way * b)
        in_b = sign * (level - W_b)
        if in_a <= 0.0 and in_b <= 0.0:
            continue
        slope = _slope(a, b, profile.T[k], profile.T[k + 1])
        lo = a
        hi = b
        if in_a < 0.0:
            lo = a + (b - a) * math.log(level / W_a) / math.log(W_b / W_a)
        if in_b < 0.0:
            hi = a + (b - a) * math.log(level / W_a) / math.log(W_b / W_a)
        share = tension_integral(sheath, lo, hi, math.exp(-way * lo), -way)
        before = tension_integral(sheath, lo, hi, profile.T[k] * math.exp(slope * (lo - a)), slope)
        work += sign * (level * share - before)
        reach += share
    return work, sign * reach


def cut_level(sheath: Sheath, profile: Profile, way: float, side: float, work: float) -> tuple[float, bool]:
    """Level of the cut that moves its end by work/EA, and whether it covers the whole tendon.

    Newton's method on the square root of the work, which starts with the square of the level, kept in a bracket.
    """
    driver, follower = end_levels(profile, way)
    first = driver if side > 0.0 else follower
    last = follower if side > 0.0 else driver
    if work <= 0.0:
        return first, False
    most, _ = cut_work(sheath, profile, way, side, last)
    if work >= most:
        return last, True
    lo = first
    hi = last
    level = first + (last - first) * math.sqrt(work / most)
    for _ in range(200):
        done, rate = cut_work(sheath, profile, way, side, level)
        if done > work:
            hi = level
        else:
            lo = level
        following = 0.5 * (lo + hi)
        if done > 0.0 and rate != 0.0:
            newton = level - 2.0 * (done - math.sqrt(done * work)) / rate
            if min(lo, hi) < newton < max(lo, hi):
                following = newton
        if abs(following - level) <= CLOSE * abs(level):
            break
        level = following
    return level, False


def cut_profile(sheath: Sheath, profile: Profile, way: float, near: float, far: float) -> Profile:
    """Profile after cuts at the levels ``near`` (driver's side) and ``far`` (follower's side), Eq (F)."""
    old_near, old_far = end_levels(profile, way)
    cut_near = way * (near - old_near) > 0.0
    cut_far = way * (old_far - far) > 0.0
    same = 1e-13 * max(near, far)  # levels that rounding alone tells apart: a front back where it began is gone
    first = 0  # first and last old segment that keep a part
    last = profile.n - 1
    for k in range(1, profile.n):
        W = profile.T[k] * math.exp(way * profile.lam[k])
        if cut_near and way * (W - near) <= same:
            first = k
    for k in range(profile.n - 1, first, -1):
        W = profile.T[k] * math.exp(way * profile.lam[k])
        if cut_far and way * (far - W) <= same:
            last = k - 1
    at_near = _crossing(profile, way, first, near, same) if cut_near else 0.0
    at_far = _crossing(profile, way, last, far, -same) if cut_far else sheath.lam
    # a front on the very end would count a straight piece there twice
    fronts_near = 1 if 0.0 < at_near < sheath.lam else 0
    fronts_far = 1 if 0.0 < at_far < sheath.lam else 0
    T_0 = near if cut_near else profile.T[0]
    T_e = far * math.exp(-way * sheath.lam) if cut_far else profile.T[profile.n]
    kept = max(last - first, 0)
    inner = fronts_near + kept + fronts_far
    drop = -9
    if inner > CAPACITY:  # at most two too many: both kinks of the smallest fold go
        drop = _smallest_fold(profile, first, kept, fronts_near, fronts_far, at_near, at_far)
        inner -= 2
    shift = first + 1 - fronts_near  # old index of new point 1 + its own front
    head = (sheath.lam, T_0, T_e, near, far, at_near, at_far, way)
    q1 = _point(profile, head, 1, drop, shift, fronts_near, kept, inner)
    q2 = _point(profile, head, 2, drop, shift, fronts_near, kept, inner)
    q3 = _point(profile, head, 3, drop, shift, fronts_near, kept, inner)
    q4 = _point(profile, head, 4, drop, shift, fronts_near, kept, inner)
    q5 = _point(profile, head, 5, drop, shift, fronts_near, kept, inner)
    q6 = _point(profile, head, 6, drop, shift, fronts_near, kept, inner)
    q7 = _point(profile, head, 7, drop, shift, fronts_near, kept, inner)
    q8 = _point(profile, head, 8, drop, shift, fronts_near, kept, inner)
    return Profile(
        inner + 1,
        (0.0, q1[0], q2[0], q3[0], q4[0], q5[0], q6[0], q7[0], q8[0], sheath.lam),
        (T_0, q1[1], q2[1], q3[1], q4[1], q5[1], q6[1], q7[1], q8[1], T_e),
    )


def _crossing(profile: Profile, way: float, k: int, level: float, same: float) -> float:
    """Place (lam) where W passes ``level`` in segment ``k``; at a tie its end (``same`` > 0) or its start (< 0)."""
    a = profile.lam[k]
    b = profile.lam[k + 1]
    W_a = profile.T[k] * math.exp(way * a)
    W_b = profile.T[k + 1] * math.exp(way * b)
    if way * (W_b - level) <= same:
        return b
    if way * (level - W_a) <= -same:
        return a
    return a + (b - a) * math.log(level / W_a) / math.log(W_b / W_a)


def _point(
    profile: Profile,
    head: tuple[float, float, float, float, float, float, float, float],
    k: int,
    drop: int,
    shift: int,
    fronts_near: int,
    kept: int,
    inner: int,
) -> tuple[float, float]:
    """(lam, T) of inner point ``k`` of the new profile; points past the last inner one repeat the end."""
    lam, _, T_e, near, far, at_near, at_far, way = head
    if k > inner:
        return lam, T_e
    if k >= drop and drop > 0:
        k += 2
    if k == 1 and fronts_near == 1:
        return at_near, near * math.exp(-way * at_near)
    if k > fronts_near + kept:
        return at_far, far * math.exp(-way * at_far)
    return profile.lam[k - 1 + shift], profile.T[k - 1 + shift]


def _smallest_fold(
    profile: Profile, first: int, kept: int, fronts_near: int, fronts_far: int, at_near: float, at_far: float
) -> int:
    """Number of the first of the two neighbouring inner points that lie closest."""
    best = 1
    least = math.inf
    inner = fronts_near + kept + fronts_far
    shift = first + 1 - fronts_near
    previous = 0.0
    for k in range(1, inner + 1):
        at = at_far
        if k == 1 and fronts_near == 1:
            at = at_near
        elif k <= fronts_near + kept:
            at = profile.lam[k - 1 + shift]
        if k > 1 and at - previous < least:
            least = at - previous
            best = k - 1
        previous = at
    return best
