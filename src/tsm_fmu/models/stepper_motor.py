"""Hybrid stepper motor driven in micro-steps: a magnetic spring between the commanded and the actual angle.

AME 2020 drives its wheels with a stepper motor (57H7630A4) from a motion card. Kenjo, Sugawara, "Stepping Motors and
Their Microprocessor Controls" (1994), Sections 2.4 and 4.1, with N the number of rotor teeth::

    theta_s = q round(theta_p/q),   q = 2 pi/(4 N m)                                     (1)
    J d2theta/dt2 = tau_hold sin(N (theta_s - theta)) - b dtheta/dt - tau_load           (2)

m micro-steps make a full step of a quarter of a tooth pitch. At rest the load turns the rotor back by
asin(tau_load/tau_hold)/N; a load above tau_hold makes it lose steps, by whole tooth pitches, which (2) shows.

A motion card sends no pulses faster than it is told to: the angle that the pulses have come to, theta_p, follows the
command by omega_max dt at most, so that a command that jumps is taken up at that speed. 0 is no limit: a jump of more
than half a tooth pitch is then lost.

Discretisation: theta_cmd is the value wanted at the end of the step; theta_p moves towards it on a straight line, as a
train of pulses does; tau_load holds. (2) is solved by the symplectic Euler rule in as many parts as make the angle of
the natural frequency sqrt(N tau_hold/J) at most 0.05 rad a part: first order in that angle, stable at any step.

Validity: the current controller is ideal, the torque sinusoidal, detent torque and iron losses are left out.
"""

import math
from typing import Annotated, NamedTuple

from .contract import Preset, Quantity, Roles

NAME = "StepperMotor"

LARGEST_ANGLE = 0.05


class Params(NamedTuple):
    tau_hold: Annotated[float, Quantity("N.m", "holding torque, Eq (2); assumed", lo=0.0, open_lo=True)] = 1.9
    teeth: Annotated[int, Quantity("1", "number of rotor teeth N, Eq (2): 50 for steps of 1.8 deg", lo=1, hi=500)] = 50
    microsteps: Annotated[int, Quantity("1", "number of micro-steps a full step m, Eq (1); assumed", lo=1, hi=4096)] = (
        16
    )
    J: Annotated[float, Quantity("kg.m2", "inertia of rotor and wheel, Eq (2); assumed", lo=0.0, open_lo=True)] = 1.0e-4
    b: Annotated[float, Quantity("N.m.s/rad", "viscous damping, Eq (2); assumed", lo=0.0)] = 0.05
    theta_0: Annotated[float, Quantity("rad", "angle at the start", display="deg")] = 0.0
    omega_max: Annotated[
        float, Quantity("rad/s", "highest speed of the pulses; 0 is no limit", lo=0.0, display="deg/s")
    ] = 0.0


class State(NamedTuple):
    theta_p: Annotated[float, Quantity("rad", "angle of the pulses at the end of the last step")]
    theta: Annotated[float, Quantity("rad", "rotor angle")]
    omega: Annotated[float, Quantity("rad/s", "rotor speed")]


class Inputs(NamedTuple):
    theta_cmd: Annotated[float, Quantity("rad", "commanded angle", display="deg")]
    tau_load: Annotated[float, Quantity("N.m", "load torque, opposes motion to positive theta")]


class Outputs(NamedTuple):
    theta: Annotated[float, Quantity("rad", "rotor angle", display="deg")]
    omega: Annotated[float, Quantity("rad/s", "rotor speed", display="deg/s")]


ROLES = Roles(depends={"theta": (), "omega": ()})  # states: they do not follow at once

PRESETS = {
    "ame2020": Preset(
        source=(
            "AME 2020 names the motor, 57H7630A4, and nothing of it. Assumed: 1.8 deg a step, 16 micro-steps, 1.9 N.m "
            "as is usual for 57 mm frames of 76 mm, inertia of rotor and wheel, damping of half the critical"
        ),
        printed={"tau_hold": (1.9, "N.m"), "teeth": (50.0, "1"), "microsteps": (16.0, "1"), "J": (1000.0, "g.cm2")},
        si={},
    )
}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(u.theta_cmd, p.theta_0, 0.0), Outputs(p.theta_0, 0.0)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    q = math.pi / (2.0 * p.teeth * p.microsteps)
    parts = 1 + int(dt * math.sqrt(p.teeth * p.tau_hold / p.J) / LARGEST_ANGLE)
    moved = u.theta_cmd - s.theta_p
    if p.omega_max > 0.0:
        moved = max(-p.omega_max * dt, min(p.omega_max * dt, moved))
    h, rise = dt / parts, moved / parts
    theta, omega = s.theta, s.omega
    for k in range(parts):
        field = q * math.floor((s.theta_p + (k + 1) * rise) / q + 0.5)  # (1)
        pull = p.tau_hold * math.sin(p.teeth * (field - theta))
        omega = (p.J * omega + h * (pull - u.tau_load)) / (p.J + h * p.b)  # (2), damping implicit
        theta += h * omega
    return State(s.theta_p + moved, theta, omega), Outputs(theta, omega)
