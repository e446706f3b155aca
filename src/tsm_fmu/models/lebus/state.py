"""State of the LeBus transmission as plain numbers, and the loop of tendons that they describe."""

from typing import Annotated, NamedTuple

from ..contract import Quantity
from ..laws.capstan import Eight, Profile, Ten
from .loop import Loop, Wound
from .rig import Rig


class State(NamedTuple):
    theta_in: Annotated[float, Quantity("rad", "driver angle at the end of the last step")]
    theta_out: Annotated[float, Quantity("rad", "follower angle")]
    tau_load: Annotated[float, Quantity("N.m", "load torque of the last step")]
    way: Annotated[float, Quantity("1", "last direction of the driver, 0 before any")]
    stage: Annotated[float, Quantity("1", "stage of the last motion")]
    a_n: Annotated[float, Quantity("1", "segments of the tension profile of tendon a")]
    a_lam: Annotated[Eight, Quantity("1", "lam of its kinks, the last ones repeat the end")]
    a_T: Annotated[Ten, Quantity("N", "tension of tendon a at the driver, at its kinks and at the follower")]
    b_n: Annotated[float, Quantity("1", "segments of the tension profile of tendon b")]
    b_lam: Annotated[Eight, Quantity("1", "lam of its kinks, the last ones repeat the end")]
    b_T: Annotated[Ten, Quantity("N", "tension of tendon b at the driver, at its kinks and at the follower")]
    low: Annotated[float, Quantity("rad", "lowest follower angle so far")]
    high: Annotated[float, Quantity("rad", "highest follower angle so far")]
    a_below: Annotated[float, Quantity("N", "mean tension of what forward motion wound of a")]
    a_above: Annotated[float, Quantity("N", "mean tension of what backward motion wound of a")]
    b_below: Annotated[float, Quantity("N", "mean tension of what forward motion wound of b")]
    b_above: Annotated[float, Quantity("N", "mean tension of what backward motion wound of b")]
    x_a: Annotated[float, Quantity("m", "winding strain of tendon a")]
    x_b: Annotated[float, Quantity("m", "winding strain of tendon b")]


def loop_of(g: Rig, s: State) -> Loop:
    wound = Wound(s.low, s.high, s.a_below, s.a_above, s.b_below, s.b_above, s.x_a, s.x_b)
    a = Profile(int(s.a_n), (0.0, *s.a_lam, g.sheath.lam), s.a_T)
    b = Profile(int(s.b_n), (0.0, *s.b_lam, g.sheath.lam), s.b_T)
    return Loop(a, b, s.theta_in, s.theta_out, wound)


def state_of(loop: Loop, tau_load: float, way: float, stage: float) -> State:
    a = loop.a
    b = loop.b
    w = loop.wound
    return State(
        loop.theta_in, loop.theta_out, tau_load, way, stage,
        float(a.n), a.lam[1:-1], a.T, float(b.n), b.lam[1:-1], b.T,
        w.low, w.high, w.a_below, w.a_above, w.b_below, w.b_above, w.x_a, w.x_b,
    )  # fmt: skip
