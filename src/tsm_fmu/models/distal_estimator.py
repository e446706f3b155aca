"""Distal angle and torque of a tendon-sheath drive from proximal signals alone: haptic force feedback.

The use that MMT 2015 and MSSP 2015 (Fig. 9) make of their models; here Eqs (T1), (T2) of TendonDrive solved for the
distal side::

    x_out   = c x_in + x_h + x_0                                                        (T1)
    tau_out = (tau_in - g_LuGre(v_in))/ratio                                            (D2)

Just after a reversal the friction turns within a travel that an encoder hardly resolves, and (D2) answers with a spike
as large as the friction. With ``hold`` = 1 the friction there is left open (ours): all that is known of a drive that
sticks is that its friction lies between the two sliding levels, so the load stays what it was as long as it can::

    tau_out = clip(tau_out of the last step, (tau_in - F_pull)/ratio, (tau_in - F_release)/ratio)   (D3)

with F_pull, F_release the friction of sliding at |v_in| in either direction. The first value to hold is the load at the
moment when the drive first slides, until when (D2) stands; in a chain with friction effects that is when their own
presliding state slides too. Right for loads that change slowly beside the reversals.

Validity: parameters, state and bounds are those of TendonDrive, so one fitted set serves both.
"""

from typing import Annotated, Any, NamedTuple

from .contract import SLIDING_SHARE, FrictionPort, HeldLoad, Quantity, Roles
from .joined import Part, joined
from .laws.lugre import stribeck
from .tendon_drive import CONDITIONS as CONDITIONS
from .tendon_drive import PRESETS as PRESETS
from .tendon_drive import ROLES as DRIVE_ROLES
from .tendon_drive import Params as DriveParams
from .tendon_drive import State as DriveState
from .tendon_drive import distal_angle, friction_torque, moved, rest

NAME = "DistalEstimator"


class Holding(NamedTuple):
    """What the estimator has beyond the drive."""

    hold: Annotated[
        int,
        Quantity(
            "1", "1: keep the load while the drive sticks, Eq (D3); 0: Eq (D2)", lo=0, hi=1, choices=("off", "on")
        ),
    ] = 0


class Held(NamedTuple):
    """State that the estimator has beyond the drive."""

    tau_out: Annotated[float, Quantity("N.m", "torque on the distal side at the end of the last step")]
    slid: Annotated[float, Quantity("1", "1 once the drive has slid, 0 before")]


Params = joined(__name__, "Params", Part("", DriveParams, DriveParams(), {}), Part("", Holding, Holding(), {}))
State = joined(__name__, "State", Part("", DriveState, None, {}), Part("", Held, None, {}))


class Inputs(NamedTuple):
    x_in: Annotated[float, Quantity("rad", "drive-side angle", display="deg")]
    tau_in: Annotated[float, Quantity("N.m", "measured drive torque")]


class Outputs(NamedTuple):
    x_out: Annotated[float, Quantity("rad", "distal angle, Eq (T1)", display="deg")]
    tau_out: Annotated[float, Quantity("N.m", "torque on the distal side, Eq (D2) or (D3)")]


def start(p: Any, u: Inputs) -> tuple[Any, Outputs]:
    drive = rest(p, u.x_in)
    tau_out = (u.tau_in - friction_torque(p, drive)) / p.ratio
    return State(drive.x_in, drive.x_h, drive.v_in, drive.z, tau_out, 0.0), Outputs(distal_angle(p, drive), tau_out)


def step(p: Any, s: Any, u: Inputs, dt: float) -> tuple[Any, Outputs]:
    drive = moved(p, s, u.x_in, dt)
    if p.hold == 1 and s.slid == 1.0:
        level = sliding_level(p, drive.v_in)
        tau_out = held_load(s.tau_out, (u.tau_in - level) / p.ratio, (u.tau_in + level) / p.ratio)
    else:
        tau_out = (u.tau_in - friction_torque(p, drive)) / p.ratio  # (D2)
    slid = 1.0 if s.slid == 1.0 else drive_slides(p, drive.z, bristle_level(p, drive.v_in))
    after = State(drive.x_in, drive.x_h, drive.v_in, drive.z, tau_out, slid)
    return after, Outputs(distal_angle(p, drive), tau_out)  # (T1)


def drive_slides(p: Any, z: float, level: float) -> float:
    """1 where the bristles have `SLIDING_SHARE` of their sliding deflection, whose force is `level`, else 0."""
    return 1.0 if p.sigma0 * abs(z) > SLIDING_SHARE * level else 0.0


def held_load(last: float, pull: float, release: float) -> float:
    """Load between those of sliding in pull and in release, Eq (D3)."""
    return min(max(last, pull), release)


def bristle_level(p: Any, v: float) -> float:
    """What the bristles carry of the friction of sliding at the speed |v|."""
    return stribeck(v, p.tau_c, p.tau_s, p.v_s)


def sliding_level(p: Any, v: float) -> float:
    """Friction of sliding at the speed |v|, F_pull = -F_release of Eq (D3)."""
    return bristle_level(p, v) + p.sigma2 * abs(v)


def friction_in(p: Any, u: Inputs, o: Outputs) -> float:
    """Friction in the outputs, for a chain with effects."""
    return u.tau_in - p.ratio * o.tau_out


def with_friction(p: Any, u: Inputs, o: Outputs, f: float) -> Outputs:
    """Outputs with the friction ``f`` instead, Eq (D2)."""
    return Outputs(o.x_out, (u.tau_in - f) / p.ratio)


def with_load(p: Any, u: Inputs, o: Outputs, load: float) -> Outputs:
    """Outputs with another load, for a chain whose friction band follows from effects too, Eq (D3)."""
    return Outputs(o.x_out, load)


ROLES = Roles(
    motion="x_in",
    load="tau_out",
    drive="tau_in",
    has=DRIVE_ROLES.has,
    plausible=DRIVE_ROLES.plausible,
    depends={"x_out": ("x_in",)},
    friction=FrictionPort("tau_in", friction_in, with_friction),
    held_load=HeldLoad(sliding_level, held_load, with_load),
    lost_motion=DRIVE_ROLES.lost_motion,
)
