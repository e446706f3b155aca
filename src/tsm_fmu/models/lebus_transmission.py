"""Long-distance double tendon-sheath transmission with LeBus wheels: driver angle to follower angle under load.

Jia et al., Adv. Mech. Eng. 2020 (DOI 10.1177/1687814020904565), Eqs (14)-(36), quasi-static and rate independent. The
equations, each with its number and its correction, are in `capstan` (one tendon in its sheath), `lebus_loop` (two
tendons, two wheels) and `lebus_geometry` (grooves and layers). What a user sees::

    e+ = r (theta_in - theta_out) = (T_a0 I - T_0 L)/EA [+ s_out (T_a0 - T_0)/EA]  pulling, tendon b loose    (23),(30)
    I  = int_0^L exp(-lam(l)) dl = L (1 - exp(-lam))/lam for a uniform bend,  T_a0 = T_ae exp(lam)
    T_a0' = T_a0 (1 - sqrt(s EA mu/(R T_a0)))^2         after turning back by s in a uniform bend; follower still
    lost motion of a reversal: (2 T_ae L/EA)(cosh(lam) - 1)/lam while one tendon keeps the load (hanging weight)
    tau_in = T_a r_a - T_b r_b

Conventions. Tendon a pulls for theta_in > 0, tendon b for theta_in < 0. tau_load > 0 resists theta_out > 0, so tendon a
carries it (a weight m hung on the follower: tau_load = m g D/2) whichever way the driver turns; tau_load < 0 hangs on
tendon b. theta_out = theta_in is the unloaded reference with tendon a at its preload T_0; a load already there at the
start lets the follower give way at once. A load that changes with theta_in at the same step acts first.

Stages: 0 delay (at rest, or the driver only takes up slack: no tension changes), 1 transition (reversal fronts travel
along the sheaths, the follower is still), 2 running (the follower moves). At rest the last stage stays.

* Slack: the reported 156 to 206 mm of lost motion at a reversal (2.0 to 2.6 turns) cannot be elastic (EA would have to
  be 30 to 60 times below that of the fibre), and no equation of the paper yields it. It is an input: ``slack`` is the
  length by which tendon b is longer than at preload. The presets m05_180 ... carry values read off the reported ones.
* EA: the fibre data give 6482 to 9973 N. The default 6786 N fits the four forward errors with winding strain (rms
  0.85 mm). Without it a fit wants 3444 N, outside the fibre's range. The reported load dependence is steeper than that
  of any linear elastic model: the four cases cannot all be matched.
* Wheel friction: (24) subtracts a force per length from a tension. With the missing slip length s_w (unpublished,
  default 0: off) the driver wheel holds T_a = T_a0 +- F_w, F_w = f' s_w of `lebus_winding` with cos(gamma) = 1 (the
  fleet angle changes it by 3e-5); (24) then takes delta_a from T_a - F_w. The load sets T_a0, so s_w adds to T_a and
  tau_in, not to the forward error; as printed it could only lower that, against what was measured.
* Layers (``layers`` = 1): radii r_j, n_t turns per layer; side a of the driver starts empty, that of the follower full.
  The driver must stay between 0 and n_layers n_t turns. Without layers all radii are D/2, as in the paper.
* Sheath: n_seg pieces from the driver, L_i long with bending radius R_i, 0 for a straight one. Where the bends lie is
  not published and matters: a uniform bend is the default. If the history of fronts needs more than eight kinks per
  tendon, the smallest fold is replaced by its chord (`capstan`).

Validity: quasi-static motion of a massless linear-elastic tendon with Coulomb friction in sheaths that do not move.
"""

import math
from typing import Annotated, Any, NamedTuple

from .contract import Condition, DefaultExperiment, Preset, Quantity, Roles
from .laws.capstan import Eight, sheath_of, stretched
from .laws.signs import sign
from .lebus.geometry import layers_below, wheel_friction
from .lebus.loop import advance, reference_loop, settle, stretch_b
from .lebus.rig import Rig, rig, stay_in_grooves
from .lebus.state import State, loop_of, state_of

NAME = "LebusTransmission"
ROLES = Roles(experiment=DefaultExperiment(31.4, 0.02))


