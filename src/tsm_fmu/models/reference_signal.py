"""Reference trajectory with its first and second derivative.

MSSP 2015, Section 7, prints two of them: "periodic" (60 deg, 0.2 Hz) and "non-periodic" (30 deg at 0.2 Hz
and 30 deg at 0.25 sqrt(3) Hz); AME 2020 moves 785 mm there and back at 0.05 m/s. kind selects::

    1, sines:  y = offset + sum_j amplitude_j sin(2 pi frequency_j t + phase_j), j = 1..3             (1)
    2, ramp:   y = offset + stroke w(speed t/|stroke|), w = 0 -> 1 -> 0 with unit slope, then again   (2)
    3, chirp:  y = offset + amplitude_1 sin(2 pi (f_1 t + (f_2 - f_1) t^2/(2 duration)) + phase_1)    (3)

dy and ddy are the exact derivatives. In (2) dy jumps where the ramp turns (the value after the turn
holds) and ddy is 0; `cycles` there-and-back strokes are made, then the signal rests (0: without end). In (3)
f_1, f_2 are frequency_1, frequency_2; after `duration` the sine goes on at f_2 with continuous phase.

Source: MSSP 2015, Section 7; AME 2020, Section 5. Validity: any step size; the time is summed with
compensation (Kahan) so that it does not drift however many steps are made.
"""

import math
from typing import Annotated, NamedTuple

from .contract import DefaultExperiment, Preset, Quantity, Roles

NAME = "ReferenceSignal"
ROLES = Roles(experiment=DefaultExperiment(20.0, 0.01))


class Params(NamedTuple):
    kind: Annotated[
        int, Quantity("1", "1 sines, 2 ramp there and back, 3 chirp", lo=1, hi=3, choices=("sines", "ramp", "chirp"))
    ] = 1
    amplitude_1: Annotated[float, Quantity("rad", "first amplitude, Eqs (1), (3)", display="deg")] = 1.0471975511965976
    amplitude_2: Annotated[float, Quantity("rad", "second amplitude, Eq (1)", display="deg")] = 0.0
    amplitude_3: Annotated[float, Quantity("rad", "third amplitude, Eq (1)", display="deg")] = 0.0
    frequency_1: Annotated[float, Quantity("Hz", "first frequency, Eqs (1), (3)", lo=0.0)] = 0.2
    frequency_2: Annotated[float, Quantity("Hz", "second frequency, Eqs (1), (3)", lo=0.0)] = 0.4330127018922193
    frequency_3: Annotated[float, Quantity("Hz", "third frequency, Eq (1)", lo=0.0)] = 0.0
    phase_1: Annotated[float, Quantity("rad", "first phase, Eqs (1), (3)", display="deg")] = 0.0
    phase_2: Annotated[float, Quantity("rad", "second phase, Eq (1)", display="deg")] = 0.0
    phase_3: Annotated[float, Quantity("rad", "third phase, Eq (1)", display="deg")] = 0.0
    offset: Annotated[float, Quantity("rad", "offset, Eqs (1)-(3)", display="deg")] = 0.0
    speed: Annotated[float, Quantity("rad/s", "speed of the ramp, Eq (2)", lo=0.0)] = 4.0
    stroke: Annotated[float, Quantity("rad", "travel of the ramp, signed, Eq (2)", display="deg")] = 62.8
    cycles: Annotated[float, Quantity("1", "strokes there and back, Eq (2); 0 is without end", lo=0.0)] = 0.0
    duration: Annotated[float, Quantity("s", "time from frequency_1 to frequency_2, Eq (3)", lo=0.0, open_lo=True)] = (
        60.0
    )


class State(NamedTuple):
    t: Annotated[float, Quantity("s", "time since the start")]
    t_rest: Annotated[float, Quantity("s", "what the rounding of t left out")]


class Inputs(NamedTuple):
    pass


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("rad", "reference, Eqs (1)-(3)", display="deg")]
    dy: Annotated[float, Quantity("rad/s", "first derivative of y", display="deg/s")]
    ddy: Annotated[float, Quantity("rad/s2", "second derivative of y", display="deg/s2")]


