"""State of the LeBus transmission as plain numbers, and the loop of tendons that they describe."""

from typing import Annotated, NamedTuple

from ..contract import Quantity
from ..laws.capstan import Profile
from .loop import Loop, Wound
from .rig import Rig


class State(NamedTuple):
    theta_in: Annotated[float, Quantity("rad", "driver angle at the end of the last step")]
    theta_out: Annotated[float, Quantity("rad", "follower angle")]
    tau_load: Annotated[float, Quantity("N.m", "load torque of the last step")]
    way: Annotated[float, Quantity("1", "last direction of the driver, 0 before any")]
    stage: Annotated[float, Quantity("1", "stage of the last motion")]
    a_n: Annotated[float, Quantity("1", "segments of the tension profile of tendon a")]
    a_lam_1: Annotated[float, Quantity("1", "lam of its kinks, the last ones repeat the end")]
    a_lam_2: Annotated[float, Quantity("1", "as a_lam_1")]
    a_lam_3: Annotated[float, Quantity("1", "as a_lam_1")]
    a_lam_4: Annotated[float, Quantity("1", "as a_lam_1")]
    a_lam_5: Annotated[float, Quantity("1", "as a_lam_1")]
    a_lam_6: Annotated[float, Quantity("1", "as a_lam_1")]
    a_lam_7: Annotated[float, Quantity("1", "as a_lam_1")]
    a_lam_8: Annotated[float, Quantity("1", "as a_lam_1")]
    a_T_0: Annotated[float, Quantity("N", "tension of tendon a at the driver")]
    a_T_1: Annotated[float, Quantity("N", "tension at its kinks")]
    a_T_2: Annotated[float, Quantity("N", "as a_T_1")]
    a_T_3: Annotated[float, Quantity("N", "as a_T_1")]
    a_T_4: Annotated[float, Quantity("N", "as a_T_1")]
    a_T_5: Annotated[float, Quantity("N", "as a_T_1")]
    a_T_6: Annotated[float, Quantity("N", "as a_T_1")]
    a_T_7: Annotated[float, Quantity("N", "as a_T_1")]
    a_T_8: Annotated[float, Quantity("N", "as a_T_1")]
    a_T_e: Annotated[float, Quantity("N", "tension of tendon a at the follower")]
    b_n: Annotated[float, Quantity("1", "segments of the tension profile of tendon b")]
    b_lam_1: Annotated[float, Quantity("1", "lam of its kinks, the last ones repeat the end")]
    b_lam_2: Annotated[float, Quantity("1", "as b_lam_1")]
    b_lam_3: Annotated[float, Quantity("1", "as b_lam_1")]
    b_lam_4: Annotated[float, Quantity("1", "as b_lam_1")]
    b_lam_5: Annotated[float, Quantity("1", "as b_lam_1")]
    b_lam_6: Annotated[float, Quantity("1", "as b_lam_1")]
    b_lam_7: Annotated[float, Quantity("1", "as b_lam_1")]
    b_lam_8: Annotated[float, Quantity("1", "as b_lam_1")]
    b_T_0: Annotated[float, Quantity("N", "tension of tendon b at the driver")]
    b_T_1: Annotated[float, Quantity("N", "tension at its kinks")]
    b_T_2: Annotated[float, Quantity("N", "as b_T_1")]
    b_T_3: Annotated[float, Quantity("N", "as b_T_1")]
    b_T_4: Annotated[float, Quantity("N", "as b_T_1")]
    b_T_5: Annotated[float, Quantity("N", "as b_T_1")]
    b_T_6: Annotated[float, Quantity("N", "as b_T_1")]
    b_T_7: Annotated[float, Quantity("N", "as b_T_1")]
    b_T_8: Annotated[float, Quantity("N", "as b_T_1")]
    b_T_e: Annotated[float, Quantity("N", "tension of tendon b at the follower")]
    low: Annotated[float, Quantity("rad", "lowest follower angle so far")]
    high: Annotated[float, Quantity("rad", "highest follower angle so far")]
    a_below: Annotated[float, Quantity("N", "mean tension of what forward motion wound of a")]
    a_above: Annotated[float, Quantity("N", "mean tension of what backward motion wound of a")]
    b_below: Annotated[float, Quantity("N", "mean tension of what forward motion wound of b")]
    b_above: Annotated[float, Quantity("N", "mean tension of what backward motion wound of b")]
    x_a: Annotated[float, Quantity("m", "winding strain of tendon a")]
    x_b: Annotated[float, Quantity("m", "winding strain of tendon b")]


def loop_of(g: Rig, s: State) -> Loop:
    e = g.sheath.lam
    a_lam = (0.0, s.a_lam_1, s.a_lam_2, s.a_lam_3, s.a_lam_4, s.a_lam_5, s.a_lam_6, s.a_lam_7, s.a_lam_8, e)
    a_T = (s.a_T_0, s.a_T_1, s.a_T_2, s.a_T_3, s.a_T_4, s.a_T_5, s.a_T_6, s.a_T_7, s.a_T_8, s.a_T_e)
    b_lam = (0.0, s.b_lam_1, s.b_lam_2, s.b_lam_3, s.b_lam_4, s.b_lam_5, s.b_lam_6, s.b_lam_7, s.b_lam_8, e)
    b_T = (s.b_T_0, s.b_T_1, s.b_T_2, s.b_T_3, s.b_T_4, s.b_T_5, s.b_T_6, s.b_T_7, s.b_T_8, s.b_T_e)
    wound = Wound(s.low, s.high, s.a_below, s.a_above, s.b_below, s.b_above, s.x_a, s.x_b)
    return Loop(Profile(int(s.a_n), a_lam, a_T), Profile(int(s.b_n), b_lam, b_T), s.theta_in, s.theta_out, wound)


def state_of(loop: Loop, tau_load: float, way: float, stage: float) -> State:
    a = loop.a
    b = loop.b
    w = loop.wound
    return State(
        loop.theta_in, loop.theta_out, tau_load, way, stage,
        float(a.n), a.lam[1], a.lam[2], a.lam[3], a.lam[4], a.lam[5], a.lam[6], a.lam[7], a.lam[8],
        a.T[0], a.T[1], a.T[2], a.T[3], a.T[4], a.T[5], a.T[6], a.T[7], a.T[8], a.T[9],
        float(b.n), b.lam[1], b.lam[2], b.lam[3], b.lam[4], b.lam[5], b.lam[6], b.lam[7], b.lam[8],
        b.T[0], b.T[1], b.T[2], b.T[3], b.T[4], b.T[5], b.T[6], b.T[7], b.T[8], b.T[9],
        w.low, w.high, w.a_below, w.a_above, w.b_below, w.b_above, w.x_a, w.x_b,
    )  # fmt: skip