class Params(NamedTuple):
    n_seg: Annotated[int, Quantity("1", "number of pieces of sheath that count", lo=1, hi=8)] = 1
    L: Annotated[
        Eight, Quantity("m", "length of a piece of sheath, from the driver, Eq (16)", lo=0.0, display="mm")
    ] = (1.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    R: Annotated[Eight, Quantity("m", "bending radius of that piece, 0: straight, Eq (16)", lo=0.0, display="mm")] = (
        1.5 / math.pi, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
    )  # fmt: skip
    mu: Annotated[float, Quantity("1", "friction coefficient of tendon and sheath, Eq (14)", lo=0.0)] = 0.16
    EA: Annotated[float, Quantity("N", "axial stiffness of the tendon, Eq (20)", lo=0.0, open_lo=True)] = 6786.0
    T_0: Annotated[float, Quantity("N", "preload of both tendons", lo=0.0)] = 1.1
    slack: Annotated[
        float, Quantity("m", "length by which tendon b is longer than at preload (ours)", lo=0.0, display="mm")
    ] = 0.154
    D: Annotated[float, Quantity("m", "wheel diameter", lo=0.0, open_lo=True, display="mm")] = 0.025
    d: Annotated[float, Quantity("m", "tendon diameter", lo=0.0, open_lo=True, display="mm")] = 3.05e-4
    n_t: Annotated[float, Quantity("1", "turns in a layer; assumed", lo=0.0, open_lo=True)] = 6.67
    n_layers: Annotated[int, Quantity("1", "number of layers", lo=1, hi=20)] = 2
    s_w: Annotated[
        float, Quantity("m", "length over which the tendon slips on the driver wheel; unpublished, 0: off", lo=0.0)
    ] = 0.0
    winding_strain: Annotated[
        int, Quantity("1", "1: wheels wind strained tendon (ours), 0: not", lo=0, hi=1, choices=("off", "on"))
    ] = 1
    layers: Annotated[
        int,
        Quantity("1", "1: layers change the radii (ours), 0: D/2 as in the paper", lo=0, hi=1, choices=("off", "on")),
    ] = 0


class Inputs(NamedTuple):
    theta_in: Annotated[float, Quantity("rad", "driver angle", display="deg")]
    tau_load: Annotated[float, Quantity("N.m", "load torque on the follower, positive on tendon a")]


class Outputs(NamedTuple):
    theta_out: Annotated[float, Quantity("rad", "follower angle, Eqs (30) and (36)", display="deg")]
    T_a: Annotated[float, Quantity("N", "tension of tendon a at the driver wheel")]
    T_b: Annotated[float, Quantity("N", "tension of tendon b at the driver wheel")]
    elongation: Annotated[float, Quantity("m", "tendon a beyond its preload stretch, Eq (23)", display="mm")]
    slack_b: Annotated[float, Quantity("m", "length by which tendon b is loose, Eqs (27) and (34)", display="mm")]
    tau_in: Annotated[float, Quantity("N.m", "torque that the driver must supply")]
    stage: Annotated[
        int, Quantity("1", "0 delay, 1 transition, 2 running", lo=0, hi=2, choices=("delay", "transition", "running"))
    ]


SOURCE = "AME 2020, experimental design; slack from the reported reverse errors, EA fitted within the fibre's range"
COMMON = {"L_1": (1500.0, "mm"), "mu": (0.16, "1"), "T_0": (1.1, "N"), "D": (25.0, "mm"), "d": (0.305, "mm")}
R_540 = 0.5 / math.pi
PRESETS = {
    "published": Preset(SOURCE + "; slack of the case 0.5 kg, 180 deg", {**COMMON, "slack": (154.0, "mm")}, {}),
    "m05_180": Preset(
        SOURCE + "; load 0.5 kg, 180 deg in all",
        {**COMMON, "slack": (154.0, "mm"), "R_1": (1500.0 / math.pi, "mm")},
        {},
    ),
    "m05_540": Preset(
        SOURCE + "; load 0.5 kg, 540 deg in all",
        {**COMMON, "slack": (183.0, "mm"), "R_1": (500.0 / math.pi, "mm")},
        {"slack": 0.183, "R_1": R_540},
    ),
    "m10_180": Preset(
        SOURCE + "; load 1 kg, 180 deg in all",
        {**COMMON, "slack": (198.0, "mm"), "R_1": (1500.0 / math.pi, "mm")},
        {"slack": 0.198},
    ),
    "m10_540": Preset(
        SOURCE + "; load 1 kg, 540 deg in all",
        {**COMMON, "slack": (198.0, "mm"), "R_1": (500.0 / math.pi, "mm")},
        {"slack": 0.198, "R_1": R_540},
    ),
}

LARGEST_LAM = 30.0  # exp(lam) gains 13 decades: beyond it no tension survives the sheath


def empty_piece(p: Any) -> int:
    """Number of the shortest piece of sheath that counts, from 1."""
    shortest = 0
    for i in range(p.n_seg):
        if p.L[i] < p.L[shortest]:
            shortest = i
    return shortest + 1


def shortest_length(p: Any) -> float:
    """Length of that piece [m]."""
    return p.L[empty_piece(p) - 1]


def total_bend(p: Any) -> float:
    """lam, mu times the total bending angle."""
    return sheath_of(p.mu, p.n_seg, p.L, p.R).lam


def bend_left(p: Any) -> float:
    """What lam is below the largest one."""
    return LARGEST_LAM - total_bend(p)


def wheel_share(p: Any) -> float:
    """Largest part of the tension that the friction on the wheel takes."""
    return 2.0 * wheel_friction(p.mu, 1.0, 0.0, p.D, p.d, 0) * p.s_w


def tension_left(p: Any) -> float:
    """Part of the tension that is left behind the wheel."""
    return 1.0 - wheel_share(p)


def longest_slip(p: Any) -> float:
    """Slip length [m] at which the wheel takes the whole tension."""
    return p.s_w / wheel_share(p)


CONDITIONS = (
    Condition(
        "a length above 0 (the distance from the driver must grow, Eq (16))",
        shortest_length,
        "L_{piece} = {margin!r} m with n_seg = {n_seg}",
        "set L_{piece} or lower n_seg",
        numbers={"piece": empty_piece},
    ),
    Condition(
        f"at most {LARGEST_LAM:g}",
        bend_left,
        "mu times the total bending angle = {lam!r}",
        "check mu, L_i and R_i (all in metres)",
        closed=True,
        numbers={"lam": total_bend},
    ),
    Condition(
        "below {longest!r} m, where wheel friction takes the whole tension",
        tension_left,
        "s_w = {s_w!r} m",
        "shorten s_w",
        numbers={"longest": longest_slip},
    ),
)


def _outputs(p: Params, g: Rig, s: State) -> Outputs:
    loop = loop_of(g, s)
    filled = layers_below(s.theta_in, g.layer_angle, g.n_layers, 1.0)
    r_a = g.r_1 + filled * g.rise
    r_b = g.r_1 + (g.n_layers - 1 - filled) * g.rise
    F_a = s.way * wheel_friction(p.mu, s.a_T[0], 0.0, p.D, p.d, filled) * p.s_w
    F_b = s.way * wheel_friction(p.mu, s.b_T[0], 0.0, p.D, p.d, g.n_layers - 1 - filled) * p.s_w
    T_a = s.a_T[0] + F_a  # (24)
    T_b = s.b_T[0] - F_b
    elongation = stretched(g.sheath, loop.a) / g.EA - g.delta_0  # (23)
    slack_b = max(-stretch_b(g, loop, s.theta_in), 0.0) if s.b_T[0] == 0.0 else 0.0  # (34)
    return Outputs(s.theta_out, T_a, T_b, elongation, slack_b, T_a * r_a - T_b * r_b, int(s.stage))


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    g = rig(p)
    stay_in_grooves(g, u.theta_in)
    loop = settle(g, reference_loop(g, u.theta_in), u.tau_load)
    s = state_of(loop, u.tau_load, 0.0, 0.0)
    return s, _outputs(p, g, s)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    g = rig(p)
    stay_in_grooves(g, u.theta_in)
    loop = loop_of(g, s)
    if u.tau_load != s.tau_load:
        loop = settle(g, loop, u.tau_load)
    way = sign(u.theta_in - s.theta_in)
    stage = s.stage
    if way != 0.0:
        moved = advance(g, loop, way, u.theta_in, u.tau_load)
        changed = moved.a.T[0] != loop.a.T[0] or moved.b.T[0] != loop.b.T[0]
        stage = 2.0 if moved.theta_out != loop.theta_out else (1.0 if changed else 0.0)
        loop = moved
    else:
        way = s.way
    after = state_of(loop, u.tau_load, way, stage)
    return after, _outputs(p, g, after)