PRESETS = {
    "published": Preset(
        source="MSSP 2015, Section 7, periodic motion",
        printed={"amplitude_1": (60.0, "deg"), "frequency_1": (0.2, "Hz")},
        si={},
    ),
    "non_periodic": Preset(
        source="MSSP 2015, Section 7, non-periodic motion; the second frequency is 0.25 sqrt(3) Hz",
        printed={
            "amplitude_1": (30.0, "deg"),
            "amplitude_2": (30.0, "deg"),
            "frequency_1": (0.2, "Hz"),
            "frequency_2": (0.4330127018922193, "Hz"),
        },
        si={"amplitude_1": 0.5235987755982988, "amplitude_2": 0.5235987755982988},
    ),
    "ame2020": Preset(
        source="AME 2020: 785 mm there and back once at 0.05 m/s, on a wheel of radius 12.5 mm",
        printed={"kind": (2.0, "1"), "speed": (4.0, "rad/s"), "stroke": (62.8, "rad"), "cycles": (1.0, "1")},
        si={"kind": 2, "cycles": 1.0},
    ),
}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(0.0, 0.0), _signal(p, 0.0)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    increment = dt + s.t_rest
    t = s.t + increment
    return State(t, increment - (t - s.t)), _signal(p, t)


def _signal(p: Params, t: float) -> Outputs:
    if p.kind == 1:
        return _sines(p, t)
    if p.kind == 2:
        return _ramp(p, t)
    return _chirp(p, t)


def _sines(p: Params, t: float) -> Outputs:
    y, dy, ddy = p.offset, 0.0, 0.0
    if p.amplitude_1 != 0.0:  # most signals have one sine or two: the others cost nothing
        w = math.tau * p.frequency_1
        angle = w * t + p.phase_1
        y += p.amplitude_1 * math.sin(angle)  # (1) and its derivatives
        dy += w * p.amplitude_1 * math.cos(angle)
        ddy -= w * w * p.amplitude_1 * math.sin(angle)
    if p.amplitude_2 != 0.0:
        w = math.tau * p.frequency_2
        angle = w * t + p.phase_2
        y += p.amplitude_2 * math.sin(angle)
        dy += w * p.amplitude_2 * math.cos(angle)
        ddy -= w * w * p.amplitude_2 * math.sin(angle)
    if p.amplitude_3 != 0.0:
        w = math.tau * p.frequency_3
        angle = w * t + p.phase_3
        y += p.amplitude_3 * math.sin(angle)
        dy += w * p.amplitude_3 * math.cos(angle)
        ddy -= w * w * p.amplitude_3 * math.sin(angle)
    return Outputs(y, dy, ddy)


def _ramp(p: Params, t: float) -> Outputs:
    if p.stroke == 0.0 or p.speed == 0.0:
        return Outputs(p.offset, 0.0, 0.0)
    turns = p.speed * t / abs(p.stroke)  # in strokes: one is there, two is back
    if p.cycles > 0.0 and turns >= 2.0 * p.cycles:
        return Outputs(p.offset + p.stroke * _there_and_back(2.0 * p.cycles), 0.0, 0.0)
    slope = math.copysign(p.speed, p.stroke)
    if turns % 2.0 >= 1.0:
        slope = -slope
    return Outputs(p.offset + p.stroke * _there_and_back(turns), slope, 0.0)  # (2)


def _there_and_back(turns: float) -> float:
    within = turns % 2.0
    return within if within < 1.0 else 2.0 - within


def _chirp(p: Params, t: float) -> Outputs:
    swept = min(t, p.duration)
    cycles = p.frequency_1 * swept + (p.frequency_2 - p.frequency_1) * swept * swept / (2.0 * p.duration)
    w = math.tau * (p.frequency_1 + (p.frequency_2 - p.frequency_1) * swept / p.duration)
    dw = math.tau * (p.frequency_2 - p.frequency_1) / p.duration if t < p.duration else 0.0
    angle = math.tau * (cycles + p.frequency_2 * (t - swept)) + p.phase_1
    sine, cosine = math.sin(angle), math.cos(angle)
    a = p.amplitude_1
    return Outputs(p.offset + a * sine, a * w * cosine, a * (dw * cosine - w * w * sine))  # (3) and its derivatives
