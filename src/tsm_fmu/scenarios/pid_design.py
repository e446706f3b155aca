"""Position controller of a DC motor, designed and judged on the linear motor with python-control.

The motor without Coulomb friction, driving through its gear (`DcMotor` Eqs (1)-(5), e the efficiency)::

    G(s) = phi/u = e N k_t / (s [(L_a s + R_a)(J s + e N^2 b) + e N^2 k_t k_e]),  J = J_load + e N^2 J_rotor    (D1)
    C(s) = kp + ki/s + kd s/(T_f s + 1)                                                                       (D2)

A controller that runs at the communication points holds its output over a step h: a delay of h/2. Gains
follow from |L(i w_c)| = 1 and the phase margin at the chosen crossover w_c, with ki = kp w_c/10 (D3).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..cosim.metric import Metric
from ..kernels.kernel import kernel


@dataclass(frozen=True)
class Margins:
    """Of the loop with the delay of h/2.

    Attributes
    ----------
    crossover : float
        Gain crossover [rad/s].
    gain_margin_db, phase_margin_deg, delay_margin_s : float
    """

    crossover: float
    gain_margin_db: float
    phase_margin_deg: float
    delay_margin_s: float


@dataclass(frozen=True)
class PidDesign:
    """Gains, and the margins of the loop that they give.

    Attributes
    ----------
    kp, ki, kd, T_f : float
        As parameters of PidController [V/rad, V/(rad.s), V.s/rad, s].
    motor : Params of DcMotor
    step : float
        Communication step h [s].
    """

    kp: float
    ki: float
    kd: float
    T_f: float
    motor: Any
    step: float

    @property
    def gains(self) -> dict[str, float]:
        """Parameter values of PidController."""
        return {"kp": self.kp, "ki": self.ki, "kd": self.kd, "T_f": self.T_f}

    @cached_property
    def margins(self) -> Margins:
        """Margins of the loop."""
        return _margins(controller_model(**self.gains) * motor_model(self.motor), self.step / 2.0)

    def metrics(self) -> dict[str, Metric]:
        """Gains and margins with their units."""
        margins = self.margins
        return {
            "kp": Metric(self.kp, "V/rad"),
            "ki": Metric(self.ki, "V/(rad.s)"),
            "kd": Metric(self.kd, "V.s/rad"),
            "T_f": Metric(self.T_f, "s"),
            "gain_crossover": Metric(margins.crossover, "rad/s"),
            "gain_margin": Metric(margins.gain_margin_db, "dB"),
            "phase_margin": Metric(margins.phase_margin_deg, "deg"),
            "delay_margin": Metric(margins.delay_margin_s, "s"),
        }


def motor_model(motor: Any) -> Any:
    """Return G(s) of Eq (D1) from parameters of DcMotor."""
    import control  # here and below: two seconds, which a loop with the gains of a design need not pay

    return control.tf(*_motor_polynomials(motor))


def _motor_polynomials(motor: Any) -> tuple[list[float], list[float]]:
    """Numerator and denominator of Eq (D1), highest power first."""
    n, e = motor.gear_ratio, motor.efficiency
    inertia = motor.J_load + e * n * n * motor.J_rotor
    speed = np.polymul([motor.L_a, motor.R_a], [inertia, e * n * n * motor.b])
    speed[-1] += e * n * n * motor.k_t * motor.k_e
    return [e * n * motor.k_t], [*speed, 0.0]


def controller_model(kp: float, ki: float, kd: float, T_f: float) -> Any:
    """Return C(s) of Eq (D2)."""
    import control

    proportional: Any = control.tf([kp], [1.0])
    return proportional + control.tf([ki], [1.0, 0.0]) + control.tf([kd, 0.0], [T_f, 1.0])


def design_pid(
    motor: Any = None,
    *,
    crossover: float = 300.0,
    phase_margin_deg: float = 55.0,
    T_f: float = 2e-4,
    step: float = 1e-3,
) -> PidDesign:
    """Gains for a crossover [rad/s] and a phase margin [deg], Eq (D3).

    Parameters
    ----------
    motor : Params of DcMotor, optional
        Its defaults without it.
    crossover, phase_margin_deg : float
        What the loop shall have.
    T_f : float
        Time constant of the derivative filter [s].
    step : float
        Communication step h [s].
    """
    motor = motor if motor is not None else kernel("DcMotor").params()
    s = 1j * crossover
    above, below = (complex(np.polyval(part, s)) for part in _motor_polynomials(motor))
    delayed = above / below * np.exp(-s * step / 2.0)
    wanted = -np.exp(1j * math.radians(phase_margin_deg)) / delayed  # C(i w_c)
    proportional, derivative = 1.0 + crossover / 10.0 / s, s / (T_f * s + 1.0)
    kp, kd = np.linalg.solve(
        [[proportional.real, derivative.real], [proportional.imag, derivative.imag]], [wanted.real, wanted.imag]
    )
    ki = kp * crossover / 10.0
    return PidDesign(float(kp), float(ki), float(kd), T_f, motor, step)


def _margins(loop: Any, delay: float) -> Margins:
    """Margins of a loop behind a delay, this as a Pade form (order 4)."""
    import control

    delayed = loop * control.tf(*control.pade(delay, 4))
    gain, phase, _, _, crossover, _ = control.stability_margins(delayed)
    crossover, phase = float(crossover), float(phase)
    return Margins(crossover, 20.0 * math.log10(float(gain)), phase, math.radians(phase) / crossover)
